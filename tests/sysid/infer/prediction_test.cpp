#include "sysid/infer/prediction.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "data/files/error.h"
#include "sysid/infer/observed_rows.h"
#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

constexpr int kKeyframes = 10;

/// A cloth of which the middle of every triangle is seen, without error.
struct SeenCloth {
  Replay replay;
  Motion motion;
  explicit SeenCloth(int cells = 10) {
    replay.surface = flat_sheet(cells);
    const data::Triangles& triangles = replay.surface.triangles;
    replay.queries = std::make_shared<const SheetDistance>(triangles, replay.surface.vertices);
    motion = moving_sheet_motion(replay.surface, 0.1, kKeyframes);
    for (int k = 0; k < kKeyframes; ++k) {
      Observation observation;
      observation.t = 0.1 * k;
      observation.weight = 1;
      data::Points positions;
      surface_at(motion, observation.t, positions);
      observation.points.resize(triangles.rows(), 3);
      for (Eigen::Index i = 0; i < triangles.rows(); ++i)
        observation.points.row(i) = (positions.row(triangles(i, 0)) + positions.row(triangles(i, 1)) +
                                     positions.row(triangles(i, 2))) /
                                    3;
      replay.observations.push_back(observation);
    }
  }
  std::vector<ReplayResult> simulated() const {
    ReplayResult result;
    result.motion = motion;
    result.finite = result.converged = true;
    return {result};
  }
  Replay noisy(double noise) const {
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal(0, noise);
    return moved(Eigen::VectorXd::NullaryExpr(kKeyframes * replay.surface.triangles.rows(),
                                              [&] { return normal(random); }));
  }
  /// The points moved along the normals.
  Replay moved(const Eigen::VectorXd& distances) const {
    Replay other = replay;
    const data::Triangles& triangles = replay.surface.triangles;
    Eigen::Index row = 0;
    for (Observation& observation : other.observations) {
      data::Points positions;
      surface_at(motion, observation.t, positions);
      for (Eigen::Index i = 0; i < triangles.rows(); ++i) {
        const Eigen::Vector3d a = positions.row(triangles(i, 0)), b = positions.row(triangles(i, 1)),
                              c = positions.row(triangles(i, 2));
        observation.points.row(i) += distances[row++] * (b - a).cross(c - a).normalized().transpose();
      }
    }
    return other;
  }
};

Misfit misfit_of(double noise, double rms) {
  Misfit misfit;
  misfit.noise = misfit.rough = noise;
  misfit.rms = misfit.size = rms;
  misfit.reach_time = 0.3;
  misfit.reach_sheet = 0.2;
  misfit.draws = {{rms, misfit.reach_time, misfit.reach_sheet}};
  return misfit;
}

TEST(Prediction, OfNoiseAloneIsTheMeanOfItsSize) {
  const SeenCloth cloth;
  const Prediction prediction =
      predict(cloth.noisy(1e-3), cloth.simulated(), {}, {misfit_of(5e-4, 0)}, ScoreSettings{});
  ASSERT_EQ(prediction.keyframes.size(), static_cast<std::size_t>(kKeyframes));
  // Of |z|, z normal, without the largest 5 % (|z| > 1.96) the mean is 0.7168. That of 200 scatters as those
  // whose largest are 1.96, by 0.553, over 0.95 (Tukey and McLaughlin 1963).
  const double mean = 0.7168e-3, half = 1.96 * 0.553e-3 / 0.95 / std::sqrt(200);
  int held = 0;
  for (const PredictedKeyframe& keyframe : prediction.keyframes) {
    // The noise itself is estimated, by 2,000 differences of neighbours: to sqrt(2 / 2000). Three of these.
    EXPECT_NEAR(keyframe.band[0], mean - half, 0.095 * mean);
    EXPECT_NEAR(keyframe.band[1], mean + half, 0.095 * mean);
    held += keyframe.holds() ? 1 : 0;
  }
  EXPECT_GE(held, 8);  // less once in a hundred times
  EXPECT_GT(prediction.chance, 0.01);
}

