// Evidence of motions beside brute force: all unknowns of the linearised problem in one dense system.
#include "calib/uncertainty/motion_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "calib/solve/linearization.h"
#include "calib/uncertainty/pose_error_modes.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

Refinement refined_scene(Setup setup, const BundleSettings& settings) {
  RefineSettings refine_settings;
  refine_settings.bundle = settings;
  return refine(seeded_bundle(protocol_scene(setup, 0.05, 0.5, 11)), refine_settings);
}

/// -2 log likelihood, up to a constant, of errors of poses with a prior of covariance K, free shared unknowns
/// and a known motion of the camera: the quadratic form over (errors, shared) at its least, and its
/// determinant.
double brute_deviance(const Refinement& refined, const BundleSettings& settings, const ArmErrorLevel& level,
                      const Eigen::VectorXd& motion) {
  const std::vector<PoseInformation> seen = pose_informations(refined, settings);
  const int column = shared_columns(refined.bundle, settings.unknowns).cameras.front();
  std::vector<std::size_t> all(seen.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  const std::vector<PoseModes> modes = modes_of(refined.bundle, all);
  const Eigen::MatrixXd k = matern(squared_distances(modes), level.reach);
  const auto n = static_cast<Eigen::Index>(seen.size()), s = seen.front().H_ss.rows();
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(6 * n, 6 * n), H = Eigen::MatrixXd::Zero(6 * n + s, 6 * n + s);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(6 * n + s);
  double constant = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const PoseInformation& pose = seen[static_cast<std::size_t>(i)];
    const PoseModes& a = modes[static_cast<std::size_t>(i)];
    const Vector6d m = motion.segment<6>(6 * i);
    for (Eigen::Index j = 0; j < n; ++j)
      for (std::size_t mode = 0; mode < a.smooth.size(); ++mode)
        K.block<6, 6>(6 * i, 6 * j) += std::pow(level.smooth, 2) * k(i, j) * a.smooth[mode] *
                                       modes[static_cast<std::size_t>(j)].smooth[mode].transpose();
    K.block<6, 6>(6 * i, 6 * i) += std::pow(level.rotation, 2) * a.rotation * a.rotation.transpose() +
                                   std::pow(level.translation, 2) * a.translation * a.translation.transpose();
    // s + m in place of s for the camera, of this pose.
    H.block<6, 6>(6 * i, 6 * i) = pose.H;
    H.block(6 * i, 6 * n, 6, s) = pose.H_s;
    H.block(6 * n, 6 * i, s, 6) = pose.H_s.transpose();
    H.bottomRightCorner(s, s) += pose.H_ss;
    g.segment<6>(6 * i) += pose.g + pose.H_s.middleCols<6>(column) * m;
    g.tail(s) += pose.g_s + pose.H_ss.middleCols<6>(column) * m;
    constant += m.dot(pose.H_ss.block<6, 6>(column, column) * m) + 2 * m.dot(pose.g_s.segment<6>(column));
  }
  H.topLeftCorner(6 * n, 6 * n) += K.ldlt().solve(Eigen::MatrixXd::Identity(6 * n, 6 * n));
  const Eigen::MatrixXd prior = linearize(refined.bundle, refined.noise, settings).prior;
  if (prior.size() > 0) {
    H.bottomRightCorner(s, s) += prior.topLeftCorner(s, s);
    g.tail(s) += prior.col(s).head(s);
  }
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(H), of_prior(K);
  return constant - g.dot(ldlt.solve(g)) + ldlt.vectorD().array().log().sum() +
         of_prior.vectorD().array().log().sum();
}

class Evidence : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, Evidence, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(Evidence, OfErrorsAndMotionsIsThatOfTheWholeSystem) {
  BundleSettings settings;
  settings.unknowns.scales = false;
  const Refinement refined = refined_scene(GetParam(), settings);
  const MotionEvidence evidence(refined, settings);
  const ArmErrorLevel levels[] = {
      {0.05 * kDegree, 5e-4, 0, 1}, {0.02 * kDegree, 2e-4, 1e-3, 2}, {0.1 * kDegree, 1e-3, 4e-4, 0.5}};
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(6 * evidence.poses());
  Eigen::VectorXd motion = none;
  for (Eigen::Index i = 2; i < evidence.poses(); ++i)
    motion.segment<6>(6 * i) << 1e-3, -2e-3, 5e-4, 1e-3, 2e-3, -1e-3;
  const double reference = brute_deviance(refined, settings, levels[0], none);
  const double offset = evidence.at(levels[0]).deviance - reference;
  for (const ArmErrorLevel& level : levels) {
    const MotionTerms terms = evidence.at(level);
    const double still = brute_deviance(refined, settings, level, none);
    EXPECT_NEAR(terms.deviance - still, offset, 1e-6 * std::abs(still) + 1e-3);
    const double moved =
        terms.deviance + motion.dot(terms.information[0] * motion) - 2 * motion.dot(terms.pull[0]);
    const double rise = brute_deviance(refined, settings, level, motion) - still;
    EXPECT_NEAR(moved - terms.deviance, rise, 1e-4 * std::abs(rise));
  }
}

}  // namespace
}  // namespace flash::calib
