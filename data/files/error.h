#pragma once
#include <stdexcept>
#include <string>

namespace flash::data {

/// Bad usage or input: one line that names file, field, what was found and what was expected. Tools exit 2 on
/// it.
struct InputError : std::runtime_error {
  /// Control characters in `message`, which may quote the input, become question marks.
  explicit InputError(const std::string& message);
};

/// What a computation throws that was asked to stop before its end. Nothing of it is to be kept.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped before the end; nothing was written") {}
};

/// The message "source: field: what", e.g. "towel.json: mechanical_props.poison: unknown field (did you mean
/// ...)".
inline InputError input_error(const std::string& source, const std::string& field, const std::string& what) {
  return InputError(source + ": " + field + ": " + what);
}

}  // namespace flash::data
