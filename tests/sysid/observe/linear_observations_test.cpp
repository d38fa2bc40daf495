#include "sysid/observe/linear_observations.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

using Term = LinearObservations::Term;

/// A sheet in motion, seen in every way about its surface.
struct SeenSheet {
  Replay replay;
  Motion motion;
  explicit SeenSheet(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> even(-1, 1);
    const auto jitter = [&](double size) {
      return Eigen::RowVector3d(size * even(random), size * even(random), size * even(random));
    };
    data::TriangleMesh& mesh = replay.surface;
    mesh = flat_sheet(6);
    replay.pivot = Eigen::Vector3d(0.1, 0.2, 0);
    motion = moving_sheet_motion(mesh, 0.05, 12);
    for (int i = 0; i < 12; ++i)
      motion.forces.emplace_back(0.1 * Eigen::Vector3d(even(random), even(random), even(random)));
    for (int k = 0; k < 5; ++k) {
      Observation observation{.t = 0.03 + 0.11 * k};
      data::Points positions;
      surface_at(motion, observation.t, positions);
      observation.points.resize(150, 3);
      observation.contour.resize(30, 3);
      observation.markers.resize(4, 3);
      for (data::Points* points : {&observation.points, &observation.contour, &observation.markers})
        for (Eigen::Index i = 0; i < points->rows(); ++i)
          points->row(i) = positions.row(static_cast<Eigen::Index>(random() % 49)) + jitter(0.02);
      for (int i = 0; i < 4; ++i) {
        Mark mark;
        mark.triangle = static_cast<int>(random() % static_cast<unsigned>(mesh.triangles.rows()));
        mark.barycentric = {0.2, 0.3, 0.5};
        observation.marks.push_back(mark);
      }
      observation.force = Eigen::Vector3d(0.3, -0.2, 0.1);
      replay.observations.push_back(std::move(observation));
    }
    replay.observations[2].weight = 0;  // dropped
  }
};

// What the full observations of a motion say is what the cheap look at it has to find.
TEST(LinearObservations, DistancesOnAnotherMotionAreThoseOfItsOwnRows) {
  const SeenSheet seen(3);
  const Objective objective;
  const Registration here{{0.001, 0, 0.002}, 0.01, 0.004, seen.replay.pivot, seen.replay.up},
      there{{-0.004, 0.003, 0.001}, -0.03, -0.02, seen.replay.pivot, seen.replay.up};
  const LinearObservations places(seen.replay, seen.motion, here, objective, {}, nullptr, 60);
  Motion other = seen.motion;
  for (data::Points& positions : other.positions)
    for (Eigen::Index i = 0; i < positions.rows(); ++i)
      positions(i, 2) += 0.01 * std::sin(20 * positions(i, 0)) * positions(i, 1);
  SheetShifts shifts(seen.replay.observations.size());
  for (SheetShift& shift : shifts) {
    shift.positions = data::Points::Constant(other.positions[0].rows(), 3, 0.002);
    shift.force = Eigen::Vector3d(0.01, 0.02, 0.03);
  }
  SheetDistance sheet = sheet_of(seen.replay);
  for (const SheetShifts& each : {SheetShifts(), shifts}) {
    // Looked for first in the same triangles: a point that is nearest to an edge has two normals.
    const LinearObservations anew(seen.replay, other, there, objective, each, &places, 60);
    std::vector<int> triangles;
    const Eigen::VectorXd distances = places.distances(seen.replay, other, there, each, sheet, triangles);
    ASSERT_EQ(distances.size(), anew.rows());
    std::array<int, 4> terms = {};
    for (Eigen::Index i = 0; i < distances.size(); ++i) {
      EXPECT_DOUBLE_EQ(distances[i], anew.row(i).distance) << "row " << i;
      ++terms[static_cast<std::size_t>(anew.row(i).term)];
    }
    EXPECT_EQ(terms, (std::array{4 * 60, 4 * 30, 4 * 4 * 3, 4 * 3}));
  }
}

TEST(LinearObservations, AreTheSameOnAnyThreads) {
  SeenSheet seen(5);
  const Registration registration{{0.001, 0, 0.002}, 0.01, 0.004, seen.replay.pivot, seen.replay.up};
  const LinearObservations one(seen.replay, seen.motion, registration, {});
  seen.replay.settings.threads = 4;
  const LinearObservations four(seen.replay, seen.motion, registration, {}),
      again(seen.replay, seen.motion, registration, {}, {}, &one);
  EXPECT_EQ(one.rows_of_keyframes(), four.rows_of_keyframes());
  for (const LinearObservations* const other : {&four, &again}) {
    EXPECT_EQ(one.residuals(), other->residuals());
    EXPECT_EQ(one.registration_derivatives(), other->registration_derivatives());
  }
}

// A flat sheet at rest and points 3 mm above it: 3 mm, and 5 mm where the sheet is shifted down by 2 mm.
TEST(LinearObservations, DistancesAreSignedAlongTheNormal) {
  Replay replay;
  replay.surface = flat_sheet(4);
  Observation observation{.t = 0};
  observation.points = replay.surface.vertices.middleRows(6, 3);
  observation.points.col(2).array() += 0.003;
  replay.observations = {observation};
  const Motion motion{0, 0.1, {replay.surface.vertices, replay.surface.vertices}};
  const LinearObservations places(replay, motion, {}, {});
  SheetDistance sheet = sheet_of(replay);
  std::vector<int> triangles;
  SheetShifts down(1);
  down[0].positions = data::Points::Zero(replay.surface.vertices.rows(), 3);
  down[0].positions.col(2).setConstant(-0.002);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::VectorXd own = places.distances(replay, motion, {}, {}, sheet, triangles),
                          moved = places.distances(replay, motion, {}, down, sheet, triangles);
    EXPECT_NEAR(std::abs(own[i]), 0.003, 1e-15);
    EXPECT_NEAR(moved[i], own[i] / 0.003 * 0.005, 1e-15);
  }
}

}  // namespace
}  // namespace flash::sysid
