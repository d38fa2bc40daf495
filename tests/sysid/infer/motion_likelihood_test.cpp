#include "sysid/infer/motion_likelihood.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sysid/emulate/two_mesh_motions.h"
#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

/// A cloth seen without noise in ten keyframes; `bulge`: how far its middle stands out [m].
struct Cloth {
  Replay replay;
  explicit Cloth(int cells) {
    data::TriangleMesh& mesh = replay.surface;
    mesh = flat_sheet(cells);
    replay.queries = std::make_shared<const SheetDistance>(mesh.triangles, mesh.vertices);
    for (int k = 0; k < 10; ++k) {
      Observation observation;
      observation.t = 0.1 * k;
      observation.weight = 1;
      replay.observations.push_back(observation);
    }
  }
  /// Bulge that grows and wanders, far from straight in its size: it turns as it grows.
  Motion bulged(double size) const {
    Motion motion = moving_sheet_motion(replay.surface, 0.1, 10);
    for (data::Points& positions : motion.positions)
      for (Eigen::Index i = 0; i < positions.rows(); ++i) {
        const Eigen::RowVector3d rest = replay.surface.vertices.row(i);
        const double there = std::exp(-20 * (rest.head<2>() - Eigen::RowVector2d(0.25, 0.2)).squaredNorm());
        positions.row(i) += size * there * Eigen::RowVector3d(0.6, 0.2, 0.8);
      }
    return motion;
  }
  void see(const Motion& motion) {
    for (Observation& observation : replay.observations) {
      data::Points positions;
      surface_at(motion, observation.t, positions);
      const data::Triangles& triangles = replay.surface.triangles;
      observation.points.resize(triangles.rows(), 3);
      for (Eigen::Index i = 0; i < triangles.rows(); ++i)
        observation.points.row(i) = (positions.row(triangles(i, 0)) + positions.row(triangles(i, 1)) +
                                     positions.row(triangles(i, 2))) /
                                    3;
    }
  }
};

std::vector<ReplayResult> result_of(Motion motion) {
  ReplayResult result;
  result.motion = std::move(motion);
  result.finite = result.converged = true;
  return {result};
}

MotionChange from_to(const Cloth& from, const Motion& a, const Cloth& to, const Motion& b) {
  return {{-1, std::make_shared<const Motions>(Motions{{from.replay}, result_of(a)})},
          {1, std::make_shared<const Motions>(Motions{{to.replay}, result_of(b)})}};
}

TEST(MotionChange, IsThatOfEachVertexWhateverTheMeshItWasSimulatedOn) {
  const Cloth coarse(8), fine(16);
  const SheetShifts own =
                        shifts_of(from_to(fine, fine.bulged(0), fine, fine.bulged(0.01)), 0, fine.replay, 0),
                    other = shifts_of(from_to(fine, fine.bulged(0), fine, fine.bulged(0.01)), 0,
                                      coarse.replay, 0);
  const Eigen::SparseMatrix<double> to_fine = prolongation(coarse.replay.surface, fine.replay.surface);
  ASSERT_EQ(other.size(), 10u);
  // Linear interpolation of a bulge that bends by 40 / m^2 of its size over cells of 50 mm.
  for (const std::size_t k : {0, 4, 9})
    EXPECT_LT((to_fine * other[k].positions - own[k].positions).cwiseAbs().maxCoeff(),
              0.05 * 0.05 / 8 * 80 * 0.01);
}

// To first order the sheet would have to be moved along the normals that it has without the error. A bulge of
// centimetres turns them: what is left then would be taken for an error of the model.
TEST(MotionLikelihood, AnErrorOfKnownShapeIsTakenOutHoweverLarge) {
  Cloth cloth(12);
  cloth.see(cloth.bulged(0.03));
  const KnownError bulge{from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.02))};
  ScoreSettings settings;
  settings.objective.robust.kind = RobustKind::plain;
  const MotionLikelihood likelihood({cloth.replay}, result_of(cloth.bulged(0)), settings, {}, {bulge}, {});
  const Misfit misfit = likelihood.of_recording(0).misfit();
  EXPECT_LT(misfit.noise, 1e-4);  // of a bulge that moves points by up to 30 mm
  EXPECT_LT(misfit.size, 1e-4);
  // One and a half standard deviations are to be paid for, and next to nothing of them is left open.
  EXPECT_NEAR(likelihood.deviance({cloth.bulged(0)}), 1.5 * 1.5, 0.1);
  EXPECT_LT(likelihood.spread_of(0), 0.01);
}

