#include "data/files/writable.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "data/files/error.h"

namespace flash::data {
namespace {

namespace fs = std::filesystem;

InputError exists_already(const std::string& path) {
  return InputError(path + ": exists already; choose another name, or --force to overwrite");
}

InputError refusal(const std::string& path, const std::string& reason) {
  return InputError(path + ": cannot be written: " + reason);
}

/// Of what will stand there when folders on the way are made: "missing/../lift" is lift.
fs::file_status status_of(const fs::path& named, const std::string& path) {
  std::error_code code;
  const fs::path whole = fs::weakly_canonical(fs::absolute(named, code), code);
  const fs::path place = code ? named : whole;
  const fs::file_status status = fs::status(place, code);
  if (!fs::status_known(status)) throw refusal(path, code.message());
  if (!fs::exists(status) && fs::is_symlink(fs::symlink_status(place, code)))
    throw refusal(path, named.string() + " is a link to a place that is not there");
  return status;
}

/// Makes a file in `folder`, or in the folder that it would be made in, and takes it away: permissions alone
/// do not tell, as a file system may be read-only or take no files at all. It has no name where the file
/// system has such files: then a kill leaves none.
void check_place(fs::path folder, const std::string& path) {
  while (!fs::exists(status_of(folder, path))) folder = folder.parent_path();
#ifdef O_TMPFILE
  if (const int nameless = ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666); nameless >= 0) {
    ::close(nameless);
    return;
  }
#endif
  const std::string probe = (folder / ('.' + std::to_string(::getpid()) + "-0.tmp")).string();
  const int descriptor = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) throw refusal(path, std::strerror(errno));
  ::close(descriptor);
  ::unlink(probe.c_str());
}

}  // namespace

void check_folder_writable(const std::string& path) { check_place(fs::absolute(path), path); }

void check_file_writable(const std::string& path) {
  const fs::file_status status = status_of(path, path);
  if (fs::is_directory(status)) throw refusal(path, "it is a folder, expected a file");
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw refusal(path, "it is a device, a pipe or a socket");
  check_place(fs::absolute(path).parent_path(), path);
}

void check_folder_free(const std::string& path, bool overwrite) {
  const fs::file_status status = status_of(path, path);
  if (fs::exists(status) && !fs::is_directory(status))
    throw InputError(path + ": exists already, and is no folder; choose another name");
  if (!overwrite && fs::exists(status) && !(fs::is_directory(status) && fs::is_empty(path)))
    throw exists_already(path);
  check_folder_writable(path);
}

void check_file_free(const std::string& path, bool overwrite) {
  const fs::file_status status = status_of(path, path);
  if (!overwrite && fs::exists(status) && !fs::is_directory(status)) throw exists_already(path);
  check_file_writable(path);
}

void check_names_free(const std::string& folder, const std::vector<std::string>& names, bool overwrite) {
  for (const std::string& name : names) {
    const std::string path = (fs::path(folder) / name).string();
    if (!overwrite && fs::exists(status_of(path, path))) throw exists_already(path);
  }
  check_folder_writable(folder);
}

}  // namespace flash::data
