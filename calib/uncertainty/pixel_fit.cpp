#include "calib/uncertainty/pixel_fit.h"

#include <Eigen/Cholesky>

#include "calib/solve/linearization.h"
#include "calib/uncertainty/pose_information.h"

namespace flash::calib {
namespace {

constexpr Eigen::Index kPoses = 12;  // X and Z, which come first among the shared unknowns

/// How the fit moves with the error of each pose, 12 x 6, errors in variables having moved the other
/// unknowns.
std::vector<Eigen::MatrixXd> gains_of(const std::vector<PoseInformation>& poses, const Eigen::MatrixXd& prior,
                                      Eigen::MatrixXd& all) {
  const Eigen::Index s = prior.rows(), others = s - kPoses;
  all = Eigen::MatrixXd::Zero(s, s);
  Eigen::MatrixXd refined = prior;
  for (const PoseInformation& pose : poses) {
    all += pose.H_ss;
    refined += pose.H_ss - pose.H_s.transpose() * (pose.H + pose.prior).ldlt().solve(pose.H_s);
  }
  const Eigen::LDLT<Eigen::MatrixXd> shared(refined), own(all.topLeftCorner<kPoses, kPoses>());
  std::vector<Eigen::MatrixXd> gains;
  for (const PoseInformation& pose : poses) {
    const Eigen::MatrixXd moves =
        -shared.solve(pose.H_s.transpose() * (pose.H + pose.prior).ldlt().solve(pose.prior));
    gains.emplace_back(-own.solve(pose.H_s.transpose().topRows<kPoses>() +
                                  all.topRightCorner(kPoses, others) * moves.bottomRows(others)));
  }
  return gains;
}

}  // namespace

PixelFit fit_pixels(const Refinement& refined, const BundleSettings& settings, const PoseErrorModel& errors) {
  Bundle bundle = refined.bundle;
  for (RobotPose& pose : bundle.poses) pose.correction.setIdentity();
  solve_bundle(bundle, refined.noise,
               {.unknowns = {.corrections = false, .depth_scales = false}, .huber = 0});
  PixelFit fit{.poses = {bundle.cameras.front(), bundle.targets.front()}};

  const std::vector<PoseInformation> poses = pose_informations(refined, settings);
  const Eigen::Index s = refined.covariance.rows(), others = s - kPoses;
  const Eigen::MatrixXd prior = linearize(refined.bundle, refined.noise, settings).prior.topLeftCorner(s, s);
  Eigen::MatrixXd all;
  const std::vector<Eigen::MatrixXd> gains = gains_of(poses, prior, all);
  const Eigen::LDLT<Eigen::MatrixXd> own(all.topLeftCorner<kPoses, kPoses>());
  // Corners, and what corners and priors leave open of the other unknowns.
  const Eigen::MatrixXd by_others = own.solve(all.topRightCorner(kPoses, others));
  Eigen::MatrixXd open = prior.bottomRightCorner(others, others) + all.bottomRightCorner(others, others) -
                         all.bottomLeftCorner(others, kPoses) * by_others;
  Eigen::MatrixXd independent = own.solve(Eigen::MatrixXd::Identity(kPoses, kPoses));
  if (others > 0)
    independent +=
        by_others * open.ldlt().solve(Eigen::MatrixXd::Identity(others, others)) * by_others.transpose();
  Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(kPoses, kPoses);
  const double share = errors.arms.front().share;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (poses[i].H.isZero(0)) continue;
    const Eigen::MatrixXd noise = gains[i] * poses[i].prior.ldlt().solve(gains[i].transpose());
    independent += noise;
    if (errors.covariance.front().size() > 0) shared -= share * noise;
  }
  if (errors.covariance.front().size() > 0) {
    const std::vector<std::size_t>& seen = errors.poses.front();
    Eigen::MatrixXd rows(kPoses, 6 * static_cast<Eigen::Index>(seen.size()));
    for (std::size_t i = 0; i < seen.size(); ++i)
      rows.middleCols<6>(6 * static_cast<Eigen::Index>(i)) = gains[seen[i]];
    shared += rows * errors.covariance.front() * rows.transpose();
  }
  fit.repeatable = independent.topLeftCorner<6, 6>();
  fit.covariance = fit.repeatable + shared.topLeftCorner<6, 6>();
  return fit;
}

}  // namespace flash::calib
