#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace flash {

/// --despite-doubts, the same in all programs: goes on where a verb would refuse what it is given. --force
/// writes over what is there, and does nothing else. `meaning` says what is taken.
inline void add_doubts_option(CLI::App& verb, bool& despite_doubts, const std::string& meaning) {
  verb.add_flag("--despite-doubts", despite_doubts, meaning);
}

}  // namespace flash
