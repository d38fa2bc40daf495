#include "data/recording/recording.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "data/files/atomic_file.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

using nlohmann::json;

/// A 0.2 m sheet lifted at its far corner, on disk; tests change one thing and look at the message.
class RecordingFiles : public testing::Test {
 protected:
  RecordingFiles() {
    folder_.write("gripper.tum", "0 0.2 0.2 0 0 0 0 1\n1 0.2 0.2 0.1 0 0 0 1\n");
    Points cloud(3, 3);
    cloud << 0.1, 0.1, 0.05, 0.15, 0.15, 0.1, 0.2, 0.2, 0.01;
    save_point_cloud(cloud, folder_ / "frames/000.ply");
    save_point_cloud(Points(0, 3), folder_ / "frames/001.ply");
    json_ = json::parse(R"({
      "schema": "flash-recording/1", "name": "lift", "kind": "corner_lift", "gravity": [0, 0, -9.81],
      "object": {"mesh": "sheet:0.2x0.2:0.05", "asset": null, "start": {"T_base_object": [0, 0, 0, 0, 0, 0, 1]}},
      "table": {"point": [0, 0, 0], "normal": [0, 0, 2]},
      "trajectories": {"gripper": "gripper.tum"},
      "grasps": [{"gripper": "gripper", "from": 0, "to": null, "select": {"corner": [1, 1], "within": 0.05}}],
      "crop": {"min": [null, null, 0.02], "max": [null, 1.0, null]},
      "keyframes": [{"t": 0.0, "cloud": "frames/000.ply"}, {"t": 0.5, "cloud": "frames/001.ply"}],
      "nuisance": {"offset_m": [0, 0, 0], "time_s": 0.1}})");
  }

  Recording load() { return load_recording(folder_.write("recording.json", json_.dump())); }

  /// The message after the path of recording.json.
  std::string message() {
    const std::string path = folder_.write("recording.json", json_.dump());
    std::string text = input_error_of([&] {
      std::vector<std::string> notices;
      load_keyframes(load_recording(path), notices);
    });
    return text.starts_with(path) ? text.substr(path.size() + 2) : text;
  }

  TemporaryFolder folder_;
  json json_;
};