// Recordings by the dense covariance that DiscrepancyModel states, not by the draws of the prediction.
TEST(Prediction, BandsHoldAsOftenAsTheySay) {
  const SeenCloth cloth(6);
  const Misfit misfit = misfit_of(5e-4, 2e-3);
  const LinearObservations places(cloth.replay, cloth.motion, {}, Objective{});
  ASSERT_EQ(places.rows(), kKeyframes * cloth.replay.surface.triangles.rows());
  const ObservedRows rows = observed_rows(cloth.replay, places, Robust{});
  const SheetModes modes = sheet_modes(rows.places);
  const Eigen::MatrixXd along =
      modes.values * variances_along(modes, misfit.reach_sheet).asDiagonal() * modes.values.transpose();
  Eigen::MatrixXd covariance(rows.places.rows(), rows.places.rows());
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    for (Eigen::Index j = 0; j < covariance.cols(); ++j) {
      const int apart =
          std::abs(rows.keyframe[static_cast<std::size_t>(i)] - rows.keyframe[static_cast<std::size_t>(j)]);
      covariance(i, j) =
          misfit.rms * misfit.rms * along(i, j) * correlation_in_time(0.1 * apart / misfit.reach_time);
    }
  covariance.diagonal().array() += misfit.noise * misfit.noise;
  const Eigen::MatrixXd root = covariance.llt().matrixL();
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  constexpr int kRecordings = 40;
  int held = 0, unlikely = 0;
  for (int recording = 0; recording < kRecordings; ++recording) {
    const Eigen::VectorXd errors =
        root * Eigen::VectorXd::NullaryExpr(root.rows(), [&] { return normal(random); });
    const Prediction prediction =
        predict(cloth.moved(errors), cloth.simulated(), {}, {misfit}, ScoreSettings{});
    for (const PredictedKeyframe& keyframe : prediction.keyframes) held += keyframe.holds() ? 1 : 0;
    unlikely += prediction.chance < 0.05 ? 1 : 0;
  }
  // 95 % of 400; keyframes within the reach in time go together, so some 160 independent ones: 3 sd are 21.
  EXPECT_NEAR(held, 0.95 * kKeyframes * kRecordings, 21);
  EXPECT_LE(unlikely, 7);  // of 40 at 5 %: more by chance once in a thousand
}

TEST(Prediction, AnotherMotionContradictsIt) {
  const SeenCloth cloth;
  Eigen::VectorXd errors(kKeyframes * cloth.replay.surface.triangles.rows());
  for (Eigen::Index i = 0; i < errors.size(); ++i)
    errors[i] = 5e-3 * std::sin(M_PI * static_cast<double>(i % 200) / 100);
  const Prediction prediction =
      predict(cloth.moved(errors), cloth.simulated(), {}, {misfit_of(5e-4, 5e-4)}, ScoreSettings{});
  EXPECT_LT(prediction.chance, 0.01);
  EXPECT_FALSE(prediction.keyframes.front().holds());

  // One keyframe is enough.
  Replay one = cloth.moved(errors);
  for (std::size_t k = 1; k < one.observations.size(); ++k) one.observations[k].weight = 0;
  EXPECT_LT(predict(one, cloth.simulated(), {}, {misfit_of(5e-4, 5e-4)}, ScoreSettings{}).chance, 0.01);
  for (Observation& observation : one.observations) observation.weight = 0;
  EXPECT_THROW(predict(one, cloth.simulated(), {}, {misfit_of(5e-4, 5e-4)}, ScoreSettings{}),
               data::InputError);
}

// What registration may explain ends at its bounds.
TEST(Prediction, ARecordingBeyondTheBoundsContradictsIt) {
  const SeenCloth cloth;
  Replay seen = cloth.noisy(5e-4);
  for (Observation& observation : seen.observations) observation.points.col(2).array() += 0.01;
  const auto chance = [&](double bound) {
    seen.recording.nuisance.offset.setConstant(bound);
    return predict(seen, cloth.simulated(), {}, {misfit_of(5e-4, 5e-4)}, ScoreSettings{}).chance;
  };
  EXPECT_LT(chance(0.002), 0.01);
  EXPECT_GT(chance(0.02), 0.01);
}

// What the parameters leave open widens the bands; what is fitted to each recording does not count.
TEST(Prediction, DrawsOfThePosteriorWidenTheBandsAndRegistrationTakesItsPart) {
  SeenCloth cloth;
  const auto with_draws = [&](const Eigen::RowVector3d& bend, const Eigen::RowVector3d& offset) {
    std::vector<ReplayResult> motions = cloth.simulated();
    for (const double size : {-1.0, 1.0}) {
      ReplayResult& draw = motions.emplace_back(motions.front());
      for (data::Points& positions : draw.motion.positions)
        for (Eigen::Index i = 0; i < positions.rows(); ++i)
          positions.row(i) += size * (offset + std::sin(15 * cloth.replay.surface.vertices(i, 0)) * bend);
    }
    Replay seen = cloth.noisy(5e-4);
    return predict(seen, motions, {}, {misfit_of(5e-4, 0)}, ScoreSettings{}).keyframes[5].band[1];
  };
  const Eigen::RowVector3d none = Eigen::RowVector3d::Zero(), by(1e-3, 1e-3, 3e-3);
  const double alone = with_draws(none, none);
  EXPECT_GT(with_draws(by, none), 2 * alone);
  EXPECT_GT(with_draws(none, by), 2 * alone);
  cloth.replay.recording.nuisance.offset.setConstant(0.02);
  EXPECT_GT(with_draws(by, none), 1.5 * alone);
  EXPECT_NEAR(with_draws(none, by), alone, 0.15 * alone);  // to first order, on a curved sheet
}

}  // namespace
}  // namespace flash::sysid
