#pragma once
#include <string>
#include <vector>

namespace flash::sysid {

/// The names, each of them once: a second "lift" becomes "lift_2".
std::vector<std::string> told_apart(const std::vector<std::string>& names);

/// A name for a file or folder each, told apart even where case does not count. Letters, digits, '-', '_',
/// '.', spaces inside and bytes beyond ASCII stay, all others become '_'; it has 1 to 80 bytes and begins
/// with no dot.
std::vector<std::string> file_names(const std::vector<std::string>& names);

}  // namespace flash::sysid
