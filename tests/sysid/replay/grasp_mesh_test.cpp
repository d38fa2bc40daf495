#include "sysid/replay/grasp_mesh.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "data/meshing/remesh.h"
#include "sysid/capture/synth.h"
#include "sysid/replay/half_cell.h"
#include "sysid/replay/recorded_grasp.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

constexpr const char* kTowel = "sheet:0.2x0.2:0.02";

/// A towel held by a patch at its corner.
data::Recording towel(const std::string& mesh = kTowel) {
  data::Recording recording;
  recording.source = "towel";
  recording.mesh_spec = mesh;
  recording.mesh = data::parse_mesh_spec(mesh);
  recording.start = recording.mesh.vertices;
  data::RecordedGrasp grasp;
  grasp.gripper = "gripper";
  grasp.from = 0;
  grasp.select.corner = {1, 1};
  grasp.select.within = 0.02;
  recording.grasps = {grasp};
  recording.trajectories["gripper"] = {{0.0, 1.0},
                                       {Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()}};
  return recording;
}

/// Area of the triangles that the grasp holds by all their corners [m^2].
double held_area(const data::Recording& recording) {
  std::vector<bool> held(std::size_t(recording.mesh.vertices.rows()), false);
  for (const int vertex : data::select_vertices(recording, recording.grasps[0]))
    held[std::size_t(vertex)] = true;
  double area = 0;
  for (const auto& t : recording.mesh.triangles.rowwise()) {
    const Eigen::Vector3d a = recording.mesh.vertices.row(t[0]), b = recording.mesh.vertices.row(t[1]),
                          c = recording.mesh.vertices.row(t[2]);
    if (held[std::size_t(t[0])] && held[std::size_t(t[1])] && held[std::size_t(t[2])])
      area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

// A vertex within a twentieth of an edge of the outline counts as on it: so much may be missing of a cell.
constexpr double kSliver = 0.05 * 0.004 * 0.004 / 2;

TEST(GraspMesh, HoldsThePatchItselfWhateverTheCells) {
  for (const char* mesh : {"sheet:0.2x0.2:0.04", "sheet:0.2x0.2:0.028", kTowel, "sheet:0.2x0.2:0.007"}) {
    data::Recording recording = towel(mesh);
    grade_towards_grasps({}, recording);
    EXPECT_NEAR(held_area(recording), 0.02 * 0.02, kSliver) << mesh;
  }
}

// Of any size, on any cells: those that shrink towards the grasp, those of a pattern, and those of a file.
TEST(GraspMesh, AFinerMeshHoldsTheSamePatch) {
  for (const double within : {0.017, 0.02, 0.033})
    for (const char* cell : {"0.02", "0.01", "0.005"})
      for (const char* pattern : {"", ":alternating", ":one_way", ":alternating_by_row", "file"}) {
        const bool file = std::string(pattern) == "file";
        data::Recording recording = towel("sheet:0.2x0.2:" + std::string(cell) + (file ? "" : pattern));
        if (file) recording.mesh_spec = "towel.obj";
        ReplaySettings settings;
        settings.grasp_within = within;
        recording.grasps[0].select.within = within;  // as held_area looks for it
        grade_towards_grasps(settings, recording);
        EXPECT_NEAR(held_area(recording), within * within, kSliver)
            << within << ' ' << cell << ' ' << pattern;
        EXPECT_EQ(recording.start, recording.mesh.vertices);
        EXPECT_EQ(recording.mesh.vertices.col(0).maxCoeff(), 0.2);
        for (const auto& t : recording.mesh.triangles.rowwise()) {
          const Eigen::Vector3d a = recording.mesh.vertices.row(t[1]) - recording.mesh.vertices.row(t[0]),
                                b = recording.mesh.vertices.row(t[2]) - recording.mesh.vertices.row(t[0]);
          EXPECT_GT(a.cross(b).z(), 0);
        }
      }
}

TEST(GraspMesh, RowsOfTwoPatchesDoNotMoveEachOther) {
  data::Recording recording = towel("sheet:0.2x0.2:0.02:alternating");
  recording.grasps.push_back(recording.grasps[0]);
  recording.grasps[0].select.within = recording.grasps[1].select.within = 0.027;
  recording.grasps[1].select.corner = {0, 1};
  grade_towards_grasps({}, recording);
  EXPECT_NEAR(held_area(recording), 0.027 * 0.027, 1e-12);
  std::swap(recording.grasps[0], recording.grasps[1]);
  EXPECT_NEAR(held_area(recording), 0.027 * 0.027, 1e-12);
}

TEST(GraspMesh, ABoxAcrossTheSheetHasNoCornersAndAPartOfItsEdgeHas) {
  data::Recording recording = towel("sheet:0.2x0.2:0.02:alternating");
  data::Selection& select = recording.grasps[0].select;
  const auto hold = [&](double from, double to) {  // the vertices of the edge x = 0.2 between
    select = {};
    for (Eigen::Index i = 0; i < recording.mesh.vertices.rows(); ++i)
      if (const auto v = recording.mesh.vertices.row(i); v.x() > 0.199 && v.y() > from && v.y() < to)
        select.vertices.push_back(static_cast<int>(i));
  };
  const double cell = data::edge_lengths(recording.mesh).mean;
  hold(-1, 1);
  const data::Outline whole = grasp_outlines(recording, {})[0];
  EXPECT_TRUE(whole.corners.empty());
  EXPECT_NEAR(whole.near, cell / 2, 1e-12);
  hold(0.07, 0.13);
  const data::Outline part = grasp_outlines(recording, {})[0];
  ASSERT_EQ(part.corners.size(), 2u);
  EXPECT_NEAR((part.corners[1] - part.corners[0]).norm(), 0.04, 1e-12);
  EXPECT_NEAR(part.near, cell / 5, 1e-12);
}

TEST(GraspMesh, APatternIsKeptWhereItIsNamedAndNoCellIsAskedFor) {
  const std::string named = std::string(kTowel) + ":alternating";
  data::Recording recording = towel(named);
  const data::Points even = recording.mesh.vertices;
  grade_towards_grasps({}, recording);
  EXPECT_EQ(recording.mesh.vertices, even);
  ReplaySettings settings;
  settings.grasp_cell = 0.004;
  grade_towards_grasps(settings, recording);
  EXPECT_GT(recording.mesh.vertices.rows(), even.rows());
  EXPECT_NEAR(held_area(recording), 0.02 * 0.02, kSliver);
  settings.grasp_cell = 0;
  recording = towel(named);
  grade_towards_grasps(settings, recording);
  EXPECT_EQ(recording.mesh.vertices, even);
}

// Vertices of a file keep their numbers, which marks, starts and selections go by.
TEST(GraspMesh, OfAFileIsRefinedAboutTheGrasp) {
  data::Recording recording = towel(std::string(kTowel) + ":one_way");
  recording.mesh_spec = "towel.obj";
  const data::Points was = recording.mesh.vertices;
  grade_towards_grasps({}, recording);
  EXPECT_GT(recording.mesh.vertices.rows(), was.rows());
  EXPECT_NEAR(held_area(recording), 0.02 * 0.02, kSliver);
  Eigen::Index moved = 0;
  for (Eigen::Index i = 0; i < was.rows(); ++i)
    moved += (recording.mesh.vertices.row(i) - was.row(i)).norm() > 0;
  EXPECT_LE(moved, 8);  // those that slid onto the outline of one cell
  EXPECT_EQ(recording.start, recording.mesh.vertices);
}

// What a named vertex is: those on the edge between two of them are held too.
TEST(GraspMesh, VerticesBetweenThoseSelectedAreSelectedToo) {
  data::Recording recording = towel(std::string(kTowel) + ":one_way");
  recording.mesh_spec = "towel.obj";
  recording.grasps[0].select = {};
  for (int i = 0; i < recording.mesh.vertices.rows(); ++i)
    if (recording.mesh.vertices(i, 0) == 0) recording.grasps[0].select.vertices.push_back(i);
  const std::size_t was = recording.grasps[0].select.vertices.size();
  grade_towards_grasps({}, recording);
  EXPECT_GT(recording.grasps[0].select.vertices.size(), was);
  for (const int vertex : recording.grasps[0].select.vertices)
    EXPECT_EQ(recording.mesh.vertices(vertex, 0), 0);
  Eigen::Index on_edge = 0;
  for (const auto& x : recording.mesh.vertices.rowwise()) on_edge += x[0] == 0;
  EXPECT_EQ(std::size_t(on_edge), recording.grasps[0].select.vertices.size());
}

TEST(GraspMesh, ASizeMovesTheOutlineAndLeavesTheSheet) {
  data::Recording recording = towel();
  grade_towards_grasps({}, recording);
  const data::Recording was = recording;
  for (const double size : {0.014, 0.017, 0.023, 0.03}) {
    recording = was;
    ReplaySettings settings;
    resize_grasps(size, settings, recording);
    EXPECT_NEAR(held_area(recording), size * size, 1e-10);
    EXPECT_EQ(recording.mesh.triangles, was.mesh.triangles);
    EXPECT_EQ(data::select_vertices(recording, recording.grasps[0]),
              data::select_vertices(was, was.grasps[0]));
    // Away from the grasp nothing moves.
    for (Eigen::Index i = 0; i < was.mesh.vertices.rows(); ++i)
      if ((was.mesh.vertices.row(i).head<2>().array() < 0.2 - 3 * std::max(size, 0.02)).all()) {
        EXPECT_LT((recording.mesh.vertices.row(i) - was.mesh.vertices.row(i)).norm(), 1e-15);
      }
    for (const auto& t : recording.mesh.triangles.rowwise()) {
      const Eigen::Vector3d a = recording.mesh.vertices.row(t[1]) - recording.mesh.vertices.row(t[0]),
                            b = recording.mesh.vertices.row(t[2]) - recording.mesh.vertices.row(t[0]);
      EXPECT_GT(a.cross(b).z(), 0);
    }
  }
}

TEST(GraspMesh, TheMiddleOfAPatchIsThatOfTheSquare) {
  for (const char* mesh : {"sheet:0.2x0.2:0.04", "sheet:0.2x0.2:0.028", kTowel}) {
    const data::Recording recording = towel(mesh);
    EXPECT_LT((patch_middle(recording, recording.grasps[0]) - Eigen::RowVector3d(0.19, 0.19, 0)).norm(),
              1e-15);
  }
}

SynthSettings slow_lift(double duration) {
  SynthSettings settings;
  settings.name = "lift";
  settings.displacement = Eigen::Vector3d(-0.02, -0.02, 0.05);
  settings.duration = duration;
  settings.keyframe_rate = 5;
  settings.grasp_within = 0.02;
  settings.cameras = {small_camera({0.1, -0.3, 0.3}, {0.1, 0.1, 0.02})};
  return settings;
}

/// The towel lifted for 0.6 s under other settings: its last positions, of the first `vertices`.
data::Points lifted(
    const data::Recording& recording, const ReplaySettings& settings, const ReplayNuisance& nuisance,
    const std::function<Replay(const Replay&)>& on = [](const Replay& replay) { return replay; }) {
  data::SheetMaterial material;
  material.membrane_stiffness = 100;
  material.bending_rigidity = 2e-4;
  const Replay replay = on(make_replay(recording, settings));
  data::Points last;
  run(replay, {{material, nuisance}}, {replay.steps},
      [&](std::size_t, const ReplayResult& result) { last = result.motion.positions.back(); });
  return last;
}

/// A recording of a lift, back from its files.
data::Recording recorded_lift(const data::TemporaryFolder& folder) {
  SynthRecording made =
      synthesize(data::parse_mesh_spec(kTowel), kTowel, short_lift_material(), slow_lift(0.6), {});
  save_synthetic(made, folder / "lift");
  return data::load_recording(folder / "lift");
}

// A clamp with pads that do not give way, and a point with such that do at once, are the ends of one scale.
TEST(GraspMesh, PadsLeadFromAPointToAClamp) {
  const data::TemporaryFolder folder;
  const data::Recording recording = recorded_lift(folder);
  ReplayNuisance rigid, hard, soft;
  hard.grasp_stiffness = 5e11;
  soft.grasp_stiffness = 1;
  const data::Points clamp = lifted(recording, {}, rigid);
  // The foundation gives way by 1 mm x (1e9 / k)^(1/4): at 1e13 a tenth of that. Of 50 mm the sheet moves by
  // as much as a patch smaller by that would make it.
  EXPECT_LT((lifted(recording, {}, hard) - clamp).rowwise().norm().maxCoeff(), 3e-4);
  ReplaySettings point;
  point.grasp_shape = data::GraspShape::point;
  point.grasp_cell = 0.004;
  // On the mesh of the clamp the vertex at the corner is held alone: as a point on the same cells.
  ReplaySettings as_clamp = point;
  as_clamp.grasp_shape = data::GraspShape::clamp;
  const data::Points of_soft = lifted(recording, as_clamp, soft);
  const data::Points of_point = lifted(recording, as_clamp, {}, [&](const Replay& replay) {
    ReplaySettings settings = replay.settings;
    settings.grasp_shape = data::GraspShape::point;
    return on_mesh(replay, replay.recording, settings);
  });
  // Springs of 1 N/m^3 x 4 cm^2 pull 5 cm by 2e-5 N, a hundred thousandth of the weight times the way.
  EXPECT_LT((of_soft - of_point).rowwise().norm().maxCoeff(), 1e-3);
  EXPECT_GT((of_soft - clamp).rowwise().norm().maxCoeff(), 5e-3);
}

// As the size of the patch itself: the motion between two sizes is half way, to second order.
TEST(GraspMesh, MotionsAreSmoothInTheSize) {
  const data::TemporaryFolder folder;
  const data::Recording recording = recorded_lift(folder);
  const auto of_size = [&](double size) {
    ReplayNuisance nuisance;
    nuisance.grasp_size = size;
    return lifted(recording, {}, nuisance);
  };
  const data::Points low = of_size(0.0195), middle = of_size(0.02), high = of_size(0.0205);
  // The same places up to rounding, which steps that are solved to a thousandth of the weight pass on.
  EXPECT_LT((middle - lifted(recording, {}, {})).rowwise().norm().maxCoeff(), 1e-6);
  const double slope = (high - low).rowwise().norm().maxCoeff(),
               bend = (high - 2 * middle + low).rowwise().norm().maxCoeff();
  EXPECT_GT(slope, 2e-4);
  EXPECT_LT(bend, 0.2 * slope);
}

// Cells of which each has a half or a quarter of the one before at the grasp: motions draw nearer each time.
TEST(GraspMesh, MotionsConvergeAsCellsAtTheGraspShrink) {
  const data::TemporaryFolder folder;
  const data::Recording recording = recorded_lift(folder);
  const auto with_part = [&](double part) {
    return lifted(recording, {}, {}, [&](const Replay& replay) {
      data::Recording finer = replay.recording;
      if (part < 1) refine_grasps(replay.settings, part, finer);
      return on_mesh(replay, std::move(finer), replay.settings);
    });
  };
  const data::Points cells = with_part(1), halves = with_part(0.5), quarters = with_part(0.25);
  const Eigen::Index n = cells.rows();
  const double first = (halves.topRows(n) - cells).norm(),
               second = (quarters.topRows(n) - halves.topRows(n)).norm();
  EXPECT_LT(second, 0.75 * first);
}

}  // namespace
}  // namespace flash::sysid
