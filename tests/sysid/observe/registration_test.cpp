#include "sysid/observe/registration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

/// Points seen on the true surface through a known registration.
std::vector<Observation> observe(const data::TriangleMesh& mesh, const Registration& truth, double noise,
                                 double outliers, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal(0, 1);
  std::vector<Observation> observations;
  const Eigen::Isometry3d observed_from_simulated = truth.observed_from_simulated();
  for (const double t : {0.30, 0.43, 0.58, 0.71, 0.85}) {
    const data::Points surface = moving_sheet(mesh.vertices, t + truth.time_offset);
    Observation observation{.t = t, .points = data::Points(900, 3)};
    for (Eigen::Index i = 0; i < observation.points.rows(); ++i) {
      const auto triangle =
          mesh.triangles.row(static_cast<Eigen::Index>(uniform(random) * mesh.triangles.rows()));
      double a = uniform(random), b = uniform(random);
      if (a + b > 1) {
        a = 1 - a;
        b = 1 - b;
      }
      const Eigen::RowVector3d on_surface = (1 - a - b) * surface.row(triangle[0]) +
                                            a * surface.row(triangle[1]) + b * surface.row(triangle[2]);
      Eigen::Vector3d point = observed_from_simulated * on_surface.transpose();
      for (int k = 0; k < 3; ++k) point[k] += noise * normal(random);
      if (uniform(random) < outliers) point += 0.3 * Eigen::Vector3d(1, uniform(random), 1);
      observation.points.row(i) = point.transpose();
    }
    observations.push_back(observation);
  }
  return observations;
}

const RegistrationBounds kBounds{Eigen::Vector3d::Constant(0.06), 0.3, 0.1};

RegistrationProblem problem_of(const data::TriangleMesh& mesh, const Motion& motion,
                               const std::vector<Observation>& observations, const Registration& truth) {
  RegistrationProblem problem{&mesh.triangles, &motion, &observations, nullptr, kBounds, {}};
  problem.start.pivot = truth.pivot;
  return problem;
}

TEST(Registration, FindsOffsetYawAndTimeOfCleanPoints) {
  const data::TriangleMesh mesh = flat_sheet(16);
  const Motion motion = moving_sheet_motion(mesh, 0.01, 110);
  const Registration truth{
      .offset = {0.03, -0.04, 0.012}, .yaw = -0.15, .time_offset = 0.043, .pivot = {0.2, 0.1, 0}};
  const auto observations = observe(mesh, truth, 0, 0, 1);
  const auto fit = register_motions({problem_of(mesh, motion, observations, truth)}, {}).front();
  // The motion is linear between steps: its chord is off by acceleration * step^2 / 8 = 1e-5 m.
  EXPECT_NEAR((fit.registration.offset - truth.offset).norm(), 0, 1e-4);
  EXPECT_NEAR(fit.registration.yaw, truth.yaw, 3e-4);
  EXPECT_NEAR(fit.registration.time_offset, truth.time_offset, 3e-4);
  EXPECT_LT(fit.score, 3e-5);
  EXPECT_TRUE(fit.bounds_hit.empty());
  const Registration alone = find_registrations({problem_of(mesh, motion, observations, truth)}, {}).front();
  EXPECT_EQ(alone.offset, fit.registration.offset);
  EXPECT_EQ(alone.yaw, fit.registration.yaw);
  EXPECT_EQ(alone.time_offset, fit.registration.time_offset);
}

TEST(Registration, NoiseAndStrayPointsMoveItLittle) {
  const data::TriangleMesh mesh = flat_sheet(16);
  const Motion motion = moving_sheet_motion(mesh, 0.01, 110);
  const Registration truth{
      .offset = {-0.03, 0.02, 0.03}, .yaw = 0.1, .time_offset = -0.05, .pivot = {0.2, 0.1, 0}};
  const auto observations = observe(mesh, truth, 2e-3, 0.03, 2);
  const auto fit = register_motions({problem_of(mesh, motion, observations, truth)}, {}).front();
  // 2,000 points of 2 mm noise, five parameters partly along the surface: about 0.2 mm; five times that.
  EXPECT_NEAR((fit.registration.offset - truth.offset).norm(), 0, 1e-3);
  EXPECT_NEAR(fit.registration.yaw, truth.yaw, 5e-3);
  EXPECT_NEAR(fit.registration.time_offset, truth.time_offset, 3e-3);
}

