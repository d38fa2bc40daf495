#include "data/files/staged_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <regex>
#include <system_error>
#include <vector>

#include "data/files/error.h"

namespace flash::data {
namespace {

namespace fs = std::filesystem;

/// Frames of an earlier, longer recording would follow those of this one.
void remove_numbered_frames(const fs::path& folder) {
  static const std::regex name(R"(\d{3,}\.(ply|png))");
  std::vector<fs::path> old;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && std::regex_match(entry.path().filename().string(), name))
      old.push_back(entry.path());
  for (const fs::path& path : old) fs::remove(path);
}

std::vector<fs::path> names_in(const fs::path& folder) {
  std::vector<fs::path> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

void move_over(const fs::path& from, const fs::path& to) {
  if (!fs::is_directory(from) || !fs::is_directory(to)) return fs::rename(from, to);
  remove_numbered_frames(to);
  for (const fs::path& name : names_in(from)) move_over(from / name, to / name);
}

/// Removes what writers that were killed have left in `folder`: folders `prefix`.PID-0.tmp without a lock.
void remove_abandoned(const fs::path& folder, const std::string& prefix) {
  static const std::regex ending(R"(\.\d+-0\.tmp)");
  std::error_code ignored;
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(prefix) && std::regex_match(name.substr(prefix.size()), ending) &&
        fs::is_directory(entry.symlink_status()))
      left.push_back(entry.path());
  }
  for (const fs::path& path : left) {
    const int lock = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock < 0) continue;
    if (::flock(lock, LOCK_EX | LOCK_NB) == 0) fs::remove_all(path, ignored);
    ::close(lock);
  }
}

/// Makes the folder and locks it. Another process may have taken it for abandoned in between: once more then.
int made_and_locked(const std::string& path) {
  for (;;) {
    fs::create_directories(path);
    const int lock = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock < 0 && errno == ENOENT) continue;
    if (lock < 0) throw std::system_error(errno, std::generic_category(), path);
    while (::flock(lock, LOCK_EX) != 0 && errno == EINTR) {
    }  // no locks here: nothing is taken for abandoned
    struct stat ours = {}, there = {};
    if (::fstat(lock, &ours) == 0 && ::stat(path.c_str(), &there) == 0 && ours.st_ino == there.st_ino)
      return lock;
    ::close(lock);
  }
}

}  // namespace

StagedFolder::StagedFolder(const std::string& path) {
  fs::path place = fs::weakly_canonical(fs::absolute(path));
  if (!place.has_filename()) place = place.parent_path();  // "lift/"
  const std::string name = '.' + std::to_string(::getpid()) + "-0.tmp";
  final_ = place.string();
  if (fs::exists(place)) run_.emplace(final_);
  staged_ = run_ ? (place / name).string() : final_ + name;
  for (fs::path parent = place.parent_path(); !fs::exists(parent); parent = parent.parent_path())
    made_ = parent.string();
  remove_abandoned(place.parent_path(), place.filename().string());
  remove_abandoned(place, "");
  try {
    lock_ = made_and_locked(staged_);
  } catch (...) {
    remove();
    throw;
  }
}

StagedFolder::~StagedFolder() { remove(); }

void StagedFolder::remove() {
  std::error_code ignored;
  fs::remove_all(staged_, ignored);
  // Folders on the way that are still empty: nothing was published.
  for (fs::path parent = fs::path(final_).parent_path();
       !made_.empty() && fs::remove(parent, ignored) && parent != made_;)
    parent = parent.parent_path();
  if (lock_ >= 0) ::close(lock_);
}

void StagedFolder::publish(const std::string& last) {
  const fs::path from = staged_, to = final_;
  if (!run_) {
    if (fs::exists(to))
      throw InputError(final_ + ": another run has written to it meanwhile; name another folder");
    return fs::rename(from, to);
  }
  fs::remove(to / last);
  for (const fs::path& name : names_in(from))
    if (name != last) move_over(from / name, to / name);
  fs::rename(from / last, to / last);
}

}  // namespace flash::data
