#include "calib/calibrate/moving_rig.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>

#include "calib/uncertainty/end_knock.h"
#include "calib/uncertainty/motion_in_time.h"
#include "data/files/error.h"
#include "data/numbers/chi_square.h"

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

/// Views that were left out one by one may be a knock if they are the last ones: the answer is then of the
/// past. knock: probability of one near the ends, where that could be asked.
void doubt_last_views(Calibration& result, const std::vector<Observation>& all, std::optional<double> knock) {
  constexpr std::size_t kUnusable = 3;
  constexpr double kUnlikely = 0.05;
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (!all[i].T_camera_target.empty()) seen.push_back(i);
  std::size_t last = 0;
  while (last < seen.size() && result.selection.views[seen[seen.size() - 1 - last]].misfit) ++last;
  const auto before = static_cast<double>(seen.size() - last);
  const double left_out = before - static_cast<double>(result.used.size());
  constexpr double kUsual = 0.1;  // share of views that are left out anyway
  if (last == 0 || left_out > kUsual * before) return;
  const bool unlikely = last <= static_cast<std::size_t>(kEndViews) && knock && *knock < kUnlikely;
  const std::string& first = all[seen[seen.size() - last]].image;
  if (last == 1)  // one view is as likely wrong by itself
    return tell_first(result,
                      "the last view does not close with those before: its pose is wrong, or camera or "
                      "target moved before " +
                          first + ", and the answer is of where they were; take more views to know");
  tell_first(result,
             "the last " + std::to_string(last) +
                 " views do not close with those before: if camera or target moved before " + first +
                 ", the answer is of where they were; record anew, or take these views out",
             last >= kUnusable && !unlikely);
}

/// What a motion, known or not, leaves unknown of where the camera is.
void add_motion(Calibration& result, const Matrix6d& covariance) {
  result.covariance += covariance;
  result.repeatable += covariance;
  result.motion_covariance += covariance;
}

/// A size that was to be kept and is another makes errors that look like motions: here it is an unknown.
BundleSettings judged_with(const Calibration& result) {
  BundleSettings settings{.unknowns = result.unknowns};
  settings.unknowns.scales = true;
  return settings;
}

/// Of all views in time: -1 for the first, 0 for the last. A copy has the time of what it is a copy of.
std::vector<double> times_of_views(const Calibration& result) {
  const std::vector<ViewVerdict>& views = result.selection.views;
  std::vector<double> times;
  double count = 0;
  for (const ViewVerdict& view : views)
    times.push_back(view.copy_of < 0 ? count++ : times[static_cast<std::size_t>(view.copy_of)]);
  for (double& time : times) time = time / (count - 1) - 1;
  return times;
}

/// Of the views in use.
std::vector<double> times_of(const Calibration& result) {
  const std::vector<double> all = times_of_views(result);
  std::vector<double> times;
  for (const int view : result.used) times.push_back(all[static_cast<std::size_t>(view)]);
  return times;
}

std::optional<Drift> drift_of(const Calibration& result, double rival) {
  return find_drift(result.refined, judged_with(result), times_of(result), rival);
}

/// The views as they would be had camera and target stood where they are at the last one. A motion of the
/// camera by m, right of X, and one of the robot are the same: G X m = (G X m X^-1) X.
std::vector<Observation> without_drift(std::vector<Observation> views, const Calibration& result,
                                       const Drift& drift) {
  const Eigen::Isometry3d& T = drift.camera ? result.poses.X : result.poses.Z;
  const bool in_hand = result.setup == Setup::eye_in_hand;
  const std::vector<double> times = times_of_views(result);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double sign = drift.camera == in_hand ? 1 : -1;
    const Eigen::Isometry3d motion =
        T * moved(Eigen::Isometry3d::Identity(), sign * times[i] * drift.motion) * T.inverse();
    Eigen::Isometry3d& G = views[i].T_base_gripper;
    G = drift.camera == in_hand ? G * motion : motion * G;
  }
  return views;
}

