#include "calib/uncertainty/motion_in_time.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/solve/linearization.h"
#include "data/numbers/chi_square.h"

namespace flash::calib {
namespace {

constexpr double kUsualError = 0.1 * M_PI / 180;  // of arms in use, shared by neighbouring views

/// A robot whose errors were taken to be larger than they are beside a motion has smaller ones by steps of
/// this factor, down to a tenth.
constexpr double kShare = 0.75;
constexpr int kLowestShare = 8;

/// By how much a parabola through three values at equal distances falls below the middle one, the least.
double below(double before, double least, double after) {
  const double left = before - least, right = after - least;
  return 0.125 * (left - right) * (left - right) / std::max(left + right, 1e-300);
}

}  // namespace

bool beyond_usual(const Bundle& bundle, const Vector6d& motion) {
  double distance = 0;
  for (const BundleView& view : bundle.views)
    distance += predicted_pose(bundle, view).translation().norm() / static_cast<double>(bundle.views.size());
  const double turn = motion.tail<3>().norm(), shift = motion.head<3>().norm() / distance;
  return turn * turn + shift * shift > data::chi_square_99_of_6 * 2 * kUsualError * kUsualError;
}

bool MotionInTime::applies(const Bundle& bundle, const BundleSettings& settings) {
  return settings.unknowns.corrections && bundle.bases.size() == 1 && bundle.cameras.size() == 1;
}

/// Of each pose [d_shared residual]^T [d_shared residual], its own correction eliminated.
MotionInTime::Level::Level(const LinearModel& model, const std::vector<double>& sigmas)
    : grams(static_cast<std::size_t>(model.groups)) {
  const Eigen::Index d = model.own, s = model.shared;
  for (Eigen::MatrixXd& gram : grams) gram.setZero(d + s + 1, d + s + 1);
  for (const GramBlock& block : model.blocks) {
    const double sigma = sigmas[static_cast<std::size_t>(block.component)];
    grams[static_cast<std::size_t>(block.group)] += block.gram / (sigma * sigma);
    deviance += 2 * block.count * std::log(sigma);
  }
  all = Eigen::MatrixXd::Zero(s + 1, s + 1);
  if (model.prior.size() > 0) all = model.prior;
  for (Eigen::MatrixXd& gram : grams) {
    const Eigen::LDLT<Eigen::MatrixXd> own(gram.topLeftCorner(d, d));
    deviance += own.vectorD().array().abs().max(1e-300).log().sum();
    const Eigen::MatrixXd cross = gram.topRightCorner(d, s + 1);
    gram = (gram.bottomRightCorner(s + 1, s + 1) - cross.transpose() * own.solve(cross)).eval();
    all += gram;
  }
  shared.compute(all.topLeftCorner(s, s));
  deviance += all(s, s) - all.col(s).head(s).dot(shared.solve(all.col(s).head(s)));
}

MotionInTime::MotionInTime(const Refinement& refined, const BundleSettings& settings)
    : model_(linearize(refined.bundle, refined.noise, settings)), noise_(refined.noise) {
  const Bundle& bundle = refined.bundle;
  still_ = least_deviance([](const Level& level) { return level.deviance; }).second;
  const SharedColumns columns = shared_columns(bundle, settings.unknowns);
  camera_column_ = columns.cameras.front();
  target_column_ = columns.targets.front();
  numbers_ = 6 * static_cast<double>(bundle.poses.size());
}

const MotionInTime::Level& MotionInTime::level(const Shares& shares) const {
  const auto known = levels_.find(shares);
  if (known != levels_.end()) return known->second;
  NoiseLevels noise = noise_;
  for (double& sigma : noise.rotation) sigma *= std::pow(kShare, shares.first);
  for (double& sigma : noise.translation) sigma *= std::pow(kShare, shares.second);
  Level& found = levels_.emplace(shares, Level(model_, to_components(noise))).first->second;
  found.rotation = noise.rotation.front();
  found.translation = noise.translation.front();
  return found;
}

std::pair<MotionInTime::Shares, double> MotionInTime::least_deviance(
    const std::function<double(const Level&)>& deviance) const {
  std::map<Shares, double> known;
  const auto at = [&](const Shares& shares) {
    if (std::min(shares.first, shares.second) < 0 || std::max(shares.first, shares.second) > kLowestShare)
      return std::numeric_limits<double>::infinity();
    const auto entry = known.try_emplace(shares, 0);
    if (entry.second) entry.first->second = deviance(level(shares));
    return entry.first->second;
  };
  const auto moved = [](Shares shares, int axis, int step) {
    (axis == 0 ? shares.first : shares.second) += step;
    return shares;
  };
  Shares least{0, 0};
  for (bool better = true; better;) {
    better = false;
    for (const int axis : {0, 1})
      for (const int step : {1, -1})
        while (at(moved(least, axis, step)) < at(least)) {
          least = moved(least, axis, step);
          better = true;
        }
  }
  double fall = 0;  // between the shares that were tried
  for (const int axis : {0, 1}) {
    const double before = at(moved(least, axis, -1)), after = at(moved(least, axis, 1));
    if (std::isfinite(before + after)) fall += below(before, at(least), after);
  }
  return {least, at(least) - fall};
}

MotionInTime::Joint MotionInTime::joint(const Level& level, const std::vector<std::vector<double>>& shapes,
                                        bool camera) const {
  const Eigen::Index s = level.all.rows() - 1, count = 6 * static_cast<Eigen::Index>(shapes.size());
  const int column = camera ? camera_column_ : target_column_;
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(s + 1, count), own = Eigen::MatrixXd::Zero(count, count);
  for (std::size_t a = 0; a < shapes.size(); ++a) {
    const Eigen::Index at = 6 * static_cast<Eigen::Index>(a);
    for (std::size_t i = 0; i < level.grams.size(); ++i) {
      if (shapes[a][i] == 0) continue;
      cross.middleCols<6>(at) += shapes[a][i] * level.grams[i].middleCols<6>(column);
      for (std::size_t b = 0; b < shapes.size(); ++b)
        own.block<6, 6>(at, 6 * static_cast<Eigen::Index>(b)) +=
            shapes[a][i] * shapes[b][i] * level.grams[i].block<6, 6>(column, column);
    }
  }
  Joint joint;
  joint.cross = cross.topRows(s);
  joint.pull =
      cross.row(s).transpose() - joint.cross.transpose() * level.shared.solve(level.all.col(s).head(s));
  joint.information = own - joint.cross.transpose() * level.shared.solve(joint.cross);
  return joint;
}

MotionInTime::Fit MotionInTime::fit(const std::vector<std::vector<double>>& shapes, bool camera) const {
  const auto motion_at = [&](const Level& level, double& fall) -> Eigen::VectorXd {
    const Joint solved = joint(level, shapes, camera);
    const Eigen::VectorXd motion = -solved.information.ldlt().solve(solved.pull);
    fall = -motion.dot(solved.pull);
    return motion;
  };
  double fall = 0;
  const auto [shares, least] = least_deviance([&](const Level& level) {
    motion_at(level, fall);
    return level.deviance - fall;
  });
  return {motion_at(level(shares), fall), still_ - least};
}

double MotionInTime::misfit(const std::vector<double>& shape) const {
  const Joint solved = joint(level({0, 0}), {shape}, true);
  return solved.pull.dot(solved.information.ldlt().solve(solved.pull));
}

double MotionInTime::deviance(const std::vector<UncertainMotion>& motions, bool camera) const {
  std::vector<std::vector<double>> shapes;
  shapes.reserve(motions.size());
  for (const UncertainMotion& motion : motions) shapes.push_back(motion.shape);
  // In units of its standard deviations a motion m has the prior m^2: |I + D L D| and
  // p^T D (I + D L D)^-1 D p.
  return least_deviance([&](const Level& level) {
           Eigen::VectorXd sd(6 * static_cast<Eigen::Index>(motions.size()));
           for (std::size_t k = 0; k < motions.size(); ++k) {
             const auto at = 6 * static_cast<Eigen::Index>(k);
             const UncertainMotion& motion = motions[k];
             sd.segment<3>(at).setConstant(std::hypot(motion.shift_sd, motion.of_noise * level.translation));
             sd.segment<3>(at + 3).setConstant(std::hypot(motion.turn_sd, motion.of_noise * level.rotation));
           }
           const Joint solved = joint(level, shapes, camera);
           Eigen::MatrixXd scaled = sd.asDiagonal() * solved.information * sd.asDiagonal();
           scaled.diagonal().array() += 1;
           const Eigen::VectorXd pull = sd.cwiseProduct(solved.pull);
           const Eigen::LDLT<Eigen::MatrixXd> factor(scaled);
           return level.deviance - pull.dot(factor.solve(pull)) +
                  factor.vectorD().array().abs().max(1e-300).log().sum();
         })
      .second;
}

Matrix6d MotionInTime::shift_of_camera(const std::vector<double>& shape, const std::vector<double>& solved,
                                       bool camera) const {
  const Level& as_found = level({0, 0});
  if (solved.empty())
    return as_found.shared.solve(joint(as_found, {shape}, camera).cross).middleRows(camera_column_, 6);
  const Joint both = joint(as_found, {solved, shape}, camera);
  const Eigen::MatrixXd by_solved = as_found.shared.solve(both.cross.leftCols<6>());
  const Eigen::MatrixXd by_shape = as_found.shared.solve(both.cross.rightCols<6>());
  // Of the motion that is solved for, in place of the one that took place.
  const Eigen::MatrixXd taken =
      both.information.topLeftCorner<6, 6>().ldlt().solve(both.information.topRightCorner<6, 6>());
  return (by_shape - by_solved * taken).middleRows(camera_column_, 6);
}

Matrix6d MotionInTime::growth(const std::vector<double>& shape, bool camera) const {
  const Level& as_found = level({0, 0});
  const Joint motion = joint(as_found, {shape}, camera);
  const Eigen::MatrixXd gain = as_found.shared.solve(motion.cross).middleRows(camera_column_, 6);
  return gain * motion.information.ldlt().solve(Eigen::MatrixXd::Identity(6, 6)) * gain.transpose();
}

}  // namespace flash::calib