TEST_F(RecordingFiles, LoadsWhatTheFileSays) {
  const Recording recording = load();
  EXPECT_EQ(recording.name, "lift");
  EXPECT_EQ(recording.mesh.vertices.rows(), 25);
  EXPECT_EQ(recording.start, recording.mesh.vertices);
  EXPECT_TRUE(recording.asset.empty());
  EXPECT_EQ(recording.table_normal, Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(std::isinf(recording.grasps[0].to));
  EXPECT_EQ(recording.crop.min, Eigen::Vector3d(-INFINITY, -INFINITY, 0.02));
  EXPECT_EQ(recording.crop.max, Eigen::Vector3d(INFINITY, 1.0, INFINITY));
  EXPECT_EQ(select_vertices(recording, recording.grasps[0]), (std::vector<int>{18, 19, 23, 24}));
  EXPECT_DOUBLE_EQ(recording.nuisance.time, 0.1);
  EXPECT_TRUE(recording.notices.empty());

  std::vector<std::string> notices;
  const std::vector<Keyframe> keyframes = load_keyframes(recording, notices);
  EXPECT_EQ(keyframes[0].cloud.rows(), 2);  // the third point lies below the crop plane
  EXPECT_EQ(keyframes[1].cloud.rows(), 0);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_NE(notices[0].find("1 of 2 keyframes have no point inside the crop box (t = 0.5 s)"),
            std::string::npos);
}

// Stamps of ROS and of cameras count from 1970, or from when the machine was switched on.
TEST_F(RecordingFiles, TimesCountFromItsStartWhateverTheClock) {
  const Recording zero = load();
  for (const double epoch : {1000.0, 1.764e9, -3.5}) {
    const std::string t0 = format_number(epoch), t1 = format_number(epoch + 1);
    folder_.write("gripper.tum", t0 + " 0.2 0.2 0 0 0 0 1\n" + t1 + " 0.2 0.2 0.1 0 0 0 1\n");
    json_["grasps"][0]["from"] = epoch;
    json_["grasps"][0]["to"] = epoch + 0.7;
    json_["keyframes"][0]["t"] = epoch;
    json_["keyframes"][1]["t"] = epoch + 0.5;
    const Recording recording = load();
    EXPECT_EQ(recording.origin, epoch);
    EXPECT_EQ(recording.keyframes[1].time, 0.5);
    EXPECT_EQ(recording.grasps[0].from, 0);
    EXPECT_EQ(recording.grasps[0].to, 0.7);
    EXPECT_EQ(recording.trajectories.at("gripper").times, zero.trajectories.at("gripper").times);
    save_recording(recording, folder_ / "again.json");
    const json again = json::parse(read_file(folder_ / "again.json"));
    EXPECT_EQ(again["grasps"][0]["from"], epoch);
    EXPECT_EQ(again["keyframes"][1]["t"], epoch + 0.5);
    json_["grasps"][0].erase("from");  // with the recording
    EXPECT_EQ(load().grasps[0].from, 0);
  }
}

TEST_F(RecordingFiles, ItsNameIsOneLine) {
  json_["name"] = "two\nlines";
  EXPECT_NE(message().find("name: found"), std::string::npos);
  json_["name"] = "";
  EXPECT_NE(message().find("name: found"), std::string::npos);
  json_["name"] = "../../anything else";
  EXPECT_EQ(message(), "");
}

TEST_F(RecordingFiles, TimesOfAnotherClockAndSenselessBoundsAreNamed) {
  json_["grasps"][0]["from"] = -1e12;
  EXPECT_NE(message().find("grasps[0].from: found -1e+12 s, expected a time by the clock of the keyframes"),
            std::string::npos);
  json_["grasps"][0]["from"] = 0;
  json_["keyframes"][0]["t"] = -1.764e9;
  EXPECT_NE(message().find("keyframes: found times from -1764000000 to 0.5 s"), std::string::npos);
  json_["keyframes"][0]["t"] = 0;
  for (const auto& [field, value] : std::vector<std::pair<std::string, double>>{
           {"time_s", 1e9}, {"time_s", 1e4}, {"offset_m", 1e9}, {"yaw_rad", 1e9}, {"start_yaw_rad", 10}}) {
    const json nuisance = json_["nuisance"];
    json_["nuisance"][field] = value;
    EXPECT_NE(message().find("nuisance." + field), std::string::npos) << field;
    json_["nuisance"] = nuisance;
  }
}

TEST_F(RecordingFiles, SurvivesSaveAndLoad) {
  json_["grasps"][0]["shape"] = "pinch";
  json_["grasps"][0]["direction"] = {1, 1, 0};
  json_["keyframes"][1]["force"] = {0, 0, 1.5};
  json_["object"]["start"]["T_base_object"] = {0.01, 0, 0, 0, 0, 0.6, 0.8};
  json_["nuisance"]["offset_m"] = 1.0;
  const Recording written = load();
  save_recording(written, folder_ / "copy/recording.json");
  const Recording read = load_recording(folder_ / "copy");
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.kind, written.kind);
  EXPECT_TRUE(read.start.isApprox(written.start, 1e-14));
  EXPECT_EQ(read.crop.min, written.crop.min);
  EXPECT_EQ(read.grasps[0].shape, GraspShape::pinch);
  EXPECT_TRUE(read.grasps[0].direction.isApprox(written.grasps[0].direction));
  EXPECT_TRUE(std::isinf(read.grasps[0].to));
  ASSERT_EQ(read.keyframes.size(), 2u);
  EXPECT_TRUE(std::filesystem::equivalent(read.keyframes[0].cloud, written.keyframes[0].cloud));
  EXPECT_EQ(read.keyframes[1].force, Eigen::Vector3d(0, 0, 1.5));
  EXPECT_EQ(read.nuisance.offset, written.nuisance.offset);
}

