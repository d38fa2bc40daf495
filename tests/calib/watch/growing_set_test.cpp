#include "calib/watch/growing_set.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "calib/watch/recordings_in.h"
#include "data/files/error.h"
#include "tests/calib/rendered_set.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;

/// Three small pictures with poses, in a folder of their own.
class GrowingSetTest : public testing::Test {
 protected:
  GrowingSetTest() {
    fs::remove_all(root_);
    write_rendered_set({.views = 3, .width = 160, .height = 120}, folder_);
    std::ifstream file(folder_ + "/poses.tum");
    std::stringstream text;
    text << file.rdbuf();
    poses_ = text.str();
  }
  ~GrowingSetTest() override { fs::remove_all(root_); }

  void write_poses(const std::string& text) const { std::ofstream(folder_ + "/poses.tum") << text; }
  void read(double settled = 1e6) { read_growing(folder_, {}, settled, set_); }
  bool waits_for(const std::string& word) const {
    for (const std::string& sentence : set_.waiting)
      if (sentence.find(word) != std::string::npos) return true;
    return false;
  }

  const std::string root_ =
      testing::TempDir() + "growing_set_" + testing::UnitTest::GetInstance()->current_test_info()->name();
  const std::string folder_ = root_ + "/wrist";
  std::string poses_;
  GrowingSet set_;
};

TEST_F(GrowingSetTest, AWholeSetWaitsForNothing) {
  read();
  EXPECT_EQ(set_.pictures.frames.size(), 3U);
  EXPECT_EQ(set_.posed.frames.size(), 3U);
  EXPECT_TRUE(set_.waiting.empty());
}

TEST_F(GrowingSetTest, ARowWithoutItsEndIsReadOnceItIsSettled) {
  read();
  write_poses(poses_.substr(0, poses_.size() - 5));  // the last number is cut off
  read();
  EXPECT_TRUE(set_.unfinished);
  EXPECT_TRUE(waits_for("still being written"));
  EXPECT_EQ(set_.posed.frames.size(), 3U);  // of the last reading
  read(0);
  EXPECT_FALSE(set_.unfinished);
}

TEST_F(GrowingSetTest, ABrokenRowIsToldAndThePosesBeforeItStay) {
  read();
  write_poses(poses_ + "3 what is this\n");
  read();
  EXPECT_TRUE(waits_for("poses.tum"));
  EXPECT_FALSE(waits_for(folder_)) << "the reader knows the folder";
  EXPECT_EQ(set_.posed.frames.size(), 3U);
  write_poses(poses_);
  read();
  EXPECT_TRUE(set_.waiting.empty());
}

TEST_F(GrowingSetTest, APictureWithoutItsRowAndOneThatIsGoneAreNoErrors) {
  const std::size_t last_row = poses_.rfind('\n', poses_.size() - 2) + 1;
  write_poses(poses_.substr(0, last_row));
  read();
  EXPECT_EQ(set_.pictures.frames.size(), 3U);
  EXPECT_EQ(set_.posed.frames.size(), 2U);
  fs::remove(folder_ + "/images/000.png");
  write_poses(poses_);
  read();
  EXPECT_EQ(set_.pictures.frames.size(), 2U);
  EXPECT_EQ(set_.posed.frames.size(), 2U);
}

TEST_F(GrowingSetTest, AnEmptyFolderWaitsAndNoFolderIsRefused) {
  fs::create_directories(root_ + "/empty");
  read_growing(root_ + "/empty", {}, 1, set_);
  EXPECT_TRUE(waits_for("no pictures"));
  EXPECT_THROW(read_growing(root_ + "/nowhere", {}, 1, set_), data::InputError);
}

TEST_F(GrowingSetTest, ChangesOfFilesAreSeen) {
  const auto before = files_of(folder_, {});
  EXPECT_EQ(files_of(folder_, {}), before);
  std::ofstream(folder_ + "/images/000.png", std::ios::app) << 'x';
  EXPECT_NE(files_of(folder_, {}), before);
}

TEST_F(GrowingSetTest, TwoRecordingsInAFolderAreNamed) {
  EXPECT_TRUE(recordings_in(folder_).empty());
  EXPECT_TRUE(recordings_in(root_).empty());
  fs::copy(folder_, root_ + "/beside", fs::copy_options::recursive);
  EXPECT_EQ(recordings_in(root_), (std::vector<std::string>{"beside", "wrist"}));
}

}  // namespace
}  // namespace flash::calib
