#include "calib/uncertainty/lone_view.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "calib/solve/linearization.h"
#include "calib/uncertainty/pose_information.h"

namespace flash::calib {

std::optional<LoneView> lone_view(const Refinement& refined, const BundleSettings& settings) {
  constexpr std::size_t kFew = 8;
  constexpr double kSeveral = 4;
  const std::vector<PoseInformation> poses = pose_informations(refined, settings);
  if (poses.size() < kFew) return std::nullopt;
  const Eigen::Index s = refined.covariance.rows();
  Eigen::MatrixXd all = linearize(refined.bundle, refined.noise, settings).prior.topLeftCorner(s, s);
  std::vector<Eigen::MatrixXd> own;  // of each pose, its error eliminated
  for (const PoseInformation& pose : poses) {
    const Eigen::LDLT<Matrix6d> factor(pose.H + pose.prior);
    own.emplace_back(pose.H_ss - pose.H_s.transpose() * factor.solve(pose.H_s));
    all += own.back();
  }
  const auto of_camera = [s](const Eigen::MatrixXd& information) -> Matrix6d {
    return information.ldlt().solve(Eigen::MatrixXd::Identity(s, 6)).topRows<6>();
  };
  const Matrix6d with = of_camera(all);
  LoneView lone;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Matrix6d without = of_camera(all - own[i]);
    const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> ratio(
        0.5 * (without + without.transpose()), 0.5 * (with + with.transpose()), Eigen::EigenvaluesOnly);
    const double growth = std::sqrt(std::max(1.0, ratio.eigenvalues().maxCoeff()));
    if (growth > lone.growth) lone = {i, growth, without};
  }
  if (!(lone.growth > kSeveral)) return std::nullopt;
  return lone;
}

}  // namespace flash::calib