TEST_F(RecordingFiles, StartPositionsFromAMesh) {
  TriangleMesh moved = parse_mesh_spec("sheet:0.2x0.2:0.05");
  moved.vertices.col(2).array() += 0.01;
  save_triangle_mesh(moved, folder_ / "start.ply");
  json_["object"]["start"] = "start.ply";
  EXPECT_EQ(load().start, moved.vertices);
  json_["object"]["start"] = {{"mesh", "start.ply"}};
  EXPECT_EQ(load().start, moved.vertices);
  json_["object"]["mesh"] = "sheet:0.2x0.2:0.1";
  EXPECT_EQ(message(),
            "object.start: found 25 vertices in " + folder_ / "start.ply" + ", expected 9 as in object.mesh");
}

TEST_F(RecordingFiles, GraspByPositionTakesTheVerticesAroundIt) {
  json_["grasps"][0]["select"] = {{"position", {-0.05, 0, 0}}, {"within", 0.01}};
  const Recording recording = load();
  EXPECT_EQ(select_vertices(recording, recording.grasps[0]), std::vector<int>{23});
}

TEST_F(RecordingFiles, MarkersContourAndForce) {
  folder_.write("marks.csv", "vertex,x,y,z\n3,0.1,0.2,0.3\n");
  json_["keyframes"][0] = {{"t", 0}, {"markers", "marks.csv"}, {"contour", "frames/000.ply"}};
  std::vector<std::string> notices;
  const Recording recording = load();
  const std::vector<Keyframe> keyframes = load_keyframes(recording, notices);
  EXPECT_EQ(keyframes[0].marker_places.row(0), recording.mesh.vertices.row(3));
  EXPECT_EQ(keyframes[0].markers.row(0), Eigen::RowVector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(keyframes[0].contour.rows(), 2);
  folder_.write("marks.csv", "vertex,x,y,z\n25,0.1,0.2,0.3\n");
  EXPECT_NE(message().find("line 2: found \"25,0.1,0.2,0.3\", expected vertex,x,y,z with a vertex below 25"),
            std::string::npos);
}

TEST_F(RecordingFiles, WrongFieldsAreNamed) {
  const json good = json_;
  const auto changed = [&](const char* pointer, const json& value) {
    json_ = good;
    json_[json::json_pointer(pointer)] = value;
    return message();
  };
  EXPECT_EQ(changed("/schema", "flash-recording/2"),
            "schema: found \"flash-recording/2\", expected \"flash-recording/1\"");
  EXPECT_EQ(changed("/graspz", 1), "graspz: unknown field (did you mean \"grasps\"?)");
  EXPECT_EQ(changed("/nuisance/yaw", 1), "nuisance.yaw: unknown field (did you mean \"yaw_rad\"?)");
  EXPECT_EQ(
      changed("/kind", "lift"),
      "kind: found \"lift\", expected corner_lift, hang, bar_pull, bias_pull, drag, cantilever or free");
  EXPECT_EQ(changed("/gravity", "down"), "gravity: found \"down\", expected a list of 3 numbers");
  EXPECT_EQ(changed("/object/mesh", "cloth.obj"),
            "object.mesh: file " + folder_ / "cloth.obj" + " does not exist");
  EXPECT_EQ(changed("/object/start/T_base_object", {0, 0, 0, 0, 0, 0, 2}),
            "object.start.T_base_object: found [0,0,0,0,0,0,2], expected [x, y, z, qx, qy, qz, qw] with a "
            "unit quaternion");
  EXPECT_EQ(changed("/grasps/0/gripper", "left"),
            "grasps[0].gripper: found \"left\", expected a name of trajectories: gripper");
  EXPECT_EQ(changed("/grasps/0/to", -1), "grasps[0].to: found -1, expected a time after from, or null");
  EXPECT_EQ(changed("/grasps/0/shape", "hook"),
            "grasps[0].shape: found \"hook\", expected clamp, point or pinch");
  EXPECT_EQ(changed("/grasps/0/select/corner", {2, 0}),
            "grasps[0].select.corner: found [2,0], expected [i, j], each 0 or 1");
  EXPECT_EQ(changed("/grasps/0/select/vertices", {1}),
            "grasps[0].select: expected exactly one of corner, vertices, position and box");
  EXPECT_EQ(changed("/grasps/0/select", {{"vertices", {25}}}),
            "grasps[0].select.vertices: found [25], expected indices below 25, the vertices of the mesh");
  EXPECT_EQ(changed("/crop/min/1", 2), "crop.min: found [null,2,0.02], expected below max on every axis");
  EXPECT_EQ(changed("/keyframes/1/t", 0),
            "keyframes[1].t: found 0, expected a time after 0 s, the keyframe before");
  EXPECT_EQ(changed("/keyframes/0", {{"t", 0}}),
            "keyframes[0].cloud: missing, expected cloud, depth, markers, contour or force");
  EXPECT_EQ(changed("/keyframes/0/cloud", "none.ply"),
            "keyframes[0].cloud: file " + folder_ / "none.ply" + " does not exist");
  EXPECT_EQ(changed("/keyframes/0", {{"t", 0}, {"depth", "frames/000.ply"}}),
            "keyframes[0].depth: found \"frames/000.ply\", expected a camera in the recording");
  EXPECT_EQ(changed("/keyframes", json::array()), "keyframes: found [], expected at least one keyframe");
  EXPECT_EQ(changed("/nuisance/time_s", -1), "nuisance.time_s: found -1, expected a number of 0 or above");
}

TEST_F(RecordingFiles, GravityThatLiftsTheSheetOffItsTableIsAnError) {
  const auto with = [&](const json& gravity, const json& normal) {
    json_["gravity"] = gravity;
    json_["table"]["normal"] = normal;
    return message();
  };
  EXPECT_EQ(with({0, 0, 9.81}, {0, 0, 2}),
            "gravity: found [0,0,9.81], expected one that points into the table, whose normal is 0, 0, 1, as "
            "0, 0, -9.81");
  EXPECT_NE(with({0, 0, -9.81}, {0, 0, -1}), "");
  EXPECT_NE(with({0.5, 0, 0.01}, {0, 0, 1}), "");
  // A robot that hangs from the ceiling, a slope, a wall, and none.
  for (const auto& [gravity, normal] : std::vector<std::pair<json, json>>{{{0, 0, 9.81}, {0, 0, -1}},
                                                                          {{2, 0, -9.6}, {0, 0, 1}},
                                                                          {{0, 0, -9.81}, {1, 0, 0}},
                                                                          {{0, 0, 0}, {0, 0, 1}}}) {
    EXPECT_EQ(with(gravity, normal), "");
    EXPECT_TRUE(load().doubts.empty());
  }
}

TEST_F(RecordingFiles, GravityThatIsNotTheEarthsIsDoubted) {
  const auto doubts = [&](const json& gravity) {
    json_["gravity"] = gravity;
    return load().doubts;
  };
  using Texts = std::vector<std::string>;
  EXPECT_EQ(doubts({0, 0, -1.62}),
            Texts{"gravity: found 1.62 m/s^2, expected 9.81 on the Earth: every stiffness scales with it"});
  EXPECT_EQ(doubts({0, 0, -98.1}).size(), 1U);
  EXPECT_EQ(doubts({0, 0, -9.81}), Texts());
  json_["gravity"] = {0, 0, -981};  // cm/s^2
  EXPECT_EQ(message(),
            "gravity: found [0,0,-981], expected metres a second squared, as 0, 0, -9.81; at most 100");
  json_.erase("table");
  EXPECT_EQ(doubts({0, 0, 9.81}),
            Texts{"gravity: found 0, 0, 9.81, which points up, expected 0, 0, -9.81 unless the robot's base "
                  "hangs from a ceiling"});
  EXPECT_EQ(doubts({-9.75, 0.11, -1.12}), Texts());  // a beam that is clamped at a wall
}

TEST_F(RecordingFiles, GraspOffTheMeshIsAnError) {
  json_["object"]["start"]["T_base_object"] = {0.15, 0, 0, 0, 0, 0, 1};
  EXPECT_EQ(
      message(),
      "grasps[0]: at t = 0 s the gripper is 0.1 m from the vertices it should hold, expected at "
      "most "
      "within 0.05 m plus nuisance.offset_m 0 m: check object.start, select and the frame of the trajectory");
  json_["nuisance"]["offset_m"] = {0.3, 0, 0};
  EXPECT_EQ(message(), "");
}

TEST_F(RecordingFiles, AGripperInTheMiddleOfAnEdgeIsFarFromEachOfItsVertices) {
  folder_.write("gripper.tum", "0 0.2 0.1 0 0 0 0 1\n1 0.2 0.1 0.1 0 0 0 1\n");
  json_["grasps"][0]["select"] = {{"vertices", {4, 24}}, {"within", 0.02}};
  EXPECT_EQ(message(), "");
}

TEST_F(RecordingFiles, WhatIsThereTwiceIsAnError) {
  json_["keyframes"][0]["depth"] = "frames/000.ply";
  json_["camera"] = {{"intrinsics", "lens.yaml"}, {"T_base_camera", {0, 0, 1, 1, 0, 0, 0}}};
  folder_.write("lens.yaml", "image_width: 8\nimage_height: 6\nK: [50, 0, 4, 0, 50, 3, 0, 0, 1]\n");
  EXPECT_NE(message().find("keyframes[0].depth"), std::string::npos) << message();
  json_["keyframes"][0].erase("depth");
  json_["grasps"].push_back(json_["grasps"][0]);
  EXPECT_NE(message().find("grasps[1].select"), std::string::npos) << message();
  json_["grasps"][0]["to"] = 0.2;
  json_["grasps"][1]["from"] = 0.2;
  EXPECT_EQ(message(), "");
}

TEST_F(RecordingFiles, WhatMovesNothingIsDoubted) {
  EXPECT_TRUE(load().doubts.empty());
  json_["keyframes"][1]["t"] = 50;
  std::vector<std::string> doubts = load().doubts;
  ASSERT_EQ(doubts.size(), 1u);
  EXPECT_NE(doubts[0].find("keyframes span 0 to 50 s, trajectory gripper 0 to 1 s"), std::string::npos);
  json_["keyframes"][1]["t"] = 0.5;
  json_["grasps"] = json::array();
  doubts = load().doubts;
  ASSERT_EQ(doubts.size(), 1u);
  EXPECT_EQ(doubts[0], "trajectories.gripper: no grasp names it, so that it holds nothing");
}

TEST_F(RecordingFiles, ClocksThatDoNotMeetAreAnError) {
  json_["keyframes"][0]["t"] = 100;
  json_["keyframes"][1]["t"] = 101;
  EXPECT_EQ(
      message(),
      "keyframes: keyframes span 100 to 101 s, trajectory gripper 0 to 1 s: expected clocks that overlap");
  json_["keyframes"][0]["t"] = 0.5;
  json_["keyframes"][1]["t"] = 1.5;
  ASSERT_EQ(load().doubts.size(), 1u);
  json_["keyframes"][1]["t"] = 1.15;  // a frame after the motion
  ASSERT_EQ(load().notices.size(), 1u);
}

TEST_F(RecordingFiles, MillimetresAreRecognised) {
  const Points cloud = 1000 * load_point_cloud(folder_ / "frames/000.ply");
  save_point_cloud(cloud, folder_ / "frames/mm.ply");
  json_["keyframes"][1]["cloud"] = "frames/mm.ply";
  EXPECT_TRUE(message().starts_with(folder_ / "frames/mm.ply" + ": its points lie")) << message();
  EXPECT_NE(message().find("(millimetres read as metres?)"), std::string::npos);

  json_["keyframes"][1]["cloud"] = "frames/001.ply";
  folder_.write("gripper.tum", "0 200 200 0 0 0 0 1\n");
  EXPECT_NE(message().find("gripper.tum: reaches 282.8 m from the origin"), std::string::npos) << message();

  json_["object"]["mesh"] = "sheet:278x278:10";
  EXPECT_NE(
      message().find("object.mesh: found \"sheet:278x278:10\", expected metres: the mesh is 393.2 m across"),
      std::string::npos)
      << message();
}

TEST_F(RecordingFiles, BrokenAndEmptyCloudsAreNamed) {
  json_["keyframes"][0]["cloud"] = "frames/001.ply";
  EXPECT_EQ(message(),
            "keyframes: no keyframe has a point inside the crop box, y below 1 m, z above 0.02 m, expected "
            "points in metres in the base frame");
  Points cloud = load_point_cloud(folder_ / "frames/000.ply");
  cloud(1, 2) = NAN;
  save_point_cloud(cloud, folder_ / "frames/001.ply");
  EXPECT_EQ(message(), "");
  const Recording recording = load_recording(folder_ / "recording.json");
  std::vector<std::string> notices;
  EXPECT_EQ(load_keyframes(recording, notices)[0].cloud.rows(), 1);
  EXPECT_NE(notices.back().find("2 points of 2 keyframes are not finite and were left out"),
            std::string::npos);
}

TEST_F(RecordingFiles, EmptyKeyframesAreUsualWhileTheSheetStillLies) {
  const auto notice = [&](double raised) {
    folder_.write("gripper.tum", "0 0.2 0.2 0 0 0 0 1\n0.5 0.2 0.2 " + std::to_string(raised) + " 0 0 0 1\n");
    json_["keyframes"] = json::array();
    for (int k = 0; k < 4; ++k)
      json_["keyframes"].push_back({{"t", 0.2 * k}, {"cloud", k < 3 ? "frames/001.ply" : "frames/000.ply"}});
    EXPECT_EQ(message(), "");
    std::vector<std::string> notices;
    load_keyframes(load_recording(folder_ / "recording.json"), notices);
    return notices.at(0);
  };
  const std::string found = "3 of 4 keyframes have no point inside the crop box (t = 0 to 0.4 s)";
  EXPECT_TRUE(notice(0.03).ends_with(found +
                                     ": as usual at the beginning of a lift, while the sheet lies on the "
                                     "table"))
      << notice(0.03);
  EXPECT_TRUE(notice(0.3).ends_with(found)) << notice(0.3);
}

TEST_F(RecordingFiles, JumpsOfTheGripperAreTold) {
  folder_.write("gripper.tum", "0 0.2 0.2 0 0 0 0 1\n0.5 0.2 0.2 0.1 0 0 0 1\n0.6 10.2 0.2 0.1 0 0 0 1\n");
  EXPECT_EQ(message(), "");
  EXPECT_NE(load_recording(folder_ / "recording.json").doubts.at(0).find("a jump of up to 10 m"),
            std::string::npos);
}

class SharedRecording : public testing::TestWithParam<std::string> {};

TEST_P(SharedRecording, LoadsWithItsClouds) {
  const std::string folder = std::string(FLASH_SHARED_DIR) + "/data/" + GetParam();
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
  const Recording recording = load_recording(folder);
  std::vector<std::string> notices;
  const std::vector<Keyframe> keyframes = load_keyframes(recording, notices);
  EXPECT_GE(keyframes.size(), 21u);
  for (const Keyframe& keyframe : keyframes) {
    if (keyframe.time < 1.0) continue;
    EXPECT_GT(keyframe.cloud.rows(), 100) << keyframe.time;
  }
  const bool twin = GetParam().starts_with("twin");
  EXPECT_EQ(select_vertices(recording, recording.grasps[0]).size(), twin ? 9u : 4u);
  EXPECT_EQ(recording.mesh.vertices.rows(), twin ? 41 * 41 : 29 * 29);

  const TemporaryFolder copy;
  save_recording(recording, copy / "recording.json");
  const Recording again = load_recording(copy / "recording.json");
  EXPECT_EQ(again.keyframes.size(), recording.keyframes.size());
  EXPECT_TRUE(again.start.isApprox(recording.start, 1e-14));
}

INSTANTIATE_TEST_SUITE_P(All, SharedRecording,
                         testing::Values("lift/fold_paper", "lift/lift_navy", "lift/lift_navy2",
                                         "lift/lift_paper", "lift/lift_paper2", "lift/lift_redblack2",
                                         "lift/lift_tan", "twin/lift_a", "twin/lift_a_one_camera_3mm",
                                         "twin/lift_b"),
                         [](const auto& parameter) {
                           std::string name = parameter.param;
                           name[name.find('/')] = '_';
                           return name;
                         });

}  // namespace
}  // namespace flash::data
