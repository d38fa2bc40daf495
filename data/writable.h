#pragma once
#include <string>

namespace flash::data {

/// Before a long computation: throws InputError, "PATH: cannot be written: Not a directory", unless files can
/// be made in the folder `path`, which may not exist yet. Leaves nothing.
void check_folder_writable(const std::string& path);

/// Checks likewise that the file `path` can be made; no folder and no device may stand in its place.
void check_file_writable(const std::string& path);

}  // namespace flash::data
