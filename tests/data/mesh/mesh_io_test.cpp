#include "data/mesh/mesh_io.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <random>

#include "data/files/atomic_file.h"
#include "data/files/text.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

TEST(MeshIo, TrianglesSurviveEveryFormatExactly) {
  const TemporaryFolder folder;
  TriangleMesh mesh = delaunay_rectangle(0.3, 0.2, 0.05, 3);
  mesh.vertices.col(2).setConstant(1.0 / 3);
  for (const char* name : {"a.ply", "a.obj", "a.vtk"}) {
    SCOPED_TRACE(name);
    save_triangle_mesh(mesh, folder / name);
    const TriangleMesh read = load_triangle_mesh(folder / name);
    EXPECT_EQ(read.vertices, mesh.vertices);
    EXPECT_EQ(read.triangles, mesh.triangles);
  }
}

TEST(MeshIo, TetrahedraSurviveEveryFormatExactly) {
  const TemporaryFolder folder;
  const TetMesh mesh = tet_box({0.3, 0.2, 0.1}, {3, 2, 1});
  for (const char* name : {"a.vtk", "a.tet"}) {
    SCOPED_TRACE(name);
    save_tet_mesh(mesh, folder / name);
    const TetMesh read = load_tet_mesh(folder / name);
    EXPECT_EQ(read.vertices, mesh.vertices);
    EXPECT_EQ(read.tetrahedra, mesh.tetrahedra);
  }
}

TEST(MeshIo, CloudsSurviveInFloat) {
  const TemporaryFolder folder;
  const Points points = Points::Random(50, 3);
  for (const char* name : {"a.ply", "a.pcd"}) {
    SCOPED_TRACE(name);
    save_point_cloud(points, folder / name);
    EXPECT_EQ(load_point_cloud(folder / name), points.cast<float>().cast<double>());
  }
}

TEST(MeshIo, EmptyCloudIsReadAsEmpty) {
  const TemporaryFolder folder;
  save_point_cloud({}, folder / "a.ply");
  EXPECT_EQ(load_point_cloud(folder / "a.ply").rows(), 0);
}

TEST(MeshIo, AsciiPlySkipsWhatItDoesNotNeedAndFansPolygons) {
  const TemporaryFolder folder;
  const std::string path = folder.write(
      "a.ply",
      "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nelement thing 1\nproperty list uchar "
      "float junk\nelement vertex 4\nproperty uchar red\n"
      "property double x\nproperty float y\nproperty int z\nelement face 1\nproperty list uchar uint "
      "vertex_index\nproperty float quality\nend_header\n2 0.5 0.5\n255 0 0 0\n255 1 0 0\n255 1 1 0\n255 0 1 "
      "2\n4 0 1 2 3 0.25\n");
  const TriangleMesh mesh = load_triangle_mesh(path);
  Points vertices(4, 3);
  vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 2;
  Triangles triangles(2, 3);
  triangles << 0, 1, 2, 0, 2, 3;
  EXPECT_EQ(mesh.vertices, vertices);
  EXPECT_EQ(mesh.triangles, triangles);
}

TEST(MeshIo, ObjUnderstandsTexturesNormalsNegativeIndicesAndQuads) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a.obj",
                                        "# made by hand\nmtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 "
                                        "0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1\nf -4 -2 -1\n");
  Triangles triangles(2, 3);
  triangles << 0, 1, 2, 0, 2, 3;
  EXPECT_EQ(load_triangle_mesh(path).triangles, triangles);
}

TEST(MeshIo, BinaryVtkIsBigEndian) {
  const TemporaryFolder folder;
  const auto big = [](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    return std::string(bytes.rbegin(), bytes.rend());
  };
  std::string file = "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n";
  for (const float value : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.5f}) file += big(value);
  file += "\nCELLS 3 13\n";
  for (const int value : {4, 0, 2, 1, 3, 3, 0, 1, 2, 3, 0, 3, 1}) file += big(value);
  file += "\nCELL_TYPES 3\n";
  for (const int value : {10, 5, 5}) file += big(value);
  file += "\n";
  const std::string path = folder.write("a.vtk", file);
  const TetMesh tets = load_tet_mesh(path);
  EXPECT_EQ(tets.vertices(3, 2), 1.5);
  // Written inside out: turned on loading.
  EXPECT_EQ(tets.tetrahedra.row(0), Eigen::RowVector4i(0, 2, 3, 1));
  EXPECT_EQ(load_triangle_mesh(path).triangles.row(0), Eigen::RowVector3i(0, 1, 2));
}

