#include "sysid/report/searched_mesh.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "data/files/atomic_file.h"
#include "data/recording/recording_digest.h"
#include "tests/data/temporary_folder.h"
#include "tests/sysid/short_lift.h"
#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

class SearchedMeshOf : public ::testing::Test {
 protected:
  SearchedMeshOf() {
    short_corner_lift(folder_, 0.1);  // of 0.2 x 0.2 m
    recording_ = data::load_recording(folder_ / "towel");
    SummaryRecording& first = summary_.recordings[0];
    first.mesh = "sheet:0.4x0.4:0.03";
    summary_.recordings.push_back(first);
    summary_.recordings[1].sha256 = std::string(64, 'b');
    summary_.recordings[1].mesh = "sheet:0.2x0.2:0.01";
    summary_.settings["cell_scale"] = "0.45";
  }
  data::TemporaryFolder folder_;
  data::Recording recording_;
  Summary summary_ = example_summary();
};

TEST_F(SearchedMeshOf, AnotherRecordingIsThatOfItsSize) {
  const SearchedMesh mesh = searched_mesh(summary_, "run", recording_);
  EXPECT_EQ(mesh.mesh, "sheet:0.2x0.2:0.01");
  EXPECT_EQ(mesh.cell_scale, 0.45);
}

TEST_F(SearchedMeshOf, ARecordingOfTheSearchIsItsOwn) {
  summary_.recordings[0].sha256 = data::recording_sha256(recording_);
  EXPECT_EQ(searched_mesh(summary_, "run", recording_).mesh, "sheet:0.4x0.4:0.03");
  summary_.recordings[0].own_mesh = true;
  EXPECT_EQ(searched_mesh(summary_, "run", recording_).mesh, "");
}

TEST_F(SearchedMeshOf, NoObjectOfItsSizeIsRefused) {
  summary_.recordings.pop_back();
  const std::string error = data::input_error_of([&] { searched_mesh(summary_, "run", recording_); });
  EXPECT_NE(error.find("found an object 0.2828 m across, that of run is 0.5657 m"), std::string::npos)
      << error;
}

TEST_F(SearchedMeshOf, AnEarlierProgramNamedThatOfTheFirst) {
  for (SummaryRecording& recording : summary_.recordings) recording.mesh.clear();
  summary_.settings.erase("cell_scale");
  summary_.settings["mesh"] = "sheet:0.2x0.2:0.02 (121 vertices)";
  EXPECT_EQ(searched_mesh(summary_, "run", recording_).mesh, "sheet:0.2x0.2:0.02");
  EXPECT_EQ(searched_mesh(summary_, "run", recording_).cell_scale, 1);
  summary_.settings.erase("mesh");
  EXPECT_NE(data::input_error_of([&] { searched_mesh(summary_, "run", recording_); }).find("missing"),
            std::string::npos);
}

TEST_F(SearchedMeshOf, ScalesThatAreNoneAreRefused) {
  for (const char* text : {"0", "-0.5", "1.5", "half", "nan", ""}) {
    summary_.settings["cell_scale"] = text;
    EXPECT_NE(data::input_error_of([&] { searched_mesh(summary_, "run", recording_); }).find("cell_scale"),
              std::string::npos)
        << text;
  }
}

TEST(SearchedMesh, AFileThatIsMissingOrHasChangedIsNamed) {
  const std::string path = (std::filesystem::path(testing::TempDir()) / "searched_mesh_test.obj").string();
  const auto write = [&](const char* last) {
    data::write_atomically(path, std::string("v 0 0 0\nv 1 0 0\nv 0 ") + last + " 0\nf 1 2 3\n");
  };
  const auto error_of = [&](const SearchedMesh& mesh) {
    return data::input_error_of([&] { expect_as_searched(mesh, "summary.json", "recordings.a.mesh"); });
  };
  write("1");
  const std::string digest = mesh_digest(path);
  EXPECT_EQ(digest.size(), 64U);
  EXPECT_EQ(mesh_digest("sheet:0.2x0.2:0.02"), "");
  expect_as_searched({.mesh = path, .digest = digest}, "summary.json", "recordings.a.mesh");
  write("2");
  EXPECT_NE(error_of({.mesh = path, .digest = digest}).find("has changed since the search"),
            std::string::npos);
  expect_as_searched({.mesh = path}, "summary.json", "recordings.a.mesh");  // of an earlier program
  std::filesystem::remove(path);
  EXPECT_NE(error_of({.mesh = path, .digest = digest}).find("summary.json: recordings.a.mesh: "),
            std::string::npos);
  EXPECT_NE(error_of({.mesh = "sheet:0.2x0.2:no"}).find("summary.json"), std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
