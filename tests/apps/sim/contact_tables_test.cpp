#include "apps/sim/contact_tables.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "apps/sim/scene_run.h"
#include "data/mesh/mesh_io.h"
#include "data/scene/scene.h"
#include "sim/step/resultants.h"

namespace flash::sim {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

using Row = std::map<std::string, std::string>;  ///< by column

/// Of a file without quotes.
std::vector<Row> rows_of_file(const fs::path& path) {
  std::ifstream in(path);
  std::vector<std::string> names;
  std::vector<Row> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream stream(line);
    std::vector<std::string> words;
    for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
    if (names.empty()) {
      names = words;
      continue;
    }
    EXPECT_EQ(words.size(), names.size()) << path;
    Row& row = rows.emplace_back();
    for (std::size_t k = 0; k < names.size(); ++k) row[names[k]] = words.at(k);
  }
  return rows;
}

Vector3d vector_of(const Row& row, const std::string& x, const std::string& y, const std::string& z) {
  return {std::stod(row.at(x)), std::stod(row.at(y)), std::stod(row.at(z))};
}
Vector3d vector_of(const Row& row, const std::string& name) {
  return vector_of(row, name + "x", name + "y", name + "z");
}

class ContactTablesTest : public testing::Test {
 protected:
  ContactTablesTest()
      : folder_(fs::temp_directory_path() /
                ("flash_contacts_" +
                 std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::ofstream(folder_ / "cloth.json")
        << R"({"schema": "flash-asset/1", "mesh": "sheet:0.1x0.1:0.02", "element_type": "TRIANGLE",
      "mechanical_props": {"constitutive": "TRI_COROTATED", "areal_density": 0.2, "young": 100, "poisson": 0.3,
      "bending_rigidity": 1e-5, "friction": 0.3}})";
  }
  ~ContactTablesTest() override { fs::remove_all(folder_); }

  SceneSummary run(const std::string& scene, bool contacts, int threads = 1) {
    std::ofstream(folder_ / "scene.json") << scene;
    SceneRun settings;
    settings.threads = threads;
    settings.contacts = contacts;
    return run_scene(data::load_scene((folder_ / "scene.json").string()), settings, out().string());
  }
  std::string text_of(const std::string& file) const {
    std::ifstream in(out() / file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  fs::path out() const { return folder_ / "out"; }

  /// The contacts of a frame agree with its mesh, and their sums with the resultants at `time`. Returns
  /// those.
  std::map<std::string, Wrench> checked(const std::string& frame, const std::string& time) const {
    const data::TriangleMesh mesh = data::load_triangle_mesh((out() / "frames" / (frame + ".ply")).string());
    std::map<std::string, Wrench> sums, told;
    for (const Row& row : rows_of_file(out() / "contacts" / (frame + ".csv"))) {
      const Vector3d point = vector_of(row, ""), other_point = vector_of(row, "other_");
      const Vector3d normal = vector_of(row, "normal_"), couple = vector_of(row, "couple_");
      const Vector3d force = std::stod(row.at("normal_force")) * normal + vector_of(row, "friction_");
      const bool at_vertex = row.at("kind") != "edge_edge";
      if (at_vertex) {
        EXPECT_LE((mesh.vertices.row(std::stoi(row.at("v0"))).transpose() - point).norm(),
                  1e-6);  // of the file
      }
      EXPECT_EQ(row.at("v1") == "-1", row.at("kind") == "vertex_obstacle");
      Wrench &on = sums[row.at("body")], &against = sums[row.at("other")];
      on.force += force;
      on.torque += point.cross(force) + couple;
      against.force -= force;
      against.torque -= other_point.cross(force) + couple;
    }
    for (const Row& row : rows_of_file(out() / "resultants.csv"))
      if (row.at("t") == time) told[row.at("body")] = {vector_of(row, "f"), vector_of(row, "t")};
    EXPECT_EQ(told.size(), 3u);
    for (const auto& [name, wrench] : told) {
      EXPECT_LE((wrench.force - sums[name].force).norm(), 1e-15) << name;
      EXPECT_LE((wrench.torque - sums[name].torque).norm(), 1e-15) << name;
    }
    return told;
  }

  fs::path folder_;
};

constexpr double weight = 0.2 * 0.01 * 9.81;  // of the cloth in cloth.json [N]

constexpr const char* layers = R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 20,
    "gravity": [0, 0, -9.81], "self_contact": {"thickness": 2e-3, "friction": 0.4}, "keyframes": [0, 0.1, 0.2],
    "objects": {"lower": {"asset": "cloth.json"},
      "upper": {"asset": "cloth.json", "start": {"T_base_object": [0.01, 0.003, 0.0021, 0, 0, 0, 1]}}},
    "obstacles": {"table": {"shape": "plane", "normal": [0, 0, 1]}}})";