TEST(MeshIo, VtkOfVersionFiveHasOffsetsAndConnectivity) {
  const TemporaryFolder folder;
  const std::string path = folder.write(
      "a.vtk",
      "# vtk DataFile Version 5.1\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0 0 0 1 0 0 1 1 0\n0 1 "
      "0\nMETADATA\n"
      "INFORMATION 0\n\nPOLYGONS 3 6\nOFFSETS vtktypeint64\n0 3 6\nCONNECTIVITY vtktypeint64\n0 1 2 0 2 3\n"
      "POINT_DATA 4\nSCALARS s float 1\nLOOKUP_TABLE default\n1 2 3 4\n");
  EXPECT_EQ(load_triangle_mesh(path).triangles.row(1), Eigen::RowVector3i(0, 2, 3));
}

TEST(MeshIo, AsciiPcdDropsTheHolesOfAnOrganisedCloud) {
  const TemporaryFolder folder;
  const std::string path =
      folder.write("a.pcd",
                   "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 "
                   "1\nWIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n9 1 2 3\n9 nan nan nan\n9 4 5 6\n");
  const Points points = load_point_cloud(path);
  ASSERT_EQ(points.rows(), 2);
  EXPECT_EQ(points.row(1), Eigen::RowVector3d(4, 5, 6));
}

/// What PCL 1.13 writes for eight points x = 1/4, 1/4, 1/4, 1/4, 1/2, ..., y = 1, z = 2 but for the seventh's
/// NaN.
const std::string compressed_header =
    "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 "
    "1 1\n"
    "WIDTH 8\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 8\nDATA binary_compressed\n";
const std::string compressed_body(
    "\x26\x00\x00\x00\x60\x00\x00\x00\x04\x00\x00\x80\x3e\x00\xe0\x04\x03\x02\x00\x3f\x00\xe0"
    "\x04\x03\x00\x80\x20\x0f\xe0\x13\x03\x01\x00\x40\x20\x2f\xe0\x0a\x03\x01\xc0\x7f\x20\x17"
    "\x00\x40",
    46);

TEST(MeshIo, CompressedPcdOfPclIsRead) {
  const TemporaryFolder folder;
  std::size_t left_out = 0;
  const Points points =
      load_point_cloud(folder.write("a.pcd", compressed_header + compressed_body), left_out);
  EXPECT_EQ(left_out, 1u);
  ASSERT_EQ(points.rows(), 7);
  EXPECT_EQ(points.row(3), Eigen::RowVector3d(0.25, 1, 2));
  EXPECT_EQ(points.row(6), Eigen::RowVector3d(0.5, 1, 2));
}

TEST(MeshIo, DamagedCompressedPcdIsAnErrorNotACrash) {
  const TemporaryFolder folder;
  std::mt19937 generator(1);
  for (int trial = 0; trial < 500; ++trial) {
    std::string damaged = compressed_body;
    damaged[generator() % damaged.size()] = static_cast<char>(generator());
    if (trial % 2 == 1) damaged.resize(generator() % damaged.size());
    const std::string path = folder.write("a.pcd", compressed_header + damaged);
    const std::string message = input_error_of([&] { load_point_cloud(path); });
    ASSERT_TRUE(message.empty() || message.starts_with(path)) << message;
  }
  for (const char* line : {"SIZE 4 4 4611686018427387904", "COUNT 1 1 4611686018427387904", "COUNT 1 0 1",
                           "POINTS 4611686018427387904"}) {
    std::string header = compressed_header;
    const std::size_t begin = header.find(std::string("\n") + std::string(line).substr(0, 5)) + 1;
    header.replace(begin, header.find('\n', begin) - begin, line);
    EXPECT_NE(input_error_of([&] { load_point_cloud(folder.write("a.pcd", header + compressed_body)); }), "")
        << line;
  }
}

TEST(MeshIo, BigEndianPlyIsRead) {
  const TemporaryFolder folder;
  const auto big = [](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    return std::string(bytes.rbegin(), bytes.rend());
  };
  std::string file =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty double x\nproperty float y\n"
      "property short z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (int v = 0; v < 3; ++v)
    file += big(v == 1 ? 0.1 : 0.0) + big(v == 2 ? 0.5f : 0.0f) + big(static_cast<std::int16_t>(258 * v));
  file += big(std::uint8_t{3}) + big(0) + big(1) + big(2);
  const TriangleMesh mesh = load_triangle_mesh(folder.write("a.ply", file));
  Points vertices(3, 3);
  vertices << 0, 0, 0, 0.1, 0, 258, 0, 0.5, 516;
  EXPECT_EQ(mesh.vertices, vertices);
  EXPECT_EQ(mesh.triangles.row(0), Eigen::RowVector3i(0, 1, 2));
}

