#include "data/recording/recording_digest.h"

#include <gtest/gtest.h>

#include "data/files/sha256.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

class RecordingDigest : public ::testing::Test {
 protected:
  RecordingDigest() {
    recording.source = folder.write("recording.json", "{}");
    recording.trajectory_paths["gripper"] = folder.write("tcp.tum", "0 0 0 0 0 0 0 1\n");
    recording.mesh_spec = "sheet:0.2x0.2:0.02";  // no file
    recording.keyframes.resize(2);
    recording.keyframes[0].cloud = folder.write("0.ply", "one");
    recording.keyframes[1].cloud = folder.write("1.ply", "two");
  }
  const TemporaryFolder folder;
  Recording recording;
};

TEST_F(RecordingDigest, IsThatOfTheDigestsOfTheFilesInTheirOrder) {
  EXPECT_EQ(recording_sha256(recording),
            sha256(sha256("{}") + sha256("0 0 0 0 0 0 0 1\n") + sha256("one") + sha256("two")));
}

TEST_F(RecordingDigest, WhatWasObservedStaysTheSameWhereOnlyItsDescriptionChanges) {
  const std::string whole = recording_sha256(recording), observed = observed_sha256(recording);
  folder.write("recording.json", R"({"name": "another"})");
  folder.write("tcp.tum", "0.0 0 0 0 0 0 0 1\n");
  EXPECT_NE(recording_sha256(recording), whole);
  EXPECT_EQ(observed_sha256(recording), observed);
  folder.write("1.ply", "other");
  EXPECT_NE(observed_sha256(recording), observed);
  folder.write("1.ply", "two");
  recording.keyframes[0].force = Eigen::Vector3d(0, 0, 1);
  EXPECT_NE(observed_sha256(recording), observed);
}

}  // namespace
}  // namespace flash::data
