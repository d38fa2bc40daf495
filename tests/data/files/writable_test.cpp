#include "data/files/writable.h"

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
  std::filesystem::create_symlink("gone", folder / "link");
  const auto expect = [](const std::string& path, const auto& check, const std::string& reason) {
    EXPECT_EQ(input_error_of([&] { check(path); }), path + ": cannot be written: " + reason);
  };
  expect(file, check_folder_writable, "Not a directory");
  for (const auto& check : {check_folder_writable, check_file_writable}) {
    expect(file + "/below/it", check, "Not a directory");
    expect((folder / "loop") + "/out", check, "Too many levels of symbolic links");
    expect(folder / std::string(300, 'x'), check, "File name too long");
    expect(folder / "link", check, (folder / "link") + " is a link to a place that is not there");
  }
  expect(folder / ".", check_file_writable, "it is a folder, expected a file");
  expect("/", check_file_writable, "it is a folder, expected a file");
  expect("/dev/null", check_file_writable, "it is a device, a pipe or a socket");
  EXPECT_NE(input_error_of([] { check_folder_writable("/proc/out"); }), "");  // even for root
}

TEST(Writable, FreeIsAnEmptyFolderOrNoneAndNoFile) {
  const TemporaryFolder folder;
  const std::string file = folder.write("full/file.json", "mine");
  std::filesystem::create_directories(folder / "empty");
  const std::string said = ": exists already; choose another name, or --force to overwrite";
  for (const char* place : {"new", "empty"}) EXPECT_NO_THROW(check_folder_free(folder / place, false));
  EXPECT_EQ(input_error_of([&] { check_folder_free(folder / "full", false); }), (folder / "full") + said);
  EXPECT_NO_THROW(check_folder_free(folder / "full", true));
  for (const bool overwrite : {false, true})
    EXPECT_EQ(input_error_of([&] { check_folder_free(file, overwrite); }),
              file + ": exists already, and is no folder; choose another name");
  EXPECT_NO_THROW(check_file_free(folder / "full/new", false));
  EXPECT_EQ(input_error_of([&] { check_file_free(file, false); }), file + said);
  EXPECT_NO_THROW(check_file_free(file, true));
}

TEST(Writable, NamesAreFreeBesideOtherFiles) {
  const TemporaryFolder folder;
  const std::string file = folder.write("full/file.json", "mine"), full = folder / "full";
  EXPECT_NO_THROW(check_names_free(full, {"a", "b"}, false));
  EXPECT_NO_THROW(check_names_free(folder / "new", {"file.json"}, false));
  EXPECT_EQ(input_error_of([&] {
              check_names_free(full, {"a", "file.json"}, false);
            }),
            file + ": exists already; choose another name, or --force to overwrite");
  EXPECT_NO_THROW(check_names_free(full, {"file.json"}, true));
}

}  // namespace
}  // namespace flash::data