TEST(Registration, ScoreNeverRisesAboveTheStartAndIsThatOfTheObjective) {
  const data::TriangleMesh mesh = flat_sheet(8);
  const Motion motion = moving_sheet_motion(mesh, 0.05, 22);
  for (const RobustKind kind : {RobustKind::plain, RobustKind::trimmed, RobustKind::huber}) {
    const Robust robust{.kind = kind, .huber_delta = 0.01};
    const Registration truth{.offset = {0.05, 0, 0.02}, .yaw = 0.2, .time_offset = 0.08};
    const auto observations = observe(mesh, truth, 5e-3, 0.02, 3);
    const auto problem = problem_of(mesh, motion, observations, truth);
    const auto fit = register_motions({problem}, {.robust = robust}).front();
    const double start = weighted_mean_score(
        keyframe_scores(mesh.triangles, motion, observations, problem.start, {.robust = robust}),
        observations);
    EXPECT_LT(fit.score, 0.5 * start);
    EXPECT_DOUBLE_EQ(fit.score, weighted_mean_score(keyframe_scores(mesh.triangles, motion, observations,
                                                                    fit.registration, {.robust = robust}),
                                                    observations));
  }
}

TEST(Registration, StaysInsideItsBoundsAndNamesTheOnesItHits) {
  const data::TriangleMesh mesh = flat_sheet(12);
  const Motion motion = moving_sheet_motion(mesh, 0.01, 110);
  const Registration truth{.offset = {0.10, -0.02, 0}, .yaw = 0.05, .time_offset = 0};
  const auto observations = observe(mesh, truth, 0, 0, 4);
  auto problem = problem_of(mesh, motion, observations, truth);
  problem.bounds.time = 0;
  const auto fit = register_motions({problem}, {}).front();
  EXPECT_EQ(fit.registration.offset.x(), 0.06);
  EXPECT_EQ(fit.registration.time_offset, 0);
  EXPECT_NE(std::find(fit.bounds_hit.begin(), fit.bounds_hit.end(), "offset_x"), fit.bounds_hit.end());
  EXPECT_EQ(std::find(fit.bounds_hit.begin(), fit.bounds_hit.end(), "time"), fit.bounds_hit.end());
}

TEST(Registration, OneYawForABatchOfRecordings) {
  const data::TriangleMesh mesh = flat_sheet(12);
  const Motion motion = moving_sheet_motion(mesh, 0.01, 110);
  const Registration first{.offset = {0.03, 0, 0}, .yaw = -0.12, .time_offset = 0.02};
  const Registration second{.offset = {-0.02, 0.02, 0.01}, .yaw = -0.12, .time_offset = -0.03};
  const auto seen_first = observe(mesh, first, 1e-3, 0, 5), seen_second = observe(mesh, second, 1e-3, 0, 6);
  const auto fits = register_motions(
      {problem_of(mesh, motion, seen_first, first), problem_of(mesh, motion, seen_second, second)}, {}, {},
      {.yaw = true});
  EXPECT_EQ(fits[0].registration.yaw, fits[1].registration.yaw);
  EXPECT_NEAR(fits[0].registration.yaw, -0.12, 3e-3);
  EXPECT_NEAR((fits[0].registration.offset - first.offset).norm(), 0, 1e-3);
  EXPECT_NEAR((fits[1].registration.offset - second.offset).norm(), 0, 1e-3);
}

TEST(Registration, KeyframesWithoutWeightHaveNoSay) {
  const data::TriangleMesh mesh = flat_sheet(12);
  const Motion motion = moving_sheet_motion(mesh, 0.01, 110);
  const Registration truth{.offset = {0.02, 0.01, 0}};
  auto observations = observe(mesh, truth, 0, 0, 8);
  observations[1].points.rowwise() += Eigen::RowVector3d(0.05, 0.05, 0.05);
  observations[1].weight = 0;
  const auto fit = register_motions({problem_of(mesh, motion, observations, truth)}, {}).front();
  EXPECT_NEAR((fit.registration.offset - truth.offset).norm(), 0, 1e-4);
  EXPECT_GT(fit.keyframe_scores[1], 0.01);
}

}  // namespace
}  // namespace flash::sysid
