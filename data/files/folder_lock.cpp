#include "data/files/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "data/files/error.h"

namespace flash::data {
namespace {

namespace fs = std::filesystem;

int open_folder(const fs::path& folder) { return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); }

/// Whether the folder that stands at `path` is the one that was opened: another run may have taken it away.
bool still_stands(int descriptor, const fs::path& path) {
  struct stat opened {};
  struct stat named {};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

FolderLock::FolderLock(const std::string& file) {
  if (file.empty()) return;
  const fs::path folder = fs::absolute(file).parent_path();
  fs::create_directories(folder);
  descriptor_ = open_folder(folder);
  while (descriptor_ >= 0 && ::flock(descriptor_, LOCK_EX) != 0 && errno == EINTR) {
  }
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);  // which releases it
}

RunFolder::RunFolder(const std::string& folder) {
  const fs::path path = fs::absolute(folder);
  for (fs::path missing = path; !fs::exists(missing); missing = missing.parent_path())
    made_.push_back(missing);
  do {
    if (descriptor_ >= 0) ::close(descriptor_);
    fs::create_directories(path);
    descriptor_ = open_folder(path);
    if (descriptor_ >= 0 && ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      ::close(descriptor_);
      throw InputError(folder + ": another run is writing to it; wait for it, or name another folder");
    }
  } while (descriptor_ >= 0 && !still_stands(descriptor_, path));
}

RunFolder::~RunFolder() {
  std::error_code filled;  // a folder that holds something stays
  for (const fs::path& folder : made_) fs::remove(folder, filled);
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace flash::data
