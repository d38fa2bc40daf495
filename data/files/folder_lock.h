#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace flash::data {

/// While it lives, no other run holds the folder of `file`: several files that belong together are written
/// one after the other, and no run's stand beside another's. Makes the folder. File systems without locks
/// have none; then nothing is held. Empty: nothing is held.
class FolderLock {
 public:
  explicit FolderLock(const std::string& file);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};

/// The file in a folder that a search locks while it writes there.
constexpr const char* search_lock = ".lock";

/// Throws InputError, as RunFolder does, where another run holds `folder`, be it by a RunFolder or as a
/// search. Nothing is held afterwards: for what is refused before the work begins.
void expect_not_held(const std::string& folder);

/// While it lives, no other run writes into `folder`: for runs that fill a folder of their own. Makes the
/// folder; at its end, those it made go again where they are empty. Throws InputError, "out: another run is
/// writing to it; ...", where one holds it already, a search too. File systems without locks have none; then
/// nothing is held.
class RunFolder {
 public:
  explicit RunFolder(const std::string& folder);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

 private:
  int descriptor_ = -1, search_ = -1;
  std::vector<std::filesystem::path> made_;  ///< the innermost first
};

}  // namespace flash::data
