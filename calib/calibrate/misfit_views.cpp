#include "calib/calibrate/misfit_views.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/calibrate/plausibility.h"
#include "calib/uncertainty/motion_in_time.h"
#include "data/numbers/chi_square.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

/// Squared length of each correction in its own noise levels: near chi-square with six degrees of freedom. No
/// robot is taken to be better than 0.1 mm and 0.1 mrad.
std::vector<double> squared_corrections(const Refinement& refined) {
  constexpr double kLeast = 1e-4;
  std::vector<double> squared;
  for (const RobotPose& pose : refined.bundle.poses) {
    const auto arm = static_cast<std::size_t>(pose.arm);
    const Eigen::Vector3d& pivot = refined.bundle.pivots[arm];
    squared.push_back((pose.correction * pivot - pivot).squaredNorm() /
                          std::pow(std::max(kLeast, refined.noise.translation[arm]), 2) +
                      rotation_log(pose.correction.linear()).squaredNorm() /
                          std::pow(std::max(kLeast, refined.noise.rotation[arm]), 2));
  }
  return squared;
}

/// Probability that Fisher's F with six and `dof` degrees of freedom is larger (Abramowitz and
/// Stegun 26.6.4).
double tail_of_f6(double f, double dof) {
  const double a = 0.5 * dof, x = dof / (dof + 6 * f), y = 1 - x;
  return std::pow(x, a) * (1 + a * y + 0.5 * a * (a + 1) * y * y);
}

std::string counted(std::ptrdiff_t count, const char* one, const char* more) {
  return std::to_string(count) + (count == 1 ? one : more);
}

/// How the views in use close, in the middle.
ClosingError usual_error(const std::vector<ViewVerdict>& views) {
  std::vector<double> rotations, translations;
  for (const ViewVerdict& view : views) {
    if (!view.used) continue;
    rotations.push_back(view.error.rotation);
    translations.push_back(view.error.translation);
  }
  return {data::median(rotations), data::median(translations)};
}

/// The picture belongs to another pose: the view closes worse than is usual by what no arm errs.
bool of_another_pose(const ClosingError& error, const ClosingError& usual) {
  const ArmNoise arm;
  return error.translation - usual.translation > std::sqrt(3) * arm.doubtful_m ||
         error.rotation - usual.rotation > std::sqrt(3) * arm.doubtful_rad;
}

}  // namespace

bool drop_worst(Calibration& result, std::vector<Observation>& observations, double surprise) {
  const std::vector<double> squared = squared_corrections(result.refined);
  const auto worst = static_cast<std::size_t>(
      std::distance(squared.begin(), std::max_element(squared.begin(), squared.end())));
  const double usual = std::max(data::median(squared) / data::chi_square_50_of_6, 1e-12);
  // The corrections of few views share twelve unknowns with their own noise levels.
  surprise *= std::pow(1 + 8 / std::max(1.0, 6 * static_cast<double>(squared.size()) - 12), 2);
  // Corrections far inside the corner noise say nothing.
  if (squared[worst] < surprise * std::max(usual, 0.05)) return false;
  const Vector6d xi =
      motion_between(Eigen::Isometry3d::Identity(), result.refined.bundle.poses[worst].correction);
  char text[160];
  std::snprintf(
      text, sizeof text,
      "would need its robot pose corrected by %.2f deg and %.1f mm, %.0f times what most views need",
      xi.tail<3>().norm() / kDegree, 1e3 * xi.head<3>().norm(), std::sqrt(squared[worst] / (6 * usual)));
  ViewVerdict& verdict = result.selection.views[static_cast<std::size_t>(result.used[worst])];
  verdict.used = false;
  verdict.misfit = true;
  verdict.reason = text;
  observations.erase(observations.begin() + static_cast<std::ptrdiff_t>(worst));
  result.used.erase(result.used.begin() + static_cast<std::ptrdiff_t>(worst));
  return true;
}

bool readmit(Calibration& result, std::vector<Observation>& observations, const Eigen::Matrix3Xd& points,
             const BundleSettings& settings) {
  constexpr double kChance = 0.005;  // of a recording that it loses a view that is as good as the others
  if (!MotionInTime::applies(result.refined.bundle, settings)) return false;
  // Of the robot's rotations, or translations: three a pose, less half of the twelve of X and Z.
  const double dof = std::max(1.0, 3 * static_cast<double>(result.used.size()) - 6);
  std::size_t seen = 0;
  for (const ViewVerdict& verdict : result.selection.views) seen += verdict.used || verdict.misfit;
  bool any = false;
  for (std::size_t i = 0; i < result.selection.views.size(); ++i) {
    ViewVerdict& verdict = result.selection.views[i];
    if (verdict.used || !verdict.misfit) continue;
    Refinement with_view = result.refined;
    append_view(with_view.bundle, points, result.selection.observations[i]);
    std::vector<double> alone(with_view.bundle.poses.size(), 0);
    alone.back() = 1;
    const double misfit = MotionInTime(with_view, settings).misfit(alone);
    if (static_cast<double>(seen) * tail_of_f6(misfit / 6, dof) < kChance) continue;
    verdict.used = any = true;
    verdict.misfit = false;
    verdict.reason.clear();
  }
  if (any) observations = used_observations(result.selection, &result.used);
  return any;
}

std::string misfit_sentence(const ViewSelection& selection) {
  constexpr std::ptrdiff_t kBlunders = 10;  // one view in so many is a slip now and then
  const ClosingError usual = usual_error(selection.views);
  std::ptrdiff_t misfits = 0, others = 0;
  for (const ViewVerdict& view : selection.views) {
    if (view.used || !view.misfit) continue;
    ++misfits;
    others += of_another_pose(view.error, usual);
  }
  if (misfits < 2 || misfits * kBlunders <= std::ssize(selection.views)) return {};
  std::string text;
  if (others > 0)
    text = counted(
        others,
        " view is off by more than any arm errs: its picture belongs to another pose, or its pose is wrong",
        " views are off by more than any arm errs: their pictures belong to other poses, or their poses are "
        "wrong");
  if (misfits > others)
    text += (others > 0 ? "; " : "") +
            counted(misfits - others, " view is off by little, and may be a good one",
                    " views are off by little: too many for slips, and perhaps good views") +
            " that an arm whose model is wrong has lost; then the stated deviations are too small";
  return text;
}

}  // namespace flash::calib
