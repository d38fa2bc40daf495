#pragma once
#include <string>

namespace flash::sysid {

/// A folder of its own, which nobody else can read; removed with all that is in it. Throws std::system_error
/// where there is no place for it.
class ScratchFolder {
 public:
  ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder();

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace flash::sysid
