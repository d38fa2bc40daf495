#pragma once
#include <optional>
#include <string>

#include "data/files/folder_lock.h"

namespace flash::data {

/// A folder that readers see whole or not at all. Its files are written to another one, `PATH.PID-0.tmp` or,
/// where PATH stands already, `PATH/.PID-0.tmp`, and publish() puts them in their place. What is not
/// published leaves nothing behind, but after a kill the other folder: the next one of the same PATH removes
/// it. Its writer holds a lock on it, by which those that still write are told from those that were killed.
/// One run writes to a PATH at a time: two would leave files of both.
class StagedFolder {
 public:
  /// Makes the other folder. Throws InputError where another run writes to PATH, and std::system_error.
  explicit StagedFolder(const std::string& path);
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  /// Where to write.
  const std::string& path() const { return staged_; }

  /// Files that stand in the place already stay, but for those of the same names and for the numbered frames
  /// of an earlier run (000.ply, 000012.png) in folders that get new ones. `last`, a file without which the
  /// folder is not complete, is taken away first and comes last. Throws InputError where PATH was made by
  /// another run meanwhile, and std::filesystem::filesystem_error.
  void publish(const std::string& last);

 private:
  void remove();

  std::string final_, staged_;
  std::optional<RunFolder> run_;  // PATH, where it stood already
  std::string made_;              // the outermost folder on the way that has to be made, or empty
  int lock_ = -1;
};

}  // namespace flash::data