/// Of a drift that was solved for, what is not known: how far it went, and that it need not have kept its
/// speed.
void add_drift(Calibration& result, const Drift& drift) {
  const MotionInTime motions(result.refined, judged_with(result));
  const std::vector<double> times = times_of(result);
  std::vector<double> bends;  // between a constant speed and one that ends, or starts, at zero
  for (const double t : times) bends.push_back(t * (1 + t));
  constexpr double kBend = 0.5;  // standard deviation: twice that is a speed that ends at zero
  const Vector6d shift = kBend * motions.shift_of_camera(bends, times, drift.camera) * drift.motion;
  add_motion(result, motions.growth(times, drift.camera) + shift * shift.transpose());
}

/// A drift that is no larger than what an arm may do is not taken out: it may as well be the robot's. The
/// answer is then of the middle of the recording, and the stated deviations hold where it went from there. It
/// is told where it is all but certain, and moves the answer by as much as is stated anyway.
void add_slow_drift(Calibration& result, double rival) {
  constexpr double kCertain = 0.95;
  const SlowDrift drift = slow_drift(result.refined, judged_with(result), times_of(result), rival);
  const double grown = result.covariance.ldlt().solve(drift.covariance).trace();
  add_motion(result, drift.covariance);
  if (drift.probability < kCertain || grown < 1) return;
  char text[320];
  std::snprintf(
      text, sizeof text,
      "camera, target or robot moved slowly, by %.1f mm and %.2f deg from the first view to the last: "
      "that was added to the stated standard deviations; look for what is loose, or let the arm warm up",
      1e3 * drift.motion.head<3>().norm(), drift.motion.tail<3>().norm() / kDegree);
  tell_first(result, text);
}

std::string drift_sentence(const Drift& drift, bool depends, const std::string& knocked) {
  char text[600];
  std::snprintf(
      text, sizeof text,
      "the %s moved all the time, by %.1f mm and %.2f deg from the first view to the last: the answer "
      "is of where it was at the last one, if it kept its speed%s%s%s",
      mover(drift.camera, drift.told), 1e3 * drift.motion.head<3>().norm(),
      drift.motion.tail<3>().norm() / kDegree, knocked.empty() ? "" : "; one knock before ",
      knocked.empty() ? "" : (knocked + " explains it nearly as well").c_str(),
      depends ? "; fix what is loose and record anew" : "");
  return text;
}

/// The answer with the drift solved for: its motion as seen at first, then what is left of it.
/// knocked: the view before which one knock would explain it nearly as well, if there is one.
Calibration solve_drifting(Calibration whole, Drift drift, const std::vector<Observation>& all,
                           const std::string& knocked, const StillSolver& solve) {
  constexpr int kRounds = 3;
  constexpr double kLittle = 0.02;  // of the motion
  Calibration answer = whole;
  try {
    for (int round = 0; round < kRounds; ++round) {
      answer = solve(without_drift(all, answer, drift));
      const MotionInTime motions(answer.refined, judged_with(answer));
      const Vector6d left = motions.fit({times_of(answer)}, drift.camera).motion;
      drift.motion += left;
      if (left.norm() < kLittle * drift.motion.norm()) break;
    }
  } catch (const data::InputError&) {
    tell_first(whole, drift_sentence(drift, true, knocked), true);
    return whole;
  }
  add_drift(answer, drift);
  const Vector6d away = motion_between(answer.poses.X, whole.poses.X);
  const bool depends = drift.camera || !drift.told ||
                       away.dot(answer.covariance.ldlt().solve(away)) > data::chi_square_999_of_6;
  tell_first(answer, drift_sentence(drift, depends, knocked), depends);
  answer.drift = drift;
  return answer;
}

/// The solution's poses, and those of views that were left out near the ends. views: that are numbered in
/// time.
TimedPoses timed_poses(const Calibration& result, const std::vector<Observation>& all,
                       const Eigen::Matrix3Xd& points, std::vector<int>& views) {
  std::vector<int> time(all.size(), -1);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const ViewVerdict& verdict = result.selection.views[i];
    if (!verdict.used && !verdict.misfit) continue;
    time[i] = static_cast<int>(views.size());
    views.push_back(static_cast<int>(i));
  }
  TimedPoses poses;
  poses.refined = result.refined;
  poses.used = result.used.size();
  poses.shared = std::sqrt(result.pose_errors.share) * result.pose_errors.rotation;
  for (const int view : result.used) poses.time.push_back(time[static_cast<std::size_t>(view)]);
  const int count = static_cast<int>(views.size());
  for (int k = 0; k < count; ++k) {
    const auto view = static_cast<std::size_t>(views[static_cast<std::size_t>(k)]);
    if (result.selection.views[view].used || (k >= kEndViews && k < count - kEndViews)) continue;
    append_view(poses.refined.bundle, points, result.selection.observations[view]);
    poses.time.push_back(k);
  }
  poses.left_out.assign(poses.time.size(), 1);
  std::fill_n(poses.left_out.begin(), poses.used, 0);
  return poses;
}

