#include "data/mesh/gmsh.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>

#include "data/files/error.h"
#include "data/mesh/mesh_io.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

/// A unit corner, its faces, an edge and a point; node 7 is of no element that counts.
const std::string kHead22 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
const std::string kNodes22 = "$Nodes\n5\n10 0 0 0\n7 5 5 5\n20 1 0 0\n30 0 1 0\n40 0 0 1\n$EndNodes\n";
const std::string kElements22 =
    "$Elements\n5\n1 15 2 0 1 7\n2 1 2 0 1 10 20\n3 2 2 0 1 10 30 20\n4 4 2 99 1 10 20 30 40\n"
    "5 2 0 20 30 40\n$EndElements\n";

const std::string kHead41 = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
const std::string kNodes41 =
    "$Nodes\n2 5 7 40\n2 1 1 2\n10\n7\n0 0 0 0.1 0.2\n5 5 5 0.3 0.4\n3 1 0 3\n20\n30\n40\n1 0 0\n0 1 0\n0 0 "
    "1\n"
    "$EndNodes\n";
const std::string kElements41 =
    "$Elements\n2 3 1 3\n2 1 2 2\n1 10 30 20\n2 20 30 40\n3 1 4 1\n3 10 20 30 40\n$EndElements\n";

template <class T>
void put(T value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// The same as kNodes41 and kElements41.
std::string binary41() {
  std::string bytes = "$MeshFormat\n4.1 1 8\n";
  const auto ints = [&](std::initializer_list<int> values) {
    for (const int value : values) put<std::int32_t>(value, bytes);
  };
  const auto sizes = [&](std::initializer_list<int> values) {
    for (const int value : values) put<std::uint64_t>(std::uint64_t(value), bytes);
  };
  const auto reals = [&](std::initializer_list<double> values) {
    for (const double value : values) put(value, bytes);
  };
  ints({1});
  bytes += "\n$EndMeshFormat\n$Entities\n";
  sizes({0, 0, 0, 0});
  bytes += "\n$EndEntities\n$Nodes\n";
  sizes({2, 5, 7, 40});
  ints({2, 1, 1});
  sizes({2, 10, 7});
  reals({0, 0, 0, 0.1, 0.2, 5, 5, 5, 0.3, 0.4});
  ints({3, 1, 0});
  sizes({3, 20, 30, 40});
  reals({1, 0, 0, 0, 1, 0, 0, 0, 1});
  bytes += "\n$EndNodes\n$Elements\n";
  sizes({2, 3, 1, 3});
  ints({2, 1, 2});
  sizes({2, 1, 10, 30, 20, 2, 20, 30, 40});
  ints({3, 1, 4});
  sizes({1, 3, 10, 20, 30, 40});
  return bytes + "\n$EndElements\n";
}

TEST(Gmsh, TetrahedraOfAllVersionsAreTheSame) {
  for (const std::string& file :
       {kHead22 + kNodes22 + kElements22, kHead41 + kNodes41 + kElements41, binary41(),
        kHead22 + "$PhysicalNames\n1\n3 99 \"a part\"\n$EndPhysicalNames\n" + kNodes22 + kElements22 +
            "$NodeData\n1\n\"T\"\n$EndNodeData\n"}) {
    const Geometry mesh = parse_msh(file, "a.msh");
    ASSERT_EQ(mesh.points.rows(), 4);
    EXPECT_EQ(mesh.points, (Points(4, 3) << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1).finished());
    EXPECT_EQ(mesh.tetrahedra, (Tetrahedra(1, 4) << 0, 1, 2, 3).finished());
    EXPECT_EQ(mesh.triangles.rows(), 0);
  }
}

TEST(Gmsh, TrianglesAndQuadsWithoutTetrahedraAreASheet) {
  const std::string nodes = "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 2 0 0\n$EndNodes\n";
  const Geometry mesh = parse_msh(
      kHead22 + nodes + "$Elements\n2\n1 3 2 0 1 1 2 3 4\n2 2 2 0 1 2 5 3\n$EndElements\n", "a.msh");
  EXPECT_EQ(mesh.points.rows(), 5);
  EXPECT_EQ(mesh.triangles, (Triangles(3, 3) << 0, 1, 2, 0, 2, 3, 1, 4, 2).finished());
}

TEST(Gmsh, FilesAreKnownByTheirEnding) {
  const TemporaryFolder folder;
  const TetMesh mesh = load_tet_mesh(folder.write("part.msh", kHead41 + kNodes41 + kElements41));
  EXPECT_EQ(mesh.tetrahedra.rows(), 1);
}

std::string message_of(const std::string& file) {
  try {
    parse_msh(file, "a.msh");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string with(std::string text, const std::string& what, const std::string& by) {
  text.replace(text.find(what), what.size(), by);
  return text;
}

TEST(Gmsh, BadFilesAreNamed) {
  const auto bad22 = [&](const std::string& nodes, const std::string& elements) {
    return message_of(kHead22 + nodes + elements);
  };
  EXPECT_EQ(message_of(""), "a.msh: found no $MeshFormat at its beginning, expected a Gmsh mesh");
  EXPECT_EQ(message_of(with(kHead41, "4.1 0", "4.0 0")),
            "a.msh: $MeshFormat: found version 4.0, expected 2.2 in ascii, or 4.1 (gmsh -format msh41)");
  EXPECT_EQ(
      message_of(with(kHead22, "2.2 0", "2.2 1")),
      "a.msh: $MeshFormat: found version 2.2, binary, expected 2.2 in ascii, or 4.1 (gmsh -format msh41)");
  EXPECT_EQ(message_of(kHead22), "a.msh: found no $Nodes");
  EXPECT_EQ(message_of(kHead22 + kNodes22), "a.msh: found no $Elements");
  EXPECT_EQ(message_of(kHead22 + kElements22 + kNodes22), "a.msh: $Elements: stands before $Nodes");
  EXPECT_EQ(message_of(kHead22 + kNodes22 + kNodes22), "a.msh: $Nodes: stands there twice");
  EXPECT_EQ(bad22(with(kNodes22, "\n5\n", "\n99999999999999\n"), kElements22),
            "a.msh: $Nodes: found a count of 99999999999999 nodes, expected one no larger than the file");
  EXPECT_EQ(bad22(with(kNodes22, "\n5\n", "\n-1\n"), kElements22),
            "a.msh: $Nodes: found a count of -1 nodes, expected one no larger than the file");
  EXPECT_EQ(bad22(with(kNodes22, "\n5\n", "\n6\n"), kElements22), "a.msh: $Nodes: ends within its numbers");
  EXPECT_EQ(bad22(with(kNodes22, "\n5\n", "\n4\n"), kElements22),
            "a.msh: $Nodes: found \"40\", expected $EndNodes");
  EXPECT_EQ(bad22(with(kNodes22, "\n7 5", "\n10 5"), kElements22), "a.msh: $Nodes: found node 10 twice");
  EXPECT_EQ(bad22(with(kNodes22, "5 5 5", "5 x 5"), kElements22),
            "a.msh: $Nodes: found \"x\", expected a number");
  EXPECT_EQ(bad22(kNodes22, with(kElements22, "10 20 30 40", "10 20 30 41")),
            "a.msh: $Elements: element 4: found node 41, which $Nodes does not have");
  EXPECT_EQ(
      bad22(kNodes22, with(kElements22, "4 4 2 99 1 10 20 30 40", "4 5 2 99 1 10 20 30 40 10 20 30 40")),
      "a.msh: $Elements: found hexahedra (type 5), expected tetrahedra or triangles alone");
  EXPECT_EQ(
      bad22(kNodes22, with(kElements22, "4 4 2 99 1 10 20 30 40", "4 11 2 99 1 10 20 30 40 7 7 7 7 7 7")),
      "a.msh: $Elements: found tetrahedra of order 2 (type 11), expected tetrahedra or triangles of order 1; "
      "\"element_order\": 2 in an asset makes quadratic ones");
  EXPECT_EQ(bad22(kNodes22, with(kElements22, "4 4 2", "4 777 2")),
            "a.msh: $Elements: found elements of type 777, expected tetrahedra (4) or triangles (2)");
  EXPECT_EQ(message_of(kHead41 + with(kNodes41, "2 5 7 40", "2 6 7 40") + kElements41),
            "a.msh: $Nodes: found 5 nodes in its blocks, expected the 6 of its head");
  EXPECT_EQ(message_of(kHead41 + with(kNodes41, "\n2 1 1 2\n", "\n9 1 1 2\n") + kElements41),
            "a.msh: $Nodes: found an entity of dimension 9, expected 0 to 3");
  EXPECT_EQ(message_of(kHead41 + kNodes41 + with(kElements41, "2 3 1 3", "2 4 1 3")),
            "a.msh: $Elements: found 3 elements in its blocks, expected the 4 of its head");
  std::string huge = binary41();
  const std::size_t at = huge.find("$Nodes\n") + 7;
  for (std::size_t i = 0; i < 8; ++i) huge[at + i] = '\x7f';
  EXPECT_NE(message_of(huge).find("expected one no larger than the file"), std::string::npos)
      << message_of(huge);
}

// Wherever a file ends, it says so; nothing is read past its end.
TEST(Gmsh, AFileThatIsCutOffIsRefused) {
  for (const std::string& file :
       {kHead22 + kNodes22 + kElements22, kHead41 + kNodes41 + kElements41, binary41()})
    for (std::size_t bytes = 0; bytes + 2 < file.size(); ++bytes)
      EXPECT_NE(message_of(file.substr(0, bytes)), "") << bytes << " of " << file.size();
}

TEST(Gmsh, DamagedFilesAreErrorsNotCrashes) {
  std::mt19937 generator(3);
  for (const std::string& file :
       {kHead22 + kNodes22 + kElements22, kHead41 + kNodes41 + kElements41, binary41()})
    for (int trial = 0; trial < 2000; ++trial) {
      std::string damaged = file;
      for (int k = 0; k < 3; ++k) damaged[generator() % damaged.size()] = static_cast<char>(generator());
      try {
        const Geometry mesh = parse_msh(damaged, "a.msh");
        if (mesh.tetrahedra.rows() > 0) {
          EXPECT_GE(mesh.tetrahedra.minCoeff(), 0);
          EXPECT_LT(mesh.tetrahedra.maxCoeff(), mesh.points.rows());
        }
      } catch (const InputError& error) {
        ASSERT_EQ(std::string(error.what()).find("a.msh: "), 0u);
      }
    }
}

}  // namespace
}  // namespace flash::data