// A sheet that moves at a known speed everywhere tells its clock as a mean of its rows tells a height.
TEST(MotionLikelihood, TellsItsClockAsItsSpeedAndNoiseDo) {
  constexpr double kSpeed = 0.1, kNoise = 5e-4;  // of all points, along the normal [m/s, m]
  Cloth cloth(12);
  Motion rising{.start = -0.1, .step = 0.1, .positions = {}};
  for (int k = 0; k < 12; ++k) {
    rising.positions.push_back(cloth.replay.surface.vertices);
    rising.positions.back().col(2).array() += kSpeed * (rising.start + k * rising.step);
  }
  cloth.see(rising);
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, kNoise);
  for (Observation& observation : cloth.replay.observations)
    for (Eigen::Index i = 0; i < observation.points.rows(); ++i) observation.points(i, 2) += normal(random);
  cloth.replay.recording.nuisance.offset.setZero();
  cloth.replay.recording.nuisance.yaw = 0;
  ScoreSettings settings;
  settings.objective.robust.kind = RobustKind::plain;
  const auto with_bound = [&](double bound) {
    cloth.replay.recording.nuisance.time = bound;
    return MotionLikelihood({cloth.replay}, result_of(rising), settings, {}, {}, {});
  };
  // A mean of as many rows as it takes; what two thousand of them say of their noise is known to 2 %.
  const MotionLikelihood likelihood = with_bound(0.05);
  const double rows = static_cast<double>(likelihood.of_recording(0).rows());
  const double expected = kNoise / (kSpeed * std::sqrt(rows));
  EXPECT_NEAR(likelihood.registration_spread(0)[4], expected, 0.06 * expected);
  EXPECT_EQ(likelihood.registration_spread(0)[0], 0);
  // What a bound leaves is told by the bound alone.
  EXPECT_NEAR(with_bound(1e-6).registration_spread(0)[4], 1e-6 / std::sqrt(3), 1e-9);
}

TEST(MotionLikelihood, IsTheSameOnAnyThreads) {
  Cloth cloth(12);
  cloth.see(cloth.bulged(0.03));
  KnownError bulge{from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.02))};
  bulge.bend = from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.01));
  KnownError correction{from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.001)), true, true};
  const auto deviance = [&](int threads) {
    cloth.replay.settings.threads = threads;
    const MotionLikelihood likelihood({cloth.replay}, result_of(cloth.bulged(0)), {}, {}, {bulge, correction},
                                      {from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.005))});
    return likelihood.deviance({cloth.bulged(0.01)});
  };
  EXPECT_EQ(deviance(1), deviance(4));
}

TEST(MotionLikelihood, AnErrorThatBendsIsFollowedAlongItsCurve) {
  Cloth cloth(12);
  cloth.see(cloth.bulged(0.03 + 0.02));
  // 0.02 u + 0.01 u^2 is 0.05 at u = 1.449.
  KnownError bulge{from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.02))};
  bulge.bend = from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.01));
  ScoreSettings settings;
  settings.objective.robust.kind = RobustKind::plain;
  const MotionLikelihood likelihood({cloth.replay}, result_of(cloth.bulged(0)), settings, {}, {bulge}, {});
  EXPECT_NEAR(likelihood.deviance({cloth.bulged(0)}), 1.449 * 1.449, 0.1);
}

// Where the curve turns, at u = -1, a step of Gauss and Newton is ten times too long and more.
TEST(MotionLikelihood, WhatIsFittedIsFoundFromWhereAStepIsFarTooLong) {
  Cloth cloth(12);
  cloth.see(cloth.bulged(0.03 + 0.02));
  KnownError bulge{from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.02))};
  bulge.bend = from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.01));
  ScoreSettings settings;
  settings.objective.robust.kind = RobustKind::plain;
  const Motion flat = cloth.bulged(0);
  const MotionLikelihood likelihood({cloth.replay}, result_of(flat), settings, {}, {bulge}, {});
  for (const double start : {-0.9, -0.8, 0.0, 8.0}) {
    std::vector<MotionLikelihood::Nuisance> fitted(1);
    fitted[0].registration.setZero();
    fitted[0].errors = Eigen::VectorXd::Constant(1, start);
    const double deviance =
        likelihood.deviance([&](std::size_t, double) -> const Motion& { return flat; }, fitted);
    EXPECT_NEAR(deviance, 1.449 * 1.449, 0.1) << start;
    EXPECT_NEAR(fitted[0].errors[0], 1.449, 0.02) << start;
  }
}

