#include "data/files/staged_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
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

std::string generation(int number) { return std::to_string(number); }

void write_generation(StagedFolder& staged, int number) {
  for (int k = 0; k < 20; ++k)
    write_atomically(staged.path() + "/frames/" + std::to_string(1000 + k) + ".csv", generation(number),
                     Sync::later);
  write_atomically(staged.path() + "/table.csv", generation(number), Sync::later);
  write_atomically(staged.path() + "/last.json", generation(number), Sync::later);
}

/// Whether the folder is complete; if so, all of it is of one generation.
bool is_whole(const std::string& folder) {
  if (!fs::exists(folder + "/last.json")) return false;
  const std::string last = read_file(folder + "/last.json");
  int files = 0;
  for (const char* place : {"", "/frames"})
    for (const auto& entry : fs::directory_iterator(folder + place))
      if (entry.is_regular_file()) {
        EXPECT_EQ(read_file(entry.path().string()), last) << entry.path();
        ++files;
      }
  EXPECT_EQ(files, 22);
  return true;
}

// Kills at any time, most of them while files take their places: what is complete is of one run, and the next
// run is whole and leaves nothing of the killed ones.
TEST(StagedFolder, AKillLeavesOneRunsFilesOrNoneThatAreComplete) {
  const TemporaryFolder folder;
  const std::string out = folder / "out";
  int whole = 0, incomplete = 0;
  for (int trial = 1; trial <= 60; ++trial) {
    int ready[2];
    ASSERT_EQ(::pipe(ready), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      StagedFolder staged(out);
      write_generation(staged, trial);
      if (::write(ready[1], "r", 1) != 1) ::_exit(1);
      staged.publish("last.json");
      ::pause();
    }
    char begun = 0;
    ASSERT_EQ(::read(ready[0], &begun, 1), 1);
    ::usleep(static_cast<useconds_t>(25 * (trial % 30)));  // 22 renames take some hundred microseconds
    ::kill(child, SIGKILL);
    ASSERT_EQ(::waitpid(child, nullptr, 0), child);
    for (const int end : ready) ::close(end);
    if (fs::exists(out)) ++(is_whole(out) ? whole : incomplete);
    if (trial % 5 != 0) continue;
    {
      StagedFolder staged(out);
      write_generation(staged, -trial);
      staged.publish("last.json");
    }
    EXPECT_TRUE(is_whole(out));
    EXPECT_EQ(read_file(out + "/last.json"), generation(-trial));
    EXPECT_EQ(files_below(folder / "."), 24u);  // out, frames and the files: nothing else
  }
  EXPECT_GT(whole + incomplete, 0);
}

}  // namespace
}  // namespace flash::data