// How an organised cloud marks the pixels that saw nothing depends on the driver, not on the format.
TEST(MeshIo, CloudsOfEveryFormatLeaveOutWhatIsNotFinite) {
  const TemporaryFolder folder;
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                   infinity = std::numeric_limits<double>::infinity();
  Points points(5, 3);
  points << 1, 2, 3, nan, nan, nan, 4, 5, 6, 7, nan, 9, 1, 2, infinity;
  for (const char* name : {"a.ply", "a.pcd"}) {
    SCOPED_TRACE(name);
    save_point_cloud(points, folder / name);
    std::size_t left_out = 0;
    const Points read = load_point_cloud(folder / name, left_out);
    EXPECT_EQ(left_out, 3u);
    ASSERT_EQ(read.rows(), 2);
    EXPECT_EQ(read.row(1), Eigen::RowVector3d(4, 5, 6));
  }
}

std::string ply(const std::string& body, int vertices, int faces) {
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(faces) +
         "\nproperty list uchar int vertex_indices\nend_header\n" + body;
}

TEST(MeshIo, BrokenMeshesAreNamed) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& name, const std::string& contents) {
    const std::string path = folder.write(name, contents);
    std::string text = input_error_of([&] { load_triangle_mesh(path); });
    return text.starts_with(path) ? text.substr(path.size()) : "no file in: " + text;
  };
  const std::string square = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  EXPECT_EQ(message("a.ply", ply("0 0 0\n1 nan 0\n1 inf 0\n3 0 1 2\n", 3, 1)),
            ": 2 of 3 points are not finite; first at index 1");
  EXPECT_EQ(message("a.ply", ply(square + "3 0 1 4\n", 4, 1)),
            ": triangle 0: found vertex index 4, expected 0 to 3");
  EXPECT_EQ(message("a.ply", ply(square + "3 0 1 -1\n", 4, 1)),
            ": triangle 0: found vertex index -1, expected 0 to 3");
  EXPECT_EQ(message("a.ply", ply(square + "3 0 1 2\n3 0 0 2\n", 4, 2)),
            ": triangle 1: is degenerate: vertices 0, 0, 2 lie on a line");
  EXPECT_EQ(message("a.ply", ply(square + "3 0 1 2\n3 2 0 1\n", 4, 2)), ": triangle 1: repeats triangle 0");
  EXPECT_EQ(message("a.ply", ply(square, 4, 0)), ": found no triangles");
  EXPECT_EQ(message("a.ply", ply(square, 5, 1)), ": ends before all elements of its header are read");
  EXPECT_EQ(message("a.ply", ply(square + "2 0 1\n", 4, 1)), ": face 0 has 2 corners, expected 3 or more");
  EXPECT_EQ(message("a.ply", "solid"), ": not a PLY file, expected \"ply\" on its first line");
  EXPECT_EQ(message("a.ply", "ply\nformat binary_middle_endian 1.0\n"),
            ": header line 2: found \"format binary_middle_endian 1.0\", expected format ascii, "
            "binary_little_endian or binary_big_endian");
  EXPECT_EQ(message("a.obj", "v 0 0 0\nv 1 0 x\n"), ": line 2: found \"x\", expected a coordinate");
  EXPECT_EQ(message("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n"),
            ": triangle 0: found vertex index 3, expected 0 to 2");
  EXPECT_EQ(message("a.obj", "f 1 2 3\n"), ": found no vertices, expected those that its elements name");
  EXPECT_EQ(message("a.obj", "v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n"),
            ": vertex 1: found a coordinate of 1e+300, expected at most 1e+12");
  EXPECT_EQ(message("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 99999999999\n"),
            ": line 4: found \"99999999999\", expected a vertex index from 1");
  EXPECT_EQ(message("a.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\n"),
            ": DATASET STRUCTURED_POINTS, expected POLYDATA or UNSTRUCTURED_GRID");
  EXPECT_EQ(message("a.fbx", ""),
            ": ending \".fbx\" is not known, expected .ply, .obj, .vtk, .stl, .pcd, .tet or .msh");
}

