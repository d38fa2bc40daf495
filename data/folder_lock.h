#pragma once
#include <string>

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

}  // namespace flash::data
