#pragma once
#include <string>
#include <vector>

namespace flash::data {

/// Before a long computation: throws InputError, "PATH: cannot be written: Not a directory", unless files can
/// be made in the folder `path`, which may not exist yet. Leaves nothing.
void check_folder_writable(const std::string& path);

/// Checks likewise that the file `path` can be made; no folder and no device may stand in its place.
void check_file_writable(const std::string& path);

/// The same, and unless `overwrite`: throws InputError, "PATH: exists already; ...", where the folder holds
/// something, or the file is there.
void check_folder_free(const std::string& path, bool overwrite);
void check_file_free(const std::string& path, bool overwrite);

/// Of a folder that may hold other things: throws unless `overwrite` where one of `names` is in it.
void check_names_free(const std::string& folder, const std::vector<std::string>& names, bool overwrite);

}  // namespace flash::data