TEST(MeshIo, BrokenTetrahedraAreNamed) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& name, const std::string& contents) {
    const std::string path = folder.write(name, contents);
    std::string text = input_error_of([&] { load_tet_mesh(path); });
    return text.starts_with(path) ? text.substr(path.size()) : "no file in: " + text;
  };
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\n";
  EXPECT_EQ(message("a.tet", corners + "t 1 2 3 0\n"),
            ": line 6: found \"0\", expected a vertex index from 1");
  EXPECT_EQ(message("a.tet", corners + "t 1 2 3 6\n"),
            ": tetrahedron 0: found vertex index 5, expected 0 to 4");
  EXPECT_EQ(message("a.tet", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 -1e300\nt 1 2 3 4\n"),
            ": vertex 3: found a coordinate of 1e+300, expected at most 1e+12");
  EXPECT_EQ(message("a.tet", corners), ": found no tetrahedra");
  EXPECT_EQ(message("a.tet", corners + "t 1 2 3 4\n"), ": vertex 4: belongs to no tetrahedron");
  EXPECT_EQ(message("a.tet", corners + "v 0.5 0.5 0\nt 1 2 3 4\nt 1 2 3 6\n"),
            ": tetrahedron 1: is flat: vertices 0, 1, 2, 5 lie in a plane");
  // The second one was pushed through the face that it shares with the first.
  EXPECT_EQ(message("a.tet", corners + "v 0.1 0.1 0.1\nt 1 2 3 4\nt 2 3 4 6\nt 2 3 4 5\n"),
            ": tetrahedron 1: lies on the same side of the face of vertices 1, 2, 3 as tetrahedron 0: one of "
            "them is inverted, or they are the same");
}

TEST(MeshIo, TetrahedraCountFromOneInTetFiles) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a.tet", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nt 1 2 3 4\n");
  EXPECT_EQ(load_tet_mesh(path).tetrahedra.row(0), Eigen::RowVector4i(0, 1, 2, 3));
}

TEST(MeshIo, TetrahedraThatAreInsideOutAreNamedUnlessAFileHasThem) {
  TetMesh mesh = tet_box({0.3, 0.2, 0.1}, {3, 2, 1});
  std::swap(mesh.tetrahedra(7, 0), mesh.tetrahedra(7, 1));
  EXPECT_NE(input_error_of([&] { check_tet_mesh(mesh, "mesh"); }).find("tetrahedron 7: is inverted"),
            std::string::npos);
}

// Found by the fuzzer: the types of a grid in a file of polygons, fewer than it has of these.
TEST(MeshIo, VtkPolygonsHaveNoCellTypes) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = delaunay_rectangle(0.3, 0.2, 0.1, 3);
  save_triangle_mesh(mesh, folder / "a.vtk");
  const std::string path = folder.write("b.vtk", read_file(folder / "a.vtk") + "CELL_TYPES 1\n10\n");
  EXPECT_EQ(load_triangle_mesh(path).triangles, mesh.triangles);
}

TEST(MeshIo, TruncatedBinaryFilesAreErrorsNotCrashes) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = parse_mesh_spec("sheet:0.1x0.1:0.05");
  for (const char* name : {"a.ply", "a.vtk", "a.obj"}) {
    save_triangle_mesh(mesh, folder / name);
    std::ifstream stream(folder / name, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    for (std::size_t size = 0; size < bytes.size(); size += 7) {
      const std::string path = folder.write(std::string("cut_") + name, bytes.substr(0, size));
      try {
        load_triangle_mesh(path);  // a text file may be cut where it still makes sense
      } catch (const InputError&) {
      }
    }
  }
}

TEST(MeshIo, DamagedFilesAreErrorsNotCrashes) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = parse_mesh_spec("sheet:0.1x0.1:0.05");
  std::mt19937 generator(1);
  for (const char* name : {"a.ply", "a.vtk", "a.obj", "a.pcd"}) {
    if (lower_extension(name) == ".pcd")
      save_point_cloud(mesh.vertices, folder / name);
    else
      save_triangle_mesh(mesh, folder / name);
    std::ifstream stream(folder / name, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    for (int trial = 0; trial < 300; ++trial) {
      std::string damaged = bytes;
      for (int k = 0; k < 3; ++k) damaged[generator() % damaged.size()] = static_cast<char>(generator());
      const std::string path = folder.write(std::string("damaged_") + name, damaged);
      try {
        load_geometry(path);
      } catch (const InputError& error) {
        ASSERT_NE(std::string(error.what()).find(path), std::string::npos);
      }
    }
  }
}

TEST(MeshIo, ReadsTheSiliconeParts) {
  const std::string folder = std::string(FLASH_SHARED_DIR) + "/data/silicone/";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is absent";
  for (const char* part : {"h_e_c", "h_m_c"}) {
    const TetMesh rest = load_tet_mesh(folder + part + "_rest.vtk");
    EXPECT_EQ(rest.vertices.rows(), 534);
    EXPECT_EQ(rest.tetrahedra.rows(), 1750);
    EXPECT_GT(load_point_cloud(folder + part + "_cloud.ply").rows(), 10000);
  }
}

}  // namespace
}  // namespace flash::data
