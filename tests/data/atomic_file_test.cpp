#include "data/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

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

TEST(WriteAtomically, ReplacesNoPipeAndNoDevice) {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(write_atomically(pipe, "1"), InputError);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

}  // namespace
}  // namespace flash::data
