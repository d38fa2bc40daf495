#include "data/folder_lock.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <optional>

#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

/// Whether another could hold the folder now.
bool is_free(const std::string& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool taken = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
  ::close(descriptor);
  return taken;
}

TEST(FolderLock, HoldsTheFolderOfItsFileUntilItEnds) {
  const TemporaryFolder folder;
  std::optional<FolderLock> lock(std::in_place, folder / "new/answer.json");
  EXPECT_FALSE(is_free(folder / "new"));
  EXPECT_TRUE(is_free(folder / ""));
  lock.reset();
  EXPECT_TRUE(is_free(folder / "new"));
  const FolderLock nothing("");
}

}  // namespace
}  // namespace flash::data
