#include "calib/uncertainty/knock.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "calib/solve/linearization.h"

namespace flash::calib {
namespace {

constexpr std::size_t kLeastViews = 5;            // on either side
constexpr double kOdds = 20;                      // against a knock, before any view is seen
constexpr double kUsualError = 0.1 * M_PI / 180;  // of arms in use, shared by neighbouring views
constexpr double kOnceInHundred = 16.812;         // chi-square, 6 degrees of freedom

/// More than what the errors of an arm that two halves of a recording do not share put between them.
bool beyond_usual(const Bundle& bundle, const Vector6d& step) {
  double distance = 0;
  for (const BundleView& view : bundle.views)
    distance += predicted_pose(bundle, view).translation().norm() / static_cast<double>(bundle.views.size());
  const double turn = step.tail<3>().norm(), shift = step.head<3>().norm() / distance;
  return turn * turn + shift * shift > kOnceInHundred * 2 * kUsualError * kUsualError;
}

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

std::optional<Knock> find_knock(const Refinement& refined, const BundleSettings& settings, double rival) {
  const Bundle& bundle = refined.bundle;
  const std::size_t count = bundle.poses.size();
  if (!settings.unknowns.corrections || bundle.bases.size() != 1 || bundle.cameras.size() != 1 ||
      count < 2 * kLeastViews)
    return std::nullopt;
  const LinearModel model = linearize(bundle, refined.noise, settings);
  const std::vector<double> sigmas = to_components(refined.noise);
  const std::vector<Eigen::MatrixXd> grams = reduced_grams(model, sigmas);
  const Eigen::Index s = model.shared;
  Eigen::MatrixXd all = model.prior;
  for (const Eigen::MatrixXd& gram : grams) all += gram;
  const Eigen::LDLT<Eigen::MatrixXd> shared(all.topLeftCorner(s, s));
  // What the robot's errors amount to, in their own noise.
  const LinearSolution solution = solve_linear(model, sigmas);
  const auto rotation =
      static_cast<Eigen::Index>(2 * bundle.cameras.size());  // corners and depths come first
  double squares = 0;
  for (const Eigen::Index component : {rotation, rotation + 1})
    squares += solution.squares[component] * std::pow(sigmas[static_cast<std::size_t>(component)], -2);
  const SharedColumns columns = shared_columns(bundle, settings.unknowns);
  const auto numbers = 6 * static_cast<double>(count);
  const double places = 2 * static_cast<double>(count - 2 * kLeastViews + 1);
  const double earn = 6 * std::log(numbers) + 2 * std::log(places * kOdds) + std::max(0.0, rival);
  std::optional<Knock> best, other;  // of the kinds
  for (const bool camera : {true, false}) {
    std::optional<Knock> of_kind;
    const int column = camera ? columns.cameras.front() : columns.targets.front();
    Eigen::MatrixXd after = Eigen::MatrixXd::Zero(s + 1, 6);
    for (std::size_t k = count - 1; k >= kLeastViews; --k) {
      after += grams[k].middleCols<6>(column);
      if (count - k < kLeastViews) continue;
      const Eigen::MatrixXd cross = after.topRows(s);
      const Eigen::Vector<double, 6> pull =
          after.row(s).transpose() - cross.transpose() * shared.solve(all.col(s).head(s));
      const Matrix6d information =
          Matrix6d(after.middleRows<6>(column)) - cross.transpose() * shared.solve(cross);
      const Vector6d step = -information.ldlt().solve(pull);
      const double left = std::max(1 + step.dot(pull) / squares, 1e-3);
      const double gain = -numbers * std::log(left) - earn;
      if (gain > (of_kind ? of_kind->gain : 0) && beyond_usual(bundle, step))
        of_kind = Knock{k, camera, step, true, gain};
    }
    if (of_kind && (!best || of_kind->gain > best->gain)) std::swap(best, of_kind);
    if (of_kind) other = of_kind;
  }
  if (best && other) best->told = best->gain - other->gain > 2 * std::log(kOdds);
  return best;
}

}  // namespace flash::calib