TEST_F(ContactTablesTest, ContactsOfLayersAddUpToTheResultants) {
  EXPECT_EQ(run(layers, true).frames, 3);
  EXPECT_FALSE(fs::exists(out() / "contacts/000000.csv"));
  const std::map<std::string, Wrench> end = checked("000020", "0.2");
  checked("000010", "0.1");
  // Both rest: the tolerance of the residual.
  EXPECT_NEAR(end.at("upper").force.z(), weight, 1e-2 * weight);
  EXPECT_NEAR(end.at("lower").force.z(), weight, 1e-2 * weight);
  EXPECT_NEAR(end.at("table").force.z(), -2 * weight, 1e-2 * weight);
}

constexpr const char* apart = R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 5,
    "gravity": [0, 0, -9.81], "keyframes": [0.05], "objects": {"here": {"asset": "cloth.json"},
      "there": {"asset": "cloth.json", "start": {"T_base_object": [1, 0, 0, 0, 0, 0, 1]}}},
    "obstacles": {"table": {"shape": "plane", "normal": [0, 0, 1]}}})";

TEST_F(ContactTablesTest, ObjectsThatDoNotMeetShareTheirObstacle) {
  run(apart, true);
  const std::map<std::string, Wrench> end = checked("000005", "0.05");
  EXPECT_NEAR(end.at("table").force.z(), -2 * weight, 1e-2 * weight);
  // About the origin: the middles of the sheets are at x = 0.05 and 1.05.
  EXPECT_NEAR(end.at("here").torque.y(), -0.05 * weight, 1e-2 * weight);
  EXPECT_NEAR(end.at("there").torque.y(), -1.05 * weight, 1e-2 * weight);
}

TEST_F(ContactTablesTest, AreTheSameOnAnyNumberOfThreads) {
  run(apart, true);
  const std::string contacts = text_of("contacts/000005.csv"), resultants = text_of("resultants.csv");
  EXPECT_GT(contacts.size(), 1000u);
  for (const int threads : {2, 3}) {
    run(apart, true, threads);
    EXPECT_EQ(text_of("contacts/000005.csv"), contacts) << threads;
    EXPECT_EQ(text_of("resultants.csv"), resultants) << threads;
  }
}

TEST_F(ContactTablesTest, AreThereWhereAskedForAlone) {
  run(layers, false);
  EXPECT_FALSE(fs::exists(out() / "contacts") || fs::exists(out() / "resultants.csv"));
  run(layers, true);
  EXPECT_TRUE(fs::exists(out() / "contacts/000010.csv") && fs::exists(out() / "resultants.csv"));
  run(layers, false);
  EXPECT_FALSE(fs::exists(out() / "contacts") || fs::exists(out() / "resultants.csv"));
}

TEST(ContactTables, NamesWithCommasAreInQuotes) {
  SceneBody body;
  body.name = "a, b";
  body.sheet.bodies.resize(1);
  body.environment.obstacles = {{.shape = Plane{}, .name = "a \"table\""}};
  const std::vector<std::vector<ContactForce>> contacts = {{{.vertices = {2, -1, -1, -1}}}};
  const std::string table = contact_table({body}, contacts);
  EXPECT_NE(table.find("\nvertex_obstacle,\"a, b\",\"a \"\"table\"\"\",2,-1,-1,-1,0,"), std::string::npos);
  EXPECT_EQ(resultant_rows(0.5, {body}, contacts).substr(0, 13), "0.5,\"a \"\"tabl");
}

}  // namespace
}  // namespace flash::sim
