#include "calib/solve/view_selection.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/dataset/same_picture.h"
#include "calib/geometry/pose.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

/// The same pair of poses twice, of a set without pictures.
bool same_pair(const Observation& a, const Observation& b) {
  constexpr double kSame = 1e-12;
  const auto at_one_place = [](const Eigen::Isometry3d& p, const Eigen::Isometry3d& q) {
    return (p.translation() - q.translation()).cwiseAbs().maxCoeff() < kSame;
  };
  return a.pixels.cols() == 0 && b.pixels.cols() == 0 && !a.T_camera_target.empty() &&
         !b.T_camera_target.empty() && at_one_place(a.T_base_gripper, b.T_base_gripper) &&
         motion_between(a.T_base_gripper, b.T_base_gripper).cwiseAbs().maxCoeff() < kSame &&
         motion_between(a.T_camera_target.front(), b.T_camera_target.front()).cwiseAbs().maxCoeff() < kSame;
}

void drop(ViewVerdict& view, std::string reason) {
  view.used = false;
  view.reason = std::move(reason);
}

void drop_unusable(const std::vector<Observation>& observations, std::vector<ViewVerdict>& views) {
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (observations[i].T_camera_target.empty()) drop(views[i], "the target was not found");
    for (std::size_t j = 0; j < i && views[i].used; ++j) {
      if (!views[j].used) continue;
      const bool pair = same_pair(observations[i], observations[j]);
      if (!pair && !of_same_picture(observations[i], observations[j])) continue;
      const bool moved_robot = motion_between(observations[i].T_base_gripper, observations[j].T_base_gripper)
                                   .cwiseAbs()
                                   .maxCoeff() > 1e-6;
      if (!moved_robot) views[i].copy_of = static_cast<int>(j);
      drop(views[i], moved_robot ? "the same picture as " + observations[j].image + ", but another robot pose"
                                 : "a copy of " + observations[j].image);
    }
  }
}

// Without noise everything closes to rounding.
constexpr double kExact = 1e-5;

bool closes(const ClosingError& error, const ClosingError& usual, double factor) {
  return error.rotation <= factor * usual.rotation + kExact &&
         error.translation <= factor * usual.translation + kExact;
}

std::string closing_reason(const ClosingError& error, const ClosingError& usual) {
  char text[200];
  std::snprintf(
      text, sizeof text,
      "closes to %.2f deg and %.1f mm where most views close to %.2f deg and %.1f mm: its robot pose "
      "or its corners are wrong",
      error.rotation * 180 / M_PI, 1e3 * error.translation, usual.rotation * 180 / M_PI,
      1e3 * usual.translation);
  return text;
}

/// robot: G of PoseLoop; candidates: of find_robust_seed; share: of the views that the seed rests on.
void drop_outliers(const RobustSeed& robust_seed, const std::vector<Eigen::Isometry3d>& robot,
                   const std::vector<std::vector<Eigen::Isometry3d>>& candidates, double factor, double share,
                   std::vector<ViewVerdict>& views) {
  std::vector<double> rotations, translations;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!views[i].used) continue;
    rotations.push_back(robust_seed.errors[i].rotation);
    translations.push_back(robust_seed.errors[i].translation);
  }
  const ClosingError usual{data::median(rotations), data::median(translations)};
  // The majority on which the seed rests closes by its twelve unknowns as well: of few views it looks better
  // than it is. The ratio grows about as the 99.9 % point of F with 6 and so many degrees of freedom.
  const double majority = std::ceil(share * static_cast<double>(rotations.size()));
  factor *= 1 + 8 / std::max(1.0, 6 * majority - 12);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ClosingError& error = robust_seed.errors[i];
    views[i].error = error;
    if (!views[i].used || closes(error, usual, factor)) continue;
    // As cameras turn pictures by what they take for upright.
    const Eigen::Isometry3d half_turn(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
    const bool turned =
        std::any_of(candidates[i].begin(), candidates[i].end(), [&](const Eigen::Isometry3d& C) {
          return closes(closing_error({robot[i], half_turn * C}, robust_seed.poses), usual, factor);
        });
    drop(views[i], turned ? "the picture is turned by 180 deg" : closing_reason(error, usual));
    views[i].misfit = !turned;
  }
}

