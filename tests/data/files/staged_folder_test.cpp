#include "data/files/staged_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <string>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

namespace fs = std::filesystem;

std::size_t files_below(const std::string& folder) {
  std::size_t count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) count += !entry.path().empty();
  return count;
}

TEST(StagedFolder, IsWholeOrNotThere) {
  const TemporaryFolder folder;
  for (const char* place : {"out", "a/b/out/"}) {
    {
      const StagedFolder staged(folder / place);
      write_atomically(staged.path() + "/frames/000000.ply", "1");
      EXPECT_FALSE(fs::exists(folder / place));
    }
    EXPECT_EQ(files_below(folder / "."), 0u);
    StagedFolder staged(folder / place);
    write_atomically(staged.path() + "/frames/000000.ply", "1");
    write_atomically(staged.path() + "/last.json", "2");
    staged.publish("last.json");
    EXPECT_EQ(read_file((fs::path(folder / place) / "frames/000000.ply").string()), "1");
    fs::remove_all(folder / (place[0] == 'o' ? "out" : "a"));
  }
}

TEST(StagedFolder, WhatStandsThereStaysButOlderFrames) {
  const TemporaryFolder folder;
  for (const char* name : {"out/frames/000000.ply", "out/frames/000007.ply", "out/frames/mine.ply",
                           "out/last.json", "out/notes.txt", "out/000009.ply"})
    folder.write(name, "old");
  {
    const StagedFolder staged(folder / "out");
    write_atomically(staged.path() + "/frames/000000.ply", "new");
  }
  EXPECT_EQ(files_below(folder / "out"), 7u);
  StagedFolder staged(folder / "out");
  write_atomically(staged.path() + "/frames/000000.ply", "new");
  write_atomically(staged.path() + "/last.json", "new");
  staged.publish("last.json");
  EXPECT_EQ(read_file(folder / "out/frames/000000.ply"), "new");
  EXPECT_EQ(read_file(folder / "out/last.json"), "new");
  EXPECT_FALSE(fs::exists(folder / "out/frames/000007.ply"));
  for (const char* name : {"out/frames/mine.ply", "out/notes.txt", "out/000009.ply"})
    EXPECT_EQ(read_file(folder / name), "old");
}

TEST(StagedFolder, WhatKilledWritersLeftGoesAndWhatIsHeldStays) {
  const TemporaryFolder folder;
  for (const char* name :
       {"out.77-0.tmp/frames/000000.ply", "out.78-0.tmp/000000.ply", "out/.77-0.tmp/frames/000000.ply",
        "out/.78-0.tmp/000000.ply", "output.77-0.tmp/mine", "out.77-0.tmpx/mine", "out.x-0.tmp/mine",
        "out/sub.77-0.tmp/mine", "out/mine"})
    folder.write(name, "1");
  const int beside = ::open((folder / "out.78-0.tmp").c_str(), O_RDONLY),
            within = ::open((folder / "out/.78-0.tmp").c_str(), O_RDONLY);
  for (const int writer : {beside, within}) ASSERT_EQ(::flock(writer, LOCK_EX), 0);
  { const StagedFolder staged(folder / "out"); }
  for (const char* gone : {"out.77-0.tmp", "out/.77-0.tmp"}) EXPECT_FALSE(fs::exists(folder / gone)) << gone;
  for (const char* kept : {"out.78-0.tmp/000000.ply", "out/.78-0.tmp/000000.ply", "output.77-0.tmp/mine",
                           "out.77-0.tmpx/mine", "out.x-0.tmp/mine", "out/sub.77-0.tmp/mine", "out/mine"})
    EXPECT_TRUE(fs::exists(folder / kept)) << kept;
  ::close(beside);
  ::close(within);
  {
    const StagedFolder staged(folder / "out");
    EXPECT_FALSE(fs::exists(folder / "out.78-0.tmp") || fs::exists(folder / "out/.78-0.tmp"));
    // Its own is held: another writer leaves it alone.
    const int other = ::open(staged.path().c_str(), O_RDONLY);
    EXPECT_NE(::flock(other, LOCK_EX | LOCK_NB), 0);
    ::close(other);
  }
}

TEST(StagedFolder, OneRunWritesToAFolderAtATime) {
  const TemporaryFolder folder;
  folder.write("out/last.json", "old");
  StagedFolder first(folder / "out");
  EXPECT_THROW(StagedFolder(folder / "out"), InputError);
  write_atomically(first.path() + "/last.json", "first");
  first.publish("last.json");
  EXPECT_EQ(read_file(folder / "out/last.json"), "first");

  StagedFolder late(folder / "new");  // which another run makes meanwhile
  write_atomically(late.path() + "/last.json", "late");
  folder.write("new/last.json", "new");
  EXPECT_THROW(late.publish("last.json"), InputError);
  EXPECT_EQ(read_file(folder / "new/last.json"), "new");
}

}  // namespace
}  // namespace flash::data
