#include "data/staged_folder.h"

#include <gtest/gtest.h>

#include "data/atomic_file.h"
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

}  // namespace
}  // namespace flash::data
