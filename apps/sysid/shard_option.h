#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "sysid/replay/shard.h"

namespace flash {

/// A search that several programs share (sysid::Shard).
struct ShardOptions {
  std::string shard;  ///< empty: one program does all
  double patience = sysid::Shard{}.patience;
  bool own_share = false;
};
void add_shard_options(CLI::App& verb, ShardOptions& options);

/// "2/3", the second of three; "slurm": the task of a job array, by the variables that Slurm sets, read by
/// `variable` (null where unset). Throws data::InputError that names --shard.
sysid::Shard parse_shard(
    const std::string& text, const std::function<const char*(const char*)>& variable = [](const char* name) {
      return std::getenv(name);
    });

/// Its settings, one of one without --shard. Throws data::InputError.
sysid::Shard shard_of(const ShardOptions& options);

/// Where results of its own go: the first writes the answer, so its folder is that of the search.
std::string folder_of_shard(const std::string& out, const sysid::Shard& shard);

}  // namespace flash