TEST(MotionLikelihood, ARegistrationEndsWithinItsBoundsWhereverItBegins) {
  Cloth cloth(12);
  Motion risen = cloth.bulged(0.03);
  for (data::Points& positions : risen.positions) positions.col(2).array() += 0.004;
  cloth.see(risen);
  cloth.replay.recording.nuisance.offset << 0, 0, 0.002;
  ScoreSettings settings;
  settings.objective.robust.kind = RobustKind::plain;
  const Motion motion = cloth.bulged(0.03);
  const MotionLikelihood likelihood({cloth.replay}, result_of(motion), settings, {}, {}, {});
  double within = 0;
  for (const double start : {0.0, 0.004, 0.02}) {
    std::vector<MotionLikelihood::Nuisance> fitted(1);
    fitted[0].registration << 0, 0, start, 0, 0;
    fitted[0].errors.resize(0);
    const double deviance =
        likelihood.deviance([&](std::size_t, double) -> const Motion& { return motion; }, fitted);
    EXPECT_LE(std::abs(fitted[0].registration[2]), 0.002 * (1 + 1e-12)) << start;
    if (start == 0) within = deviance;
    EXPECT_NEAR(deviance, within, 1e-3 * within) << start;
  }
}

TEST(MotionLikelihood, WhatIsCorrectedIsTakenForGranted) {
  Cloth cloth(12);
  cloth.see(cloth.bulged(0.02));
  KnownError bulge{from_to(cloth, cloth.bulged(0), cloth, cloth.bulged(0.02))};
  bulge.corrects = true;
  ScoreSettings settings;
  settings.objective.robust.kind = RobustKind::plain;
  const MotionLikelihood likelihood({cloth.replay}, result_of(cloth.bulged(0)), settings, {}, {bulge}, {});
  EXPECT_NEAR(likelihood.deviance({cloth.bulged(0)}), 0, 0.01);
  EXPECT_NEAR(likelihood.deviance({cloth.bulged(0.02)}), 1, 0.1);  // moved twice
}

// A motion may come without the steps that no keyframe reads at the clock that is tried, and with more of
// them as the clock moves; where a step is missing after all, that is told.
TEST(MotionLikelihood, ReadsTheStepsAtItsClockAndTellsWhereItLacksOne) {
  Cloth cloth(12);
  cloth.replay.recording.nuisance.time = 0.3;
  Motion motion = moving_sheet_motion(cloth.replay.surface, 0.02, 60);
  cloth.see(motion);
  ScoreSettings settings;
  const MotionLikelihood likelihood({cloth.replay}, result_of(motion), settings, {}, {}, {});
  // The same motion a tenth of a second later: the clock that fits it is five steps away.
  Motion late = motion;
  for (std::size_t i = 60; i >= 5; --i) late.positions[i] = motion.positions[i - 5];
  for (const Motion& whole : {motion, late}) {
    Motion some = whole;
    const auto with_what_is_read = [&](std::size_t, double time_offset) -> const Motion& {
      for (data::Points& positions : some.positions) positions.resize(0, 3);
      for (const Observation& observation : cloth.replay.observations) {
        const double at = (observation.t + time_offset) / 0.02;
        for (const double step : {std::floor(at), std::ceil(at)})
          if (step >= 0 && step <= 60)
            some.positions[static_cast<std::size_t>(step)] = whole.positions[static_cast<std::size_t>(step)];
      }
      some.positions.front() = whole.positions.front();
      return some;
    };
    EXPECT_TRUE(std::isfinite(likelihood.deviance({whole})));
    EXPECT_EQ(likelihood.deviance(with_what_is_read), likelihood.deviance({whole}));
  }
  late.positions[15].resize(0, 3);
  EXPECT_TRUE(std::isnan(likelihood.deviance({late})));
}

}  // namespace
}  // namespace flash::sysid
