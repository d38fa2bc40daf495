#include "data/files/folder_lock.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <optional>

#include "data/files/error.h"
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

TEST(RunFolder, IsHeldByOneRunAtATime) {
  const TemporaryFolder folder;
  const std::string out = folder / "some/out";
  {
    const RunFolder first(out);
    try {
      const RunFolder second(out);
      FAIL() << "two runs hold one folder";
    } catch (const InputError& e) {
      EXPECT_EQ(e.what(), out + ": another run is writing to it; wait for it, or name another folder");
    }
    EXPECT_TRUE(std::filesystem::exists(out));  // the refused run takes nothing away
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "some"));  // nothing was written
  {
    const RunFolder again(out);
    std::ofstream(out + "/log.csv") << "step\n";
  }
  EXPECT_TRUE(std::filesystem::exists(out + "/log.csv"));
}

TEST(RunFolder, IsRefusedWhereASearchHoldsTheFolder) {
  const TemporaryFolder folder;
  const std::string out = folder / "run";
  const std::string said = out + ": another run is writing to it; wait for it, or name another folder";
  std::filesystem::create_directories(out);
  std::ofstream(out + "/.lock") << "";
  EXPECT_NO_THROW(expect_not_held(out));
  const int lock = ::open((out + "/.lock").c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_EQ(::flock(lock, LOCK_EX | LOCK_NB), 0);
  EXPECT_EQ(input_error_of([&] { const RunFolder run(out); }), said);
  EXPECT_EQ(input_error_of([&] { expect_not_held(out); }), said);
  ::close(lock);
  {
    const RunFolder run(out);
    EXPECT_EQ(input_error_of([&] { expect_not_held(out); }), said);
    EXPECT_FALSE(is_free(out));
    const int search = ::open((out + "/.lock").c_str(), O_RDWR | O_CLOEXEC);
    EXPECT_NE(::flock(search, LOCK_EX | LOCK_NB), 0);  // a search that begins is refused too
    ::close(search);
  }
  EXPECT_NO_THROW(expect_not_held(out));
  EXPECT_NO_THROW(expect_not_held(folder / "none"));
}

}  // namespace
}  // namespace flash::data
