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

InputError held(const std::string& folder) {
  return InputError(folder + ": another run is writing to it; wait for it, or name another folder");
}

/// Whether another run has the lock.
bool is_taken(int descriptor, int kind) {
  return descriptor >= 0 && ::flock(descriptor, kind | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

int open_search_lock(const fs::path& folder) {
  return ::open((folder / search_lock).c_str(), O_RDONLY | O_CLOEXEC);
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

void expect_not_held(const std::string& folder) {
  bool taken = false;
  for (const int descriptor : {open_folder(folder), open_search_lock(folder)}) {
    taken = is_taken(descriptor, LOCK_SH) || taken;
    if (descriptor >= 0) ::close(descriptor);
  }
  if (taken) throw held(folder);
}

RunFolder::RunFolder(const std::string& folder) {
  const fs::path path = fs::absolute(folder);
  for (fs::path missing = path; !fs::exists(missing); missing = missing.parent_path())
    made_.push_back(missing);
  do {
    if (descriptor_ >= 0) ::close(descriptor_);
    fs::create_directories(path);
    descriptor_ = open_folder(path);
    if (is_taken(descriptor_, LOCK_EX)) {
      ::close(descriptor_);
      throw held(folder);
    }
  } while (descriptor_ >= 0 && !still_stands(descriptor_, path));
  search_ = open_search_lock(path);
  if (!is_taken(search_, LOCK_EX)) return;
  for (const int descriptor : {search_, descriptor_}) ::close(descriptor);
  throw held(folder);
}

RunFolder::~RunFolder() {
  std::error_code filled;  // a folder that holds something stays
  for (const fs::path& folder : made_) fs::remove(folder, filled);
  for (const int descriptor : {search_, descriptor_})
    if (descriptor >= 0) ::close(descriptor);
}

}  // namespace flash::data
