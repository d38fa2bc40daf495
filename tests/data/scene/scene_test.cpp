#include "data/scene/scene.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

using nlohmann::json;

const char* const kPublished =
    R"({"timestep": 0.01, "gravity": [0, -9.81, 0], "linearsolver": {"type": "SPARSE_INVERSE_CUDA"},
  "constraintsolver": {"type": "LiteNonSmoothNewton_CUDA", "maxforce": 1E+10, "iterations": 10, "tolerance": 1E-9},
  "planecollisions": {}, "objects": {"cloth": "assets/cloth.json"}})";

const char* const kFlash =
    R"({"schema": "flash-scene/1", "name": "all", "timestep": 0.005, "duration": 0.5, "gravity": [0, 0, -10],
  "solver": {"type": "projective", "iterations": 30, "tolerance": 1e-4}, "bending_model": "hinge",
  "constraintsolver": {"type": "NonSmoothNewton", "linearsolver": "DENSE_CR"},
  "planecollisions": {"table": {"point": [0, 0, -0.1], "normal": [0, 0, 2], "friction": 0.3}},
  "obstacles": {"rail": {"shape": "cylinder", "point": [0, 0, 0.1], "axis": [0, 3, 0], "radius": 0.02},
                "wall": {"shape": "plane", "point": [1, 0, 0], "normal": [-1, 0, 0], "friction": 0},
                "tray": {"shape": "box", "size": [0.1, 0.2, 0.3], "pose": [1, 2, 3, 0, 0, 0, 1]}},
  "objects": {"cloth": {"asset": "assets/cloth.json", "start": {"T_base_object": [0, 0, 1, 0, 0, 0.6, 0.8]}, "velocity": [1, 0, 0],
      "fixed": [{"vertices": [0, 1], "positions": [[0, 0, 0], [1, 0, 0]]}, {"vertices": "all", "axes": "z"}],
      "prescribed": [{"vertices": [4], "to": 2, "keyframes": [{"t": 0}, {"t": 1, "translation": [0, 0, 1], "rotation_xyzw": [1, 0, 0, 0]}]}],
      "loads": [{"vertices": [2], "force": [1, 2, 3]}, {"vertices": [5, 6], "hung_mass": 0.4},
                {"vertices": [5, 6], "attached_mass": 0.4}]},
    "flag": "assets/cloth.json"},
  "end_effectors": {"left": {"size": [0.01, 0.02, 0.03], "trajectory": "left.tum", "collides": true, "friction": 0.9,
      "grasps": [{"object": "flag", "from": 0.1, "to": 0.4, "threshold": 0.015, "zero_length": true, "closing_time": 0.05}]}},
  "friction": [{"a": "table", "b": "flag", "friction": 0.7}], "keyframes": [0, 0.25]})";

class SceneFiles : public testing::Test {
 protected:
  SceneFiles() {
    folder_.write("assets/cloth.json", "{}");
    folder_.write("left.tum", "0 0 0 0 0 0 0 1\n1 0 0 1 0 0 0 1\n");
  }

  Scene load(const std::string& text) { return load_scene(folder_.write("scene.json", text)); }

  std::string changed(const char* text, const char* pointer, const json& value) {
    json file = json::parse(text);
    file[json::json_pointer(pointer)] = value;
    const std::string path = folder_.write("scene.json", file.dump());
    const std::string message = input_error_of([&] { load_scene(path); });
    return message.starts_with(path) ? message.substr(path.size() + 2) : message;
  }

  TemporaryFolder folder_;
};

TEST_F(SceneFiles, PublishedSceneLoadsAsItStands) {
  const Scene scene = load(kPublished);
  EXPECT_EQ(scene.name, "scene");
  EXPECT_DOUBLE_EQ(scene.time_step, 0.01);
  EXPECT_EQ(scene.gravity, Eigen::Vector3d(0, -9.81, 0));
  EXPECT_EQ(scene.solver.linear_solver, "SPARSE_INVERSE_CUDA");
  EXPECT_EQ(scene.solver.constraint_solver, "LiteNonSmoothNewton_CUDA");
  EXPECT_TRUE(asks_for_cuda(scene.solver));
  EXPECT_DOUBLE_EQ(scene.solver.max_force, 1e10);
  EXPECT_EQ(scene.solver.constraint_iterations, 10);
  EXPECT_DOUBLE_EQ(scene.solver.constraint_tolerance, 1e-9);
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].name, "cloth");
  EXPECT_EQ(scene.objects[0].asset, folder_ / "assets/cloth.json");
  EXPECT_TRUE(scene.obstacles.empty());
}