std::size_t most_common(const std::vector<ViewVerdict>& views, std::size_t symmetries) {
  std::vector<int> votes(symmetries, 0);
  for (const ViewVerdict& view : views) votes[static_cast<std::size_t>(view.symmetry)] += view.used ? 1 : 0;
  return static_cast<std::size_t>(std::max_element(votes.begin(), votes.end()) - votes.begin());
}

/// The symmetry that turns as the one of that index, followed by the inverse of `common`.
int quotient(const std::vector<Symmetry>& symmetries, std::size_t index, const Symmetry& common) {
  const auto found = std::find_if(symmetries.begin(), symmetries.end(), [&](const Symmetry& symmetry) {
    for (std::size_t i = 0; i < common.permutation.size(); ++i)
      if (common.permutation[static_cast<std::size_t>(symmetry.permutation[i])] !=
          symmetries[index].permutation[i])
        return false;
    return true;
  });
  return static_cast<int>(found - symmetries.begin());
}

}  // namespace

ViewSelection select_views(Setup setup, const std::vector<Observation>& observations,
                           const std::vector<Symmetry>& symmetries, const ViewSelectionSettings& settings) {
  ViewSelection selection;
  selection.views.resize(observations.size());
  selection.observations = observations;
  drop_unusable(observations, selection.views);

  // Candidates of a view: every pose in every numbering, T turn^-1.
  std::vector<Eigen::Isometry3d> robot;
  std::vector<std::vector<Eigen::Isometry3d>> candidates(observations.size());
  for (std::size_t i = 0; i < observations.size(); ++i) {
    robot.push_back(pose_loop(setup, observations[i].T_base_gripper, Eigen::Isometry3d::Identity()).G);
    if (!selection.views[i].used) continue;
    for (const Symmetry& symmetry : symmetries)
      for (const Eigen::Isometry3d& T : observations[i].T_camera_target)
        candidates[i].push_back(T * symmetry.turn.inverse());
  }
  selection.robust_seed = find_robust_seed(robot, candidates, settings.robust_seed);
  if (!selection.robust_seed.found) return selection;

  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!selection.views[i].used) continue;
    const auto choice = static_cast<std::size_t>(selection.robust_seed.choice[i]);
    selection.views[i].symmetry = static_cast<int>(choice / observations[i].T_camera_target.size());
  }
  // All views turned alike close as well: most keep the numbering of their detector.
  const RobustSeed as_found = selection.robust_seed;
  const Symmetry& common = symmetries[most_common(selection.views, symmetries.size())];
  selection.robust_seed.poses.Z = selection.robust_seed.poses.Z * common.turn;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    ViewVerdict& view = selection.views[i];
    if (!view.used) continue;
    view.symmetry = quotient(symmetries, static_cast<std::size_t>(view.symmetry), common);
    const Symmetry& symmetry = symmetries[static_cast<std::size_t>(view.symmetry)];
    for (int& point : selection.observations[i].points)
      point = symmetry.permutation[static_cast<std::size_t>(point)];
    const auto choice = static_cast<std::size_t>(selection.robust_seed.choice[i]);
    selection.observations[i].T_camera_target = {candidates[i][choice] * common.turn};
  }
  drop_outliers(as_found, robot, candidates, settings.outlier, settings.robust_seed.majority,
                selection.views);
  selection.renumbered = static_cast<int>(
      std::count_if(selection.views.begin(), selection.views.end(),
                    [](const ViewVerdict& view) { return view.used && view.symmetry != 0; }));
  return selection;
}

std::vector<Observation> used_observations(const ViewSelection& selection, std::vector<int>* index) {
  std::vector<Observation> used;
  if (index) index->clear();
  for (std::size_t i = 0; i < selection.views.size(); ++i) {
    if (!selection.views[i].used) continue;
    used.push_back(selection.observations[i]);
    if (index) index->push_back(static_cast<int>(i));
  }
  return used;
}

}  // namespace flash::calib
