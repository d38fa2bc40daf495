#include "calib/uncertainty/motion_in_time.h"

#include <algorithm>
#include <cmath>

#include "calib/solve/linearization.h"

namespace flash::calib {
namespace {

constexpr double kUsualError = 0.1 * M_PI / 180;  // of arms in use, shared by neighbouring views
constexpr double kOnceInHundred = 16.812;         // chi-square, 6 degrees of freedom

/// Of each pose, [d_shared residual]^T [d_shared residual] with its own correction eliminated.
std::vector<Eigen::MatrixXd> reduced_grams(const LinearModel& model, const std::vector<double>& sigmas) {
  const Eigen::Index d = model.own, s = model.shared;
  std::vector<Eigen::MatrixXd> joint(static_cast<std::size_t>(model.groups),
                                     Eigen::MatrixXd::Zero(d + s + 1, d + s + 1));
  for (const GramBlock& block : model.blocks)
    joint[static_cast<std::size_t>(block.group)] +=
        std::pow(sigmas[static_cast<std::size_t>(block.component)], -2) * block.gram;
  for (Eigen::MatrixXd& gram : joint) {
    const Eigen::LDLT<Eigen::MatrixXd> own(gram.topLeftCorner(d, d));
    const Eigen::MatrixXd cross = gram.topRightCorner(d, s + 1);
    gram = (gram.bottomRightCorner(s + 1, s + 1) - cross.transpose() * own.solve(cross)).eval();
  }
  return joint;
}

}  // namespace

bool beyond_usual(const Bundle& bundle, const Vector6d& motion) {
  double distance = 0;
  for (const BundleView& view : bundle.views)
    distance += predicted_pose(bundle, view).translation().norm() / static_cast<double>(bundle.views.size());
  const double turn = motion.tail<3>().norm(), shift = motion.head<3>().norm() / distance;
  return turn * turn + shift * shift > kOnceInHundred * 2 * kUsualError * kUsualError;
}

bool MotionInTime::applies(const Bundle& bundle, const BundleSettings& settings) {
  return settings.unknowns.corrections && bundle.bases.size() == 1 && bundle.cameras.size() == 1;
}

MotionInTime::MotionInTime(const Refinement& refined, const BundleSettings& settings) {
  const Bundle& bundle = refined.bundle;
  const LinearModel model = linearize(bundle, refined.noise, settings);
  const std::vector<double> sigmas = to_components(refined.noise);
  grams_ = reduced_grams(model, sigmas);
  all_ = model.prior;
  for (const Eigen::MatrixXd& gram : grams_) all_ += gram;
  shared_.compute(all_.topLeftCorner(model.shared, model.shared));
  // What the robot's errors amount to, in their own noise.
  const LinearSolution solution = solve_linear(model, sigmas);
  const auto rotation =
      static_cast<Eigen::Index>(2 * bundle.cameras.size());  // corners and depths come first
  for (const Eigen::Index component : {rotation, rotation + 1})
    squares_ += solution.squares[component] * std::pow(sigmas[static_cast<std::size_t>(component)], -2);
  const SharedColumns columns = shared_columns(bundle, settings.unknowns);
  camera_column_ = columns.cameras.front();
  target_column_ = columns.targets.front();
  numbers_ = 6 * static_cast<double>(bundle.poses.size());
}

MotionInTime::Joint MotionInTime::joint(const std::vector<std::vector<double>>& shapes, bool camera) const {
  const Eigen::Index s = all_.rows() - 1, count = 6 * static_cast<Eigen::Index>(shapes.size());
  const int column = camera ? camera_column_ : target_column_;
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(s + 1, count), own = Eigen::MatrixXd::Zero(count, count);
  for (std::size_t a = 0; a < shapes.size(); ++a) {
    const Eigen::Index at = 6 * static_cast<Eigen::Index>(a);
    for (std::size_t i = 0; i < grams_.size(); ++i) {
      if (shapes[a][i] == 0) continue;
      cross.middleCols<6>(at) += shapes[a][i] * grams_[i].middleCols<6>(column);
      for (std::size_t b = 0; b < shapes.size(); ++b)
        own.block<6, 6>(at, 6 * static_cast<Eigen::Index>(b)) +=
            shapes[a][i] * shapes[b][i] * grams_[i].block<6, 6>(column, column);
    }
  }
  Joint joint;
  joint.cross = cross.topRows(s);
  joint.pull = cross.row(s).transpose() - joint.cross.transpose() * shared_.solve(all_.col(s).head(s));
  joint.information = own - joint.cross.transpose() * shared_.solve(joint.cross);
  return joint;
}

MotionInTime::Fit MotionInTime::fit(const std::vector<std::vector<double>>& shapes, bool camera) const {
  const Joint motions = joint(shapes, camera);
  Fit fit;
  fit.motion = -motions.information.ldlt().solve(motions.pull);
  const double left = std::max(1 + fit.motion.dot(motions.pull) / squares_, 1e-3);
  fit.fall = -numbers_ * std::log(left);
  return fit;
}

Matrix6d MotionInTime::shift_of_camera(const std::vector<double>& shape, const std::vector<double>& solved,
                                       bool camera) const {
  if (solved.empty()) return shared_.solve(joint({shape}, camera).cross).middleRows(camera_column_, 6);
  const Joint both = joint({solved, shape}, camera);
  const Eigen::MatrixXd by_solved = shared_.solve(both.cross.leftCols<6>());
  const Eigen::MatrixXd by_shape = shared_.solve(both.cross.rightCols<6>());
  // Of the motion that is solved for, in place of the one that took place.
  const Eigen::MatrixXd taken =
      both.information.topLeftCorner<6, 6>().ldlt().solve(both.information.topRightCorner<6, 6>());
  return (by_shape - by_solved * taken).middleRows(camera_column_, 6);
}

Matrix6d MotionInTime::growth(const std::vector<double>& shape, bool camera) const {
  const Joint motion = joint({shape}, camera);
  const Eigen::MatrixXd gain = shared_.solve(motion.cross).middleRows(camera_column_, 6);
  return gain * motion.information.ldlt().solve(Eigen::MatrixXd::Identity(6, 6)) * gain.transpose();
}

}  // namespace flash::calib
