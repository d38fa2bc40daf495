#include "calib/calibrate/moving_rig.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>

#include "calib/uncertainty/motion_in_time.h"
#include "data/error.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

/// The views of one side of a knock; the others are left without a pose of the target.
std::vector<Observation> side_of(std::vector<Observation> views, std::size_t first, bool before) {
  for (std::size_t i = 0; i < views.size(); ++i)
    if ((i < first) != before) views[i].T_camera_target.clear();
  return views;
}

const char* mover(bool camera, bool told) {
  if (!told) return "camera or the target";
  return camera ? "camera" : "target";
}

std::string knock_sentence(const KnockedPart& other, std::size_t used) {
  const Knock& knock = other.knock;
  char text[400];
  std::snprintf(
      text, sizeof text,
      "the %s moved by %.1f mm and %.2f deg before %s: the answer is of the %zu views %s; the %d views %s "
      "were %s%s",
      mover(knock.camera, knock.told), 1e3 * knock.motion.head<3>().norm(),
      knock.motion.tail<3>().norm() / kDegree, other.view.c_str(), used,
      other.before ? "since" : "until then", other.views, other.before ? "until then" : "since",
      other.poses ? "solved by themselves" : "too few for a solution",
      other.before || (knock.told && !knock.camera) ? "" : ": where the camera is now is not known");
  return text;
}

/// Views that were left out one by one are a knock if they are the last ones: the answer is then of the past.
void doubt_last_views(Calibration& result, const std::vector<Observation>& all) {
  constexpr std::size_t kTold = 2, kUnusable = 3;
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (!all[i].T_camera_target.empty()) seen.push_back(i);
  std::size_t last = 0;
  while (last < seen.size() && result.selection.views[seen[seen.size() - 1 - last]].misfit) ++last;
  const auto before = static_cast<double>(seen.size() - last);
  const double left_out = before - static_cast<double>(result.used.size());
  constexpr double kUsual = 0.1;  // share of views that are left out anyway
  if (last < kTold || left_out > kUsual * before) return;
  result.warnings.insert(result.warnings.begin(),
                         "the last " + std::to_string(last) +
                             " views do not close with those before: if camera or target moved before " +
                             all[seen[seen.size() - last]].image +
                             ", the answer is of where they were; record anew, or take these views out");
  if (last >= kUnusable) result.usable = false;
}

/// Of a view in time: -1 for the first of all, 0 for the last.
double time_of(std::size_t view, std::size_t count) {
  return static_cast<double>(view) / static_cast<double>(count - 1) - 1;
}

std::vector<double> times_of(const Calibration& result) {
  std::vector<double> times;
  for (const int view : result.used)
    times.push_back(time_of(static_cast<std::size_t>(view), result.views.size()));
  return times;
}

std::optional<Drift> drift_of(const Calibration& result, double rival) {
  return find_drift(result.refined, {.unknowns = result.unknowns}, times_of(result), rival);
}

/// The views as they would be had camera and target stood where they are at the last one. A motion of the
/// camera by m, right of X, and one of the robot are the same: G X m = (G X m X^-1) X.
std::vector<Observation> without_drift(std::vector<Observation> views, const Calibration& result,
                                       const Drift& drift) {
  const Eigen::Isometry3d& T = drift.camera ? result.poses.X : result.poses.Z;
  const bool in_hand = result.setup == Setup::eye_in_hand;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double sign = drift.camera == in_hand ? 1 : -1;
    const Eigen::Isometry3d motion =
        T * moved(Eigen::Isometry3d::Identity(), sign * time_of(i, views.size()) * drift.motion) *
        T.inverse();
    Eigen::Isometry3d& G = views[i].T_base_gripper;
    G = drift.camera == in_hand ? G * motion : motion * G;
  }
  return views;
}

/// Of a drift that was solved for, what is not known: how far it went, and that it need not have kept its
/// speed.
void add_drift(Calibration& result, const Drift& drift) {
  const MotionInTime motions(result.refined, {.unknowns = result.unknowns});
  const std::vector<double> times = times_of(result);
  std::vector<double> bends;  // between a constant speed and one that ends, or starts, at zero
  for (const double t : times) bends.push_back(t * (1 + t));
  constexpr double kBend = 0.5;  // standard deviation: twice that is a speed that ends at zero
  const Vector6d shift = kBend * motions.shift_of_camera(bends, times, drift.camera) * drift.motion;
  const Matrix6d more = motions.growth(times, drift.camera) + shift * shift.transpose();
  result.covariance += more;
  result.repeatable += more;
}

