#pragma once
#include <string>
#include <vector>

namespace flash {

/// What a verb may write over by --force, of what this run does not read.
enum class Replaced { results, assets, anything };

/// Files to write, empty where there are none: each is a file of its own, and none is one of `read`, whatever
/// links and folders its path goes through, or an input of other runs (input_there): with Replaced::assets
/// but for assets. Throws data::InputError.
void expect_own_files(const std::vector<std::string>& written, const std::vector<std::string>& read,
                      Replaced replaced = Replaced::results);

/// A folder to write that is there already holds none of the files `read`. Throws data::InputError.
void expect_folder_apart(const std::string& folder, const std::vector<std::string>& read);

}  // namespace flash