/// The answer of the views on one side of a knock. first: the first view after it.
Calibration solve_knocked(const Calibration& whole, const Knock& knock, std::size_t first,
                          const std::vector<Observation>& all, const Eigen::Matrix3Xd& points,
                          const StillSolver& solve) {
  std::size_t before = 0, after = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const ViewVerdict& verdict = whole.selection.views[i];
    if (verdict.used || verdict.misfit) ++(i < first ? before : after);
  }
  // What holds now counts, unless it is hardly known.
  constexpr std::size_t kEnough = 6;
  KnockedPart other{.knock = knock, .view = all[first].image, .before = after >= kEnough};
  Calibration answer;
  try {  // the part may have been knocked as well
    answer = calibrate_moving(side_of(all, first, !other.before), points, solve);
  } catch (const data::InputError& error) {  // a part alone may hardly turn
    answer = whole;
    char text[200];
    std::snprintf(text, sizeof text,
                  "the %s moved by %.1f mm and %.2f deg before %s, and the views %s then alone do not do: ",
                  mover(knock.camera, knock.told), 1e3 * knock.motion.head<3>().norm(),
                  knock.motion.tail<3>().norm() / kDegree, other.view.c_str(),
                  other.before ? "since" : "until");
    tell_first(answer, text + std::string(error.what()), true);
    return answer;
  }
  other.views = static_cast<int>(other.before ? before : after);
  try {
    other.poses = solve(side_of(all, first, other.before)).poses;
  } catch (const data::InputError&) {
    // said in the sentence
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    if ((i < first) == other.before && !all[i].T_camera_target.empty())
      answer.views[i].reason = answer.selection.views[i].reason =
          std::string(other.before ? "before" : "after") + " the knock at " + other.view;
  // Who asks where the camera is now is not served by where it was.
  const bool past = !other.before && (knock.camera || !knock.told);
  tell_first(answer, knock_sentence(other, answer.used.size()), past);
  if (!answer.other_part) answer.other_part = std::move(other);  // else that next to the answer
  return answer;
}

}  // namespace

Calibration calibrate_moving(const std::vector<Observation>& all, const Eigen::Matrix3Xd& points,
                             const StillSolver& solve) {
  Calibration whole = solve(all);
  const double rival = whole.pose_errors.gain;
  const BundleSettings settings = judged_with(whole);
  const std::optional<Knock> knock = find_knock(whole.refined, settings, rival);
  const std::optional<Drift> drift = drift_of(whole, rival);
  std::vector<int> views;
  const TimedPoses poses = timed_poses(whole, all, points, views);
  const EndKnock end = find_end_knock(poses, settings);
  doubt_last_views(whole, all, end.probability);
  const bool drifts = drift && (!knock || drift->gain > knock->second);
  if (end.knock && end.knock->gain > (drifts ? drift->gain : knock ? knock->gain : 0))
    return solve_knocked(whole, *end.knock, static_cast<std::size_t>(views[end.knock->pose]), all, points,
                         solve);
  if (drifts && beyond_usual(whole.refined.bundle, drift->motion)) {
    constexpr double kNearly = 6;  // of -2 log likelihood: twenty times less likely
    std::string knocked;
    if (knock && drift->gain - knock->gain < kNearly)
      knocked = all[static_cast<std::size_t>(whole.used[knock->pose])].image;
    return solve_drifting(whole, *drift, all, knocked, solve);
  }
  if (drifts || !knock) {
    add_slow_drift(whole, rival);
    add_motion(whole, end.covariance);
    return whole;
  }
  return solve_knocked(whole, *knock, static_cast<std::size_t>(whole.used[knock->pose]), all, points, solve);
}

}  // namespace flash::calib
