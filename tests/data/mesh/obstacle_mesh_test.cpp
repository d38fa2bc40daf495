#include "data/mesh/obstacle_mesh.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"

namespace flash::data {
namespace {

const char* const kTetrahedron = R"(v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
)";

/// The same, each face with corners of its own.
const char* const kSoup = R"(v 0 0 0
v 0 1 0
v 1 0 0
v 0 0 0
v 1 0 0
v 0 0 1
v 0 0 0
v 0 0 1
v 0 1 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 2 3
f 4 5 6
f 7 8 9
f 10 11 12
)";

class ObstacleMeshFiles : public testing::Test {
 protected:
  ObstacleMeshFiles()
      : path_(
            (std::filesystem::temp_directory_path() /
             ("flash_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".obj"))
                .string()) {}
  ~ObstacleMeshFiles() override { std::filesystem::remove(path_); }

  ObstacleMesh load(const std::string& text, double scale = 1) {
    std::ofstream(path_) << text;
    return load_obstacle_mesh(path_, scale);
  }

  /// What is said of a bad mesh, without the name of the file.
  std::string error_of(const std::string& text) {
    try {
      load(text);
    } catch (const InputError& error) {
      const std::string said = error.what();
      EXPECT_EQ(said.rfind(path_ + ": ", 0), 0u) << said;
      return said.substr(path_.size() + 2);
    }
    return "";
  }

  std::string path_;
};

TEST_F(ObstacleMeshFiles, AClosedSurfaceIsKnownAsSuchAlsoWhereFacesStandByThemselves) {
  for (const char* text : {kTetrahedron, kSoup}) {
    const ObstacleMesh read = load(text, 0.5);
    EXPECT_TRUE(read.closed);
    EXPECT_EQ(read.mesh.vertices.rows(), 4);
    EXPECT_EQ(read.mesh.triangles.rows(), 4);
    EXPECT_EQ(read.mesh.vertices.maxCoeff(), 0.5);
  }
}

TEST_F(ObstacleMeshFiles, AnOpenSurfaceHasABorder) {
  std::string open = kTetrahedron;
  open.erase(open.rfind("f 2"));
  const ObstacleMesh read = load(open);
  EXPECT_FALSE(read.closed);
  EXPECT_EQ(read.border_edges, 3);
}

TEST_F(ObstacleMeshFiles, BadSurfacesAreNamedInOneLine) {
  const std::string good = kTetrahedron;
  EXPECT_EQ(error_of(good + "v nan 0 0\nf 1 2 5\n"), "1 of 5 points are not finite; first at index 4");
  EXPECT_EQ(error_of(good + "v 2 0 0\nf 1 2 5\n"),
            "triangle 4: is degenerate: vertices 0, 1, 4 lie on a line");
  EXPECT_EQ(error_of("v 0 0 0\n"), "found no triangles");

  std::string flipped = good;
  flipped.replace(flipped.find("f 1 3 2"), 7, "f 1 2 3");
  EXPECT_EQ(error_of(flipped).find("triangle 1: runs from vertex 0 to 1 as triangle 0 does: one of them is"),
            0u);

  // A fin on an edge, which three triangles share then.
  EXPECT_NE(error_of(good + "v 1 1 1\nf 1 2 5\n").find("more than two share the edge"), std::string::npos);

  std::string inside_out = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";
  EXPECT_EQ(
      error_of(inside_out),
      "is inside out: found a volume of -0.1667 m^3, expected triangles that run counter-clockwise seen "
      "from outside");

  // Two tetrahedra that meet in a point.
  EXPECT_EQ(
      error_of(good + "v -1 0 0\nv 0 -1 0\nv 0 0 -1\nf 1 5 6\nf 1 6 7\nf 1 7 5\nf 5 7 6\n"),
      "vertex 0: joins parts of the surface that share no edge there, at (0, 0, 0); expected one fan of "
      "triangles about each vertex");
}

}  // namespace
}  // namespace flash::data
