#include "data/writable.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

TEST(Writable, PlacesThatMayBeMadeAndNothingIsLeft) {
  const TemporaryFolder folder;
  const std::string file = folder.write("here/file.json", "{}");
  for (const char* place : {"new", "a/b/c", "a/b/", "here", "."}) check_folder_writable(folder / place);
  for (const char* place : {"new.json", "a/b/new.json", "here/file.json"})
    check_file_writable(folder / place);
  std::size_t entries = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "."))
    entries += entry.exists();
  EXPECT_EQ(entries, 2u);
}

TEST(Writable, OthersAreRefusedWithTheReason) {
  const TemporaryFolder folder;
  const std::string file = folder.write("file", "mine");
  std::filesystem::create_symlink("loop", folder / "loop");
  const auto expect = [](const std::string& path, const auto& check, const std::string& reason) {
    EXPECT_EQ(input_error_of([&] { check(path); }), path + ": cannot be written: " + reason);
  };
  expect(file, check_folder_writable, "Not a directory");
  for (const auto& check : {check_folder_writable, check_file_writable}) {
    expect(file + "/below/it", check, "Not a directory");
    expect((folder / "loop") + "/out", check, "Too many levels of symbolic links");
    expect(folder / std::string(300, 'x'), check, "File name too long");
  }
  expect(folder / ".", check_file_writable, "it is a folder, expected a file");
  expect("/", check_file_writable, "it is a folder, expected a file");
  expect("/dev/null", check_file_writable, "it is a device, a pipe or a socket");
  EXPECT_NE(input_error_of([] { check_folder_writable("/proc/out"); }), "");  // even for root
}

}  // namespace
}  // namespace flash::data
