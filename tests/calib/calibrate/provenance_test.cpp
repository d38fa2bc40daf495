#include <gtest/gtest.h>

#include <filesystem>

#include "calib/calibrate/extrinsics.h"
#include "data/files/atomic_file.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;

/// The current folder, put back afterwards.
class CurrentFolder {
 public:
  explicit CurrentFolder(const std::string& path) : before_(fs::current_path()) { fs::current_path(path); }
  ~CurrentFolder() { fs::current_path(before_); }
  CurrentFolder(const CurrentFolder&) = delete;
  CurrentFolder& operator=(const CurrentFolder&) = delete;

 private:
  fs::path before_;
};

TEST(Provenance, PathsHoldFromTheFolderOfTheFileAndWhenBothAreMoved) {
  const data::TemporaryFolder folder;
  folder.write("cell/recording/poses.tum", "");
  folder.write("cell/results/camera.json", "");
  folder.write("elsewhere/nothing", "");
  ExtrinsicsInputs inputs{"recording", "chessboard:9x6:0.025", "recording/poses.tum", "", "ours"};
  {
    const CurrentFolder here(folder / "cell");
    inputs = relative_to(inputs, "results/camera.json");
  }
  EXPECT_EQ(inputs.dataset, "../recording");
  EXPECT_EQ(inputs.poses, "../recording/poses.tum");
  EXPECT_EQ(inputs.target, "chessboard:9x6:0.025");
  EXPECT_EQ(inputs.camera, "");
  const CurrentFolder there(folder / "elsewhere");
  EXPECT_TRUE(fs::equivalent(resolved(inputs.dataset, "../cell/results/camera.json"), "../cell/recording"));
  fs::rename(folder / "cell", folder / "moved");
  EXPECT_TRUE(fs::equivalent(resolved(inputs.poses, folder / "moved/results/camera.json"),
                             folder / "moved/recording/poses.tum"));
  fs::rename(folder / "moved/recording", folder / "moved/gone");
  const std::string message =
      data::input_error_of([&] { resolved(inputs.dataset, folder / "moved/results/camera.json"); });
  EXPECT_NE(message.find("camera.json: provenance: found ../recording, which is neither"), std::string::npos)
      << message;
}

TEST(Provenance, FilesOfOldAreReadFromTheCurrentFolder) {
  const data::TemporaryFolder folder;
  folder.write("recording/poses.tum", "");
  folder.write("results/camera.json", "");
  const CurrentFolder here(folder / "");
  EXPECT_EQ(resolved("recording", "results/camera.json"), "recording");
}

}  // namespace
}  // namespace flash::calib