/// A drift that is no larger than what an arm may do is not taken out: it may as well be the robot's. The
/// answer is then of the middle of the recording, and the stated deviations hold where it went from there. It
/// is told where it is all but certain, and moves the answer by as much as is stated anyway.
void add_slow_drift(Calibration& result, double rival) {
  constexpr double kCertain = 0.95;
  const SlowDrift drift = slow_drift(result.refined, {.unknowns = result.unknowns}, times_of(result), rival);
  const double grown = result.covariance.ldlt().solve(drift.covariance).trace();
  result.covariance += drift.covariance;
  result.repeatable += drift.covariance;
  if (drift.probability < kCertain || grown < 1) return;
  char text[320];
  std::snprintf(
      text, sizeof text,
      "camera, target or robot moved slowly, by %.1f mm and %.2f deg from the first view to the last: "
      "that was added to the stated standard deviations; look for what is loose, or let the arm warm up",
      1e3 * drift.motion.head<3>().norm(), drift.motion.tail<3>().norm() / kDegree);
  result.warnings.insert(result.warnings.begin(), text);
}

std::string drift_sentence(const Drift& drift, bool depends) {
  char text[400];
  std::snprintf(
      text, sizeof text,
      "the %s moved all the time, by %.1f mm and %.2f deg from the first view to the last: the answer "
      "is of where it was at the last one, if it kept its speed%s",
      mover(drift.camera, drift.told), 1e3 * drift.motion.head<3>().norm(),
      drift.motion.tail<3>().norm() / kDegree, depends ? "; fix what is loose and record anew" : "");
  return text;
}

/// The answer with the drift solved for: its motion as seen at first, then what is left of it.
Calibration solve_drifting(Calibration whole, Drift drift, const std::vector<Observation>& all,
                           const StillSolver& solve) {
  constexpr double kChiSquare999 = 22.46;  // six degrees of freedom
  constexpr int kRounds = 3;
  constexpr double kLittle = 0.02;  // of the motion
  Calibration answer = whole;
  try {
    for (int round = 0; round < kRounds; ++round) {
      answer = solve(without_drift(all, answer, drift));
      const MotionInTime motions(answer.refined, {.unknowns = answer.unknowns});
      const Vector6d left = motions.fit({times_of(answer)}, drift.camera).motion;
      drift.motion += left;
      if (left.norm() < kLittle * drift.motion.norm()) break;
    }
  } catch (const data::InputError&) {
    whole.usable = false;
    whole.warnings.insert(whole.warnings.begin(), drift_sentence(drift, true));
    return whole;
  }
  add_drift(answer, drift);
  const Vector6d away = motion_between(answer.poses.X, whole.poses.X);
  const bool depends =
      drift.camera || !drift.told || away.dot(answer.covariance.ldlt().solve(away)) > kChiSquare999;
  if (depends) answer.usable = false;
  answer.warnings.insert(answer.warnings.begin(), drift_sentence(drift, depends));
  answer.drift = drift;
  return answer;
}

}  // namespace

Calibration calibrate_moving(const std::vector<Observation>& all, const StillSolver& solve) {
  Calibration whole = solve(all);
  doubt_last_views(whole, all);
  if (!whole.pose_errors) return whole;
  const double rival = whole.pose_errors->gain;
  const std::optional<Knock> knock = find_knock(whole.refined, {.unknowns = whole.unknowns}, rival);
  const std::optional<Drift> drift = drift_of(whole, rival);
  const bool drifts = drift && (!knock || drift->gain > knock->second);
  if (drifts && beyond_usual(whole.refined.bundle, drift->motion))
    return solve_drifting(whole, *drift, all, solve);
  if (drifts || !knock) {
    add_slow_drift(whole, rival);
    return whole;
  }
  const auto first = static_cast<std::size_t>(whole.used[knock->pose]);
  const std::size_t after = whole.used.size() - knock->pose;
  // What holds now counts, unless it is hardly known.
  constexpr std::size_t kEnough = 6;
  KnockedPart other{.knock = *knock, .view = all[first].image, .before = after >= kEnough};
  Calibration answer;
  try {  // the part may have been knocked as well
    answer = calibrate_moving(side_of(all, first, !other.before), solve);
  } catch (const data::InputError&) {
    return whole;  // a part alone may turn about one axis only
  }
  other.views = static_cast<int>(other.before ? knock->pose : after);
  try {
    other.poses = solve(side_of(all, first, other.before)).poses;
  } catch (const data::InputError&) {
    // said in the sentence
  }
  // Who asks where the camera is now is not served by where it was.
  if (!other.before && (knock->camera || !knock->told)) answer.usable = false;
  for (std::size_t i = 0; i < all.size(); ++i)
    if ((i < first) == other.before && !all[i].T_camera_target.empty())
      answer.views[i].reason = answer.selection.views[i].reason =
          std::string(other.before ? "before" : "after") + " the knock at " + other.view;
  answer.warnings.insert(answer.warnings.begin(), knock_sentence(other, answer.used.size()));
  if (!answer.other_part) answer.other_part = std::move(other);  // else that next to the answer
  return answer;
}

}  // namespace flash::calib
