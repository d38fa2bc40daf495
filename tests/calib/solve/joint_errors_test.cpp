#include <gtest/gtest.h>

#include "calib/solve/correction_error.h"
#include "calib/solve/linearization.h"
#include "tests/calib/joint_scene.h"

namespace flash::calib {
namespace {

TEST(JointErrorTerms, CorrectionsHaveTheirDerivatives) {
  ArmModel arm{.chain = chain_of(nominal_arm())};
  arm.lengths = link_lengths(arm.chain);
  const Eigen::VectorXd q = (Eigen::VectorXd(6) << 0.3, -1.6, 1.5, -1.4, -1.57, 0.2).finished();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> J = error_motions(arm, q);
  const WrongArm wrong = draw_wrong_arm(11, 0.5e-3);
  Eigen::VectorXd errors(21);
  errors << wrong.zeros, wrong.lengths;
  const Eigen::Isometry3d D = make_pose({0.004, -0.003, 0.002}, {0.02, -0.01, 0.03});
  const Eigen::Vector3d pivot(0.1, -0.05, 0.2);
  const auto value = [&](const Vector6d& step, const Eigen::VectorXd& more) {
    return correction_error(moved(D, step), moved(Eigen::Isometry3d::Identity(), J * (errors + more)), pivot,
                            J)
        .value;
  };
  const Vector6d still = Vector6d::Zero();
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(21);
  const CorrectionError error =
      correction_error(D, moved(Eigen::Isometry3d::Identity(), J * errors), pivot, J);
  constexpr double kStep = 1e-6;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const Vector6d step = kStep * Vector6d::Unit(i);
    const Vector6d slope = (value(step, none) - value(-step, none)) / (2 * kStep);
    EXPECT_LT((slope - error.by_correction.col(i)).norm(), 1e-8) << i;  // rounding over the step
  }
  // To first order of the errors: what is left out is their turn times a column, over the pivot's distance.
  const double turn = (J * errors).tail<3>().norm();
  for (Eigen::Index i = 0; i < 21; ++i) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(21, i);
    const Vector6d slope = (value(still, step) - value(still, -step)) / (2 * kStep);
    EXPECT_LT((slope - error.by_errors.col(i)).norm(), turn * (1 + pivot.norm()) * J.col(i).norm() + 1e-8)
        << i;
  }
}

// cost = c log(1 + (error / sd)^2 / c); the linear model has half of its derivative, by central differences.
TEST(JointErrorTerms, PriorsAreDerivativesOfTheirCost) {
  const WrongArm wrong = draw_wrong_arm(12, 0.5e-3);
  const HandEyeScene scene = recorded(wrong, Known::joints_and_lengths, 12, Setup::eye_in_hand, 0.7e-3);
  Bundle bundle = seeded_bundle(scene);
  ASSERT_EQ(bundle.joint_errors.front().size(), 21);
  bundle.joint_errors.front() << wrong.zeros, wrong.lengths;
  bundle.joint_errors.front()[2] = 20 * kUsualJointZero;  // far out
  BundleSettings settings;
  settings.unknowns.joint_errors = true;
  const LinearModel model = linearize(bundle, uniform_noise(bundle, 0.1, 1e-4, 3e-5, 1e-3), settings);
  const Eigen::Index first = shared_columns(bundle, settings.unknowns).joint_errors.front(),
                     last = model.prior.cols() - 1;
  for (Eigen::Index i = 0; i < 21; ++i) {
    const double sd = i < 6 ? kUsualJointZero : 0.7e-3, error = bundle.joint_errors.front()[i],
                 step = 1e-4 * sd;
    const auto cost = [&](double e) {
      return kJointErrorTail * std::log1p(std::pow(e / sd, 2) / kJointErrorTail);
    };
    EXPECT_NEAR(model.prior(first + i, last), (cost(error + step) - cost(error - step)) / (4 * step),
                1e-6 / sd);
    EXPECT_NEAR(model.prior(first + i, first + i) * error, model.prior(first + i, last), 1e-12 / sd);
    EXPECT_LE(model.prior(first + i, first + i) * sd * sd, 1);
  }
}

}  // namespace
}  // namespace flash::calib