TEST_F(SceneFiles, PlanesStandAloneInAListOrByName) {
  json file = json::parse(kPublished);
  const json plane = {{"point", {0, -1, 0}}, {"normal", {0, 2, 0}}, {"friction", 0.25}};
  for (const json& planes : {plane, json::array({plane}), json{{"table", plane}}}) {
    file["planecollisions"] = planes;
    const Scene scene = load(file.dump());
    ASSERT_EQ(scene.obstacles.size(), 1u) << planes;
    const ScenePlane& read = std::get<ScenePlane>(scene.obstacles[0].shape);
    EXPECT_EQ(read.point, Eigen::Vector3d(0, -1, 0));
    EXPECT_EQ(read.normal, Eigen::Vector3d::UnitY());
    EXPECT_EQ(scene.obstacles[0].friction, 0.25);
  }
}

TEST_F(SceneFiles, SpheresAndCapsulesAreRead) {
  json file = json::parse(kFlash);
  file["obstacles"] = json::parse(R"({
    "ball": {"shape": "sphere", "point": [0, 0, 1], "radius": 0.2, "friction": 0.4},
    "finger": {"shape": "capsule", "axis": [0, 0, 2], "half_length": 0.03, "radius": 0.01, "trajectory": "left.tum"},
    "rod": {"shape": "capsule", "point": [1, 0, 0], "half_length": 0.5, "radius": 0.02},
    "thumb": {"shape": "sphere", "radius": 0.01, "keyframes": [{"t": 0, "translation": [0, 0, 1]}]}})");
  const Scene scene = load(file.dump());
  ASSERT_EQ(scene.obstacles.size(), 5u);  // the table first, then by name
  const SceneCapsule& ball = std::get<SceneCapsule>(scene.obstacles[1].shape);
  EXPECT_EQ(ball.point, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(ball.radius, 0.2);
  EXPECT_EQ(ball.half_length, 0);
  EXPECT_EQ(scene.obstacles[1].friction, 0.4);
  const SceneCapsule& finger = std::get<SceneCapsule>(scene.obstacles[2].shape);
  EXPECT_EQ(finger.axis, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(finger.half_length, 0.03);
  EXPECT_EQ(finger.point, Eigen::Vector3d::Zero());
  EXPECT_EQ(finger.trajectory.times.size(), 2u);
  EXPECT_EQ(std::get<SceneCapsule>(scene.obstacles[3].shape).axis, Eigen::Vector3d::UnitX());
  EXPECT_EQ(std::get<SceneCapsule>(scene.obstacles[4].shape).trajectory.times.size(), 1u);

  const std::string text = file.dump();
  EXPECT_EQ(changed(text.c_str(), "/obstacles/ball/radius", 0),
            "obstacles.ball.radius: found 0, expected a number above 0");
  EXPECT_EQ(changed(text.c_str(), "/obstacles/rod/half_length", -1),
            "obstacles.rod.half_length: found -1, expected a number above 0");
  EXPECT_NE(
      changed(text.c_str(), "/obstacles/ball/half_length", 1).find("obstacles.ball.half_length: unknown"),
      std::string::npos);
  file["obstacles"]["rod"].erase("point");
  EXPECT_NE(input_error_of([&] { load(file.dump()); }).find("obstacles.rod.point: missing"),
            std::string::npos);
}

TEST_F(SceneFiles, MeshesAreRead) {
  folder_.write("chair.obj", "v 0 0 0\n");
  json file = json::parse(kFlash);
  file["obstacles"] = json::parse(R"({
    "chair": {"shape": "mesh", "file": "chair.obj", "scale": 0.001, "pose": [1, 2, 3, 0, 0, 0, 1], "margin": 0.002},
    "hand": {"shape": "mesh", "file": "chair.obj", "keyframes": [{"t": 0, "translation": [0, 0, 1]}]}})");
  const Scene scene = load(file.dump());
  const SceneMesh& chair = std::get<SceneMesh>(scene.obstacles[1].shape);
  EXPECT_EQ(chair.scale, 0.001);
  EXPECT_EQ(chair.margin, 0.002);
  EXPECT_EQ(chair.pose.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(chair.file.ends_with("chair.obj"));
  const SceneMesh& hand = std::get<SceneMesh>(scene.obstacles[2].shape);
  EXPECT_EQ(hand.margin, std::nullopt);
  EXPECT_EQ(hand.trajectory.times.size(), 1u);

  const std::string text = file.dump();
  EXPECT_EQ(changed(text.c_str(), "/obstacles/chair/margin", -1),
            "obstacles.chair.margin: found -1, expected a number of 0 or above");
  EXPECT_NE(changed(text.c_str(), "/obstacles/hand/pose", json::parse("[0, 0, 0, 0, 0, 0, 1]"))
                .find("obstacles.hand.pose: found"),
            std::string::npos);
}

TEST_F(SceneFiles, OurAdditionsAreRead) {
  const Scene scene = load(kFlash);
  EXPECT_EQ(scene.steps, 100);
  EXPECT_EQ(scene.solver.integrator, "projective");
  EXPECT_EQ(scene.solver.max_iterations, 30);
  EXPECT_EQ(scene.solver.constraint_linear_solver, "DENSE_CR");
  EXPECT_FALSE(asks_for_cuda(scene.solver));
  EXPECT_EQ(scene.bending_model, BendingModel::hinge);
  EXPECT_EQ(scene.keyframe_times, (std::vector<double>{0, 0.25}));

  ASSERT_EQ(scene.obstacles.size(), 4u);  // in order of kind, then of name
  EXPECT_EQ(scene.obstacles[0].name, "table");
  EXPECT_EQ(std::get<SceneCylinder>(scene.obstacles[1].shape).axis, Eigen::Vector3d::UnitY());
  EXPECT_EQ(std::get<SceneBox>(scene.obstacles[2].shape).pose.translation(), Eigen::Vector3d(1, 2, 3));

  ASSERT_EQ(scene.objects.size(), 2u);
  const SceneObject& cloth = scene.objects[0];
  EXPECT_EQ(cloth.base_from_object.translation(), Eigen::Vector3d::UnitZ());
  EXPECT_EQ(cloth.start_velocity, Eigen::Vector3d::UnitX());
  EXPECT_EQ(cloth.fixed[0].positions.row(1), Eigen::RowVector3d(1, 0, 0));
  EXPECT_TRUE(cloth.fixed[1].all);
  EXPECT_EQ(cloth.fixed[1].axes, (std::array<bool, 3>{false, false, true}));
  EXPECT_EQ(pose_at(cloth.prescribed[0].trajectory, 0.5).translation(), Eigen::Vector3d(0, 0, 0.5));
  EXPECT_EQ(cloth.prescribed[0].to, 2);
  EXPECT_EQ(cloth.loads[0].force, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(cloth.loads[1].force, Eigen::Vector3d(0, 0, -2));  // 0.4 kg at 10 m/s^2 over two vertices
  EXPECT_EQ(cloth.loads[2].force, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(cloth.loads[2].attached_mass, 0.2);

  const SceneEndEffector& left = scene.end_effectors.at(0);
  EXPECT_EQ(left.size, Eigen::Vector3d(0.01, 0.02, 0.03));
  EXPECT_TRUE(left.collides);
  EXPECT_EQ(left.trajectory.times.size(), 2u);
  EXPECT_EQ(left.grasps.at(0).object, "flag");
  EXPECT_TRUE(left.grasps[0].zero_length);
  EXPECT_EQ(left.grasps[0].threshold, 0.015);
}

TEST_F(SceneFiles, FrictionBelongsToThePairThenToTheBody) {
  const Scene scene = load(kFlash);
  EXPECT_EQ(friction_between(scene, "flag", "table"), 0.7);
  EXPECT_EQ(friction_between(scene, "cloth", "table"), 0.3);
  EXPECT_EQ(friction_between(scene, "cloth", "left"), 0.9);
  EXPECT_EQ(friction_between(scene, "cloth", "rail"), std::nullopt);
}

TEST_F(SceneFiles, DirectionsMayBeOfAnyLength) {
  for (const double length : {1e-8, 1.0, 1e155, 1e300}) {
    json file = json::parse(kPublished);
    file["planecollisions"] = {{"point", {0, 0, 0}}, {"normal", {0, 0, length}}, {"friction", 0.25}};
    const Scene scene = load(file.dump());
    EXPECT_EQ(std::get<ScenePlane>(scene.obstacles[0].shape).normal, Eigen::Vector3d::UnitZ());
  }
  json file = json::parse(kPublished);
  file["planecollisions"] = {{"point", {0, 0, 0}}, {"normal", {0, 1.3e308, 1.3e308}}, {"friction", 0.25}};
  const Scene scene = load(file.dump());
  EXPECT_LT(
      (std::get<ScenePlane>(scene.obstacles[0].shape).normal - Eigen::Vector3d(0, 1, 1).normalized()).norm(),
      1e-15);
}

TEST_F(SceneFiles, WrongFieldsAreNamed) {
  EXPECT_EQ(changed(kPublished, "/gravitiy", 1), "gravitiy: unknown field (did you mean \"gravity\"?)");
  const std::string steps = ", expected a number from 1e-07 to 1 [s]";
  EXPECT_EQ(changed(kPublished, "/timestep", 0), "timestep: found 0" + steps);
  EXPECT_EQ(changed(kPublished, "/timestep", 1e-300), "timestep: found 1e-300" + steps);
  EXPECT_EQ(changed(kPublished, "/timestep", 9e-8), "timestep: found 9e-08" + steps);
  EXPECT_EQ(changed(kPublished, "/timestep", 1.1), "timestep: found 1.1" + steps);
  EXPECT_EQ(changed(kPublished, "/timestep", "soon"), "timestep: found \"soon\", expected a number");
  EXPECT_EQ(changed(kPublished, "/constraintsolver/type", "Newton"),
            "constraintsolver.type: found \"Newton\", expected one of automatic, NonSmoothNewton, "
            "LiteNonSmoothNewton, "
            "NonSmoothNewton_CUDA, LiteNonSmoothNewton_CUDA");
  EXPECT_EQ(changed(kPublished, "/constraintsolver/iterations", 2.5),
            "constraintsolver.iterations: found 2.5, expected a whole number");
  EXPECT_EQ(changed(kPublished, "/objects/cloth", "none.json"),
            "objects.cloth: file " + folder_ / "none.json" + " does not exist");
  EXPECT_EQ(changed(kPublished, "/objects", json::object()),
            "objects: found {}, expected at least one object");
  EXPECT_EQ(changed(kPublished, "/planecollisions/table", {{"point", {0, 0, 0}}}),
            "planecollisions.table.normal: missing, expected a direction, out of the solid");
  EXPECT_EQ(changed(kFlash, "/steps", 5), "steps: found duration beside it, expected one of the two");
  EXPECT_EQ(
      changed(kFlash, "/obstacles/rail/shape", "cone"),
      "obstacles.rail.shape: found \"cone\", expected one of plane, box, cylinder, sphere, capsule, mesh");
  EXPECT_EQ(changed(kFlash, "/obstacles/rail/radius", -1),
            "obstacles.rail.radius: found -1, expected a number above 0");
  EXPECT_EQ(changed(kFlash, "/obstacles/rail/radius", 1e300),
            "obstacles.rail.radius: found 1e+300, expected at most 1e+05 m");
  EXPECT_EQ(changed(kFlash, "/obstacles/rail/point", {0, 0, 1e300}),
            "obstacles.rail.point: found [0,0,1e+300], expected coordinates of at most 1e+05 m");
  EXPECT_EQ(changed(kFlash, "/obstacles/rail/friction", 1e300),
            "obstacles.rail.friction: found 1e+300, expected at most 1000");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/velocity", {1e6, 0, 0}),
            "objects.cloth.velocity: found [1000000.0,0,0], expected at most 1000 m/s");
  EXPECT_EQ(changed(kFlash, "/self_contact", {{"thickness", 1e-300}}),
            "self_contact.thickness: found 1e-300, expected a number from 1e-06 to 1");
  EXPECT_EQ(changed(kFlash, "/self_contact", {{"pressure", 1e300}}),
            "self_contact.pressure: found 1e+300, expected a number from 0.001 to 1e+09");
  EXPECT_EQ(changed(kFlash, "/friction/0", {{"a", "cloth"}, {"b", "table"}}),
            "friction[0].friction: missing, expected a number of 0 or above");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/fixed/0/axes", "w"),
            "objects.cloth.fixed[0].axes: found \"w\", expected letters of xyz, such as \"z\" for a roller");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/fixed/0/vertices", {1, -2}),
            "objects.cloth.fixed[0].vertices: found [1,-2], expected indices, whole numbers from 0");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/fixed/0/vertices", {3, 1, 3}),
            "objects.cloth.fixed[0].vertices: found [3,1,3], expected each vertex once");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/loads/0/hung_mass", 1),
            "objects.cloth.loads[0].force: found [1,2,3], expected one of force [N] on each vertex, "
            "hung_mass and attached_mass [kg] shared by them");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/fixed/0/positions/1", {0, -1e300, 0}),
            "objects.cloth.fixed[0].positions: found -1e+300, expected coordinates of at most 1e+05 m");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/loads/0/force", {0, -1e20, 0}),
            "objects.cloth.loads[0].force: found [0,-1e+20,0], expected components of at most 1e+09 N");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/loads/1/hung_mass", 1e20),
            "objects.cloth.loads[1].hung_mass: found 1e+20, expected at most 1e+06 kg");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/loads/2/attached_mass", 1e300),
            "objects.cloth.loads[2].attached_mass: found 1e+300, expected at most 1e+06 kg");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/loads/2/attached_mass", -1),
            "objects.cloth.loads[2].attached_mass: found -1, expected a number above 0");
  EXPECT_EQ(changed(kFlash, "/end_effectors/left/grasps/0/object", "rag"),
            "end_effectors.left.grasps[0].object: found \"rag\", expected a name of objects");
  EXPECT_EQ(changed(kFlash, "/friction/0/b", "floor"),
            "friction[0].b: found \"floor\", expected one of cloth, flag, table, rail, tray, wall, left");
  EXPECT_EQ(
      changed(kFlash, "/friction/0/a", "cloth"),
      "friction[0].b: found \"flag\", expected one object, and one obstacle or end effector that collides");
  EXPECT_EQ(
      changed(kFlash, "/friction/0/b", "rail"),
      "friction[0].b: found \"rail\", expected one object, and one obstacle or end effector that collides");
  EXPECT_EQ(changed(kFlash, "/friction/1", {{"a", "flag"}, {"b", "table"}, {"friction", 1}}),
            "friction[1].b: found \"table\", expected each pair once");
  EXPECT_EQ(changed(kFlash, "/objects/cloth/fixed/0/name", ""),
            "objects.cloth.fixed[0].name: found \"\", expected a name");
  EXPECT_EQ(changed(kFlash, "/obstacles/", {{"shape", "plane"}, {"normal", {0, 0, 1}}, {"point", {0, 0, 0}}}),
            "obstacles: found the name \"\", expected a name for each");
  EXPECT_EQ(
      changed(kFlash, "/obstacles/left", {{"shape", "plane"}, {"point", {0, 0, 0}}, {"normal", {0, 0, 1}}}),
      "end_effectors.left: found a name that another body has, expected names that differ");
}

}  // namespace
}  // namespace flash::data
