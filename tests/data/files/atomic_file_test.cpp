#include "data/files/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

TEST(ReadFile, GivesEveryByte) {
  const TemporaryFolder folder;
  const std::string bytes("a\0\n\r\xff", 5);
  EXPECT_EQ(read_file(folder.write("a", bytes)), bytes);
  EXPECT_EQ(read_file(folder.write("empty", "")), "");
}

TEST(ReadFile, WhatMayNeverEndIsNoInput) {
  const TemporaryFolder folder;
  EXPECT_EQ(input_error_of([] { read_file("/dev/zero"); }),
            "/dev/zero: is a device, a pipe or a socket, expected a file");
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(input_error_of([&] { read_file(pipe); }),
            pipe + ": is a device, a pipe or a socket, expected a file");
  EXPECT_EQ(input_error_of([&] { read_file(folder / "."); }),
            (folder / ".") + ": is a folder, expected a file");
  EXPECT_EQ(input_error_of([&] { read_file(folder / "none"); }),
            (folder / "none") + ": cannot be read: No such file or directory");
  const std::string large = folder.write("large", "");
  std::filesystem::resize_file(large, 1'000'000'001);  // takes no room on the disk
  EXPECT_EQ(input_error_of([&] { read_file(large); }),
            large + ": found 1,000,000,001 bytes, expected at most 1,000,000,000");
}

TEST(WriteTogether, WritesAllOrNone) {
  const TemporaryFolder folder;
  const std::string first = folder.write("first", "old"), second = folder / "new/second";
  write_together({{first, "1"}, {"", "of no file"}, {second, "2"}});
  EXPECT_EQ(read_file(first), "1");
  EXPECT_EQ(read_file(second), "2");
  EXPECT_THROW(write_together({{first, "3"}, {folder / "new/third", "3"}, {"/proc/none", "3"}}),
               std::system_error);
  EXPECT_EQ(read_file(first), "1");
  std::vector<std::string> left;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "."))
    if (entry.is_regular_file()) left.push_back(entry.path().filename().string());
  std::sort(left.begin(), left.end());
  EXPECT_EQ(left, (std::vector<std::string>{"first", "second"}));
}

// A program that was killed leaves them; one that still writes has written within the day.
TEST(RemoveLeftovers, TakesTemporaryFilesOfAnyFolderBelowAndNothingElse) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "notes.1-2.tmp/own");
  folder.write("results.csv.12-3.tmp", "");
  folder.write("notes.1-2.tmp/own/mine", "");
  folder.write("notes.1-2.tmp/own/frame.12-4.tmp", "");
  std::filesystem::create_symlink(folder / "notes.1-2.tmp/own/mine", folder / "link.1-2.tmp");
  remove_leftovers(folder / ".");
  EXPECT_FALSE(std::filesystem::exists(folder / "results.csv.12-3.tmp"));
  EXPECT_FALSE(std::filesystem::exists(folder / "notes.1-2.tmp/own/frame.12-4.tmp"));
  EXPECT_TRUE(std::filesystem::exists(folder / "notes.1-2.tmp/own/mine"));
  EXPECT_TRUE(std::filesystem::exists(folder / "link.1-2.tmp"));
}

TEST(RemoveLeftovers, SparesFoldersThatOthersWriteTo) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "own/motions");
  std::filesystem::create_directories(folder / "motions");
  for (const char* name : {"a.csv.12-3.tmp", "motions/b.12-3.tmp", "own/motions/c.12-3.tmp"})
    folder.write(name, "");
  remove_leftovers(folder / ".", {"motions"});
  EXPECT_FALSE(std::filesystem::exists(folder / "a.csv.12-3.tmp"));
  EXPECT_TRUE(std::filesystem::exists(folder / "motions/b.12-3.tmp"));
  EXPECT_FALSE(std::filesystem::exists(folder / "own/motions/c.12-3.tmp"));
}

TEST(RemoveOldLeftovers, TakesTemporaryFilesOfADayAgoAndNothingElse) {
  namespace fs = std::filesystem;
  const TemporaryFolder folder;
  const auto write = [&](const std::string& name, std::chrono::hours ago) {
    fs::last_write_time(folder.write(name, "1"), fs::file_time_type::clock::now() - ago);
  };
  const std::chrono::hours old(25), recent(23);
  write("a.rollout.12-0.tmp", old);
  write("b.rollout.12-3.tmp", recent);
  for (const char* other :
       {"a.rollout", "a.json.12-0.tmp", "a.rollout.tmp", "a.rollout.12-0.tmp2", "deeper/a.rollout.12-0.tmp"})
    write(other, old);
  const std::string made = folder / "c.rollout.12-0.tmp";  // a folder by somebody else
  fs::create_directory(made);
  fs::last_write_time(made, fs::file_time_type::clock::now() - old);
  remove_old_leftovers(folder / ".", ".rollout");
  EXPECT_TRUE(fs::exists(made));
  EXPECT_FALSE(fs::exists(folder / "a.rollout.12-0.tmp"));
  for (const char* kept : {"b.rollout.12-3.tmp", "a.rollout", "a.json.12-0.tmp", "a.rollout.tmp",
                           "a.rollout.12-0.tmp2", "deeper/a.rollout.12-0.tmp"})
    EXPECT_TRUE(fs::exists(folder / kept)) << kept;
}

TEST(WriteAtomically, ReplacesNoPipeAndNoDevice) {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(write_atomically(pipe, "1"), InputError);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

}  // namespace
}  // namespace flash::data
