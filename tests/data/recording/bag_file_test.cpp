#include "data/recording/bag_file.h"

#include <gtest/gtest.h>

#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

TEST(BagFile, FilesAndFoldersOfRecordingsNameTheCommand) {
  const TemporaryFolder folder;
  for (const char* name : {"cell.bag", "cell.db3", "Cell.MCAP"}) {
    folder.write(name, "");
    EXPECT_EQ(input_error_of([&] { expect_no_bag(folder / name, "handeye"); }),
              folder / name +
                  ": is a recording of ROS or of a camera, expected a folder; python -m flash_sim.bag " +
                  (folder / name) + " --for handeye -o FOLDER makes one of it");
  }
  std::filesystem::create_directory(folder / "rosbag2");
  folder.write("rosbag2/metadata.yaml", "rosbag2_bagfile_information:\n  version: 9\n");
  EXPECT_NE(input_error_of([&] { expect_no_bag(folder / "rosbag2", "segment"); }).find("--for segment -o"),
            std::string::npos);
}

TEST(BagFile, OtherFilesAndFoldersPass) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "wrist");
  folder.write("wrist/metadata.yaml", "camera: D435\n");
  folder.write("wrist/cell.bag", "");
  folder.write("poses.npz", "");
  for (const char* name : {"wrist", "poses.npz", "none.bag"})
    EXPECT_NO_THROW(expect_no_bag(folder / name, "handeye")) << name;
}

}  // namespace
}  // namespace flash::data
