#include "calib/calibrate/cell.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "calib/calibrate/cell_check.h"
#include "calib/calibrate/cell_misfits.h"
#include "calib/solve/linearization.h"
#include "calib/uncertainty/view_disagreement.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::calib {
namespace {

/// Names in the order in which they come.
std::vector<std::string> names_of(const std::vector<CellMember>& members, std::string CellMember::*name) {
  std::vector<std::string> names;
  for (const CellMember& member : members)
    if (std::find(names.begin(), names.end(), member.*name) == names.end()) names.push_back(member.*name);
  return names;
}

std::size_t index_of(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::distance(names.begin(), std::find(names.begin(), names.end(), name)));
}

/// The member with its target turned so that its Z lies nearest to `target`: cameras on two sides of a plain
/// board number it from different ends, each without a contradiction of its own.
CellMember aligned(CellMember member, const Eigen::Isometry3d& target, std::vector<std::string>* notices) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s < member.symmetries.size(); ++s) {
    const Eigen::Isometry3d turned = member.poses.Z * member.symmetries[s].turn.inverse();
    const double angle = rotation_angle(turned.linear().transpose() * target.linear());
    if (angle >= least) continue;
    least = angle;
    best = s;
  }
  if (best == 0) return member;
  const Symmetry& symmetry = member.symmetries[best];
  member.poses.Z = member.poses.Z * symmetry.turn.inverse();
  for (Observation& observation : member.observations) {
    for (int& point : observation.points) point = symmetry.permutation[static_cast<std::size_t>(point)];
    for (Eigen::Isometry3d& T : observation.T_camera_target) T = T * symmetry.turn.inverse();
  }
  if (notices)
    notices->push_back(member.camera +
                       " numbers the target from its other end than the first camera; turned");
  return member;
}

/// Places of arms and cameras in the world, filled in as members connect them.
struct Layout {
  std::vector<std::optional<Eigen::Isometry3d>> bases, cameras, targets;
};

/// eye-to-hand: C = B X, Z of the arm. eye-in-hand: C = X, and the target, one for all, stands at B Z.
void place(const CellMember& member, std::size_t arm, std::size_t camera, Layout& layout) {
  std::optional<Eigen::Isometry3d>& B = layout.bases[arm];
  std::optional<Eigen::Isometry3d>& C = layout.cameras[camera];
  const bool in_hand = member.setup == Setup::eye_in_hand;
  std::optional<Eigen::Isometry3d>& Z = layout.targets[in_hand ? 0 : arm];
  if (in_hand) {
    if (!B && Z) B = *Z * member.poses.Z.inverse();
    if (!C) C = member.poses.X;
    if (!Z && B) Z = *B * member.poses.Z;
  } else {
    if (!B && C) B = *C * member.poses.X.inverse();
    if (!C && B) C = *B * member.poses.X;
    if (!Z) Z = member.poses.Z;
  }
}

/// Errors of joints, where all arms have their joints known: those of an arm are of its joints, or smooth.
/// sd: of each arm, beforehand; empty where its joints are not known.
void add_joint_errors(const std::vector<Eigen::VectorXd>& sd, Bundle& bundle,
                      std::vector<std::string>* notices) {
  const auto known =
      std::count_if(sd.begin(), sd.end(), [](const Eigen::VectorXd& of_arm) { return of_arm.size() > 0; });
  if (known == 0) return;
  if (known == static_cast<std::ptrdiff_t>(sd.size())) {
    bundle.joint_error_sd = sd;
    for (const Eigen::VectorXd& of_arm : sd)
      bundle.joint_errors.emplace_back(Eigen::VectorXd::Zero(of_arm.size()));
    return;
  }
  for (RobotPose& pose : bundle.poses) pose.joint_motions.resize(6, 0);
  if (notices) notices->emplace_back("joints are not known of all arms: the zeros of none are solved for");
}

/// What cameras or targets that may have moved leave unknown of where the frames are: of a camera what its
/// first member says, of a further base what its own first member and that of the first base say, as
/// composed.
void add_motions(Cell& cell, const std::vector<CellMember>& members, const std::vector<std::string>& arms,
                 const std::vector<std::string>& cameras) {
  const auto first = [&](std::string CellMember::*name, const std::string& value) -> const CellMember& {
    return *std::find_if(members.begin(), members.end(),
                         [&](const CellMember& member) { return member.*name == value; });
  };
  for (std::size_t a = 1; a < arms.size(); ++a) {
    const CellMember &arm = first(&CellMember::arm, arms[a]), &world = first(&CellMember::arm, arms.front());
    const Matrix6d carry = adjoint(arm.poses.X);
    cell.bases[a - 1].covariance +=
        carry * (arm.motion_covariance + world.motion_covariance) * carry.transpose();
  }
  for (std::size_t c = 0; c < cameras.size(); ++c)
    cell.cameras[c].covariance += first(&CellMember::camera, cameras[c]).motion_covariance;
}

/// The views that a calibration left out as they do not fit. Those next to a motion may be of either side of
/// it, and are none.
std::vector<std::size_t> misfits_of(const Calibration& calibration) {
  const std::vector<ViewVerdict>& views = calibration.selection.views;
  std::vector<bool> misfit;
  for (const ViewVerdict& view : views) misfit.push_back(view.misfit);
  for (std::size_t i = 0; calibration.other_part && i < views.size(); ++i) {
    if (calibration.selection.observations[i].image != calibration.other_part->view) continue;
    const bool before = calibration.other_part->before;
    for (std::size_t k = before ? i : i - 1; k < views.size() && misfit[k]; k += before ? 1 : -1)
      misfit[k] = false;
  }
  std::vector<std::size_t> list;
  for (std::size_t i = 0; i < misfit.size(); ++i)
    if (misfit[i]) list.push_back(i);
  return list;
}

}  // namespace

CellMember cell_member(const std::string& arm, const std::string& camera, const Dataset& dataset,
                       const Target& target, const Calibration& calibration) {
  CellMember member{.arm = arm, .camera = camera, .setup = calibration.setup, .intrinsics = *dataset.camera};
  if (has_pixels(calibration)) {
    member.intrinsics = calibration.refined.bundle.intrinsics.front();
    if (!calibration.refined.bundle.priors.lenses.empty())
      member.lens = calibration.refined.bundle.priors.lenses.front();
  }
  member.points = target_points(target);
  member.symmetries = confusable_symmetries(target);
  member.poses = calibration.poses;
  member.covariance = calibration.covariance;
  member.motion_covariance = calibration.motion_covariance;
  if (!calibration.refined.noise.corner.empty()) member.corner_px = calibration.refined.noise.corner.front();
  for (const int i : calibration.used) {
    const auto view = static_cast<std::size_t>(i);
    member.observations.push_back(calibration.selection.observations[view]);
    member.stamps.push_back(dataset.frames[view].stamp);
  }
  for (const std::size_t view : misfits_of(calibration))
    member.misfits.push_back({calibration.selection.observations[view].image, dataset.frames[view].stamp,
                              calibration.selection.observations[view].T_base_gripper});
  return member;
}

Bundle cell_bundle(const std::vector<CellMember>& members, std::vector<std::string>* notices) {
  const std::vector<std::string> arms = names_of(members, &CellMember::arm);
  const std::vector<std::string> cameras = names_of(members, &CellMember::camera);
  const bool in_hand = members.front().setup == Setup::eye_in_hand;
  Layout layout;
  layout.bases.resize(arms.size());
  layout.cameras.resize(cameras.size());
  layout.targets.resize(in_hand ? 1 : arms.size());
  layout.bases.front() = Eigen::Isometry3d::Identity();

  Bundle bundle;
  bundle.setup = members.front().setup;
  bundle.intrinsics.resize(cameras.size());
  bundle.priors.lenses.resize(cameras.size());
  bundle.priors.warp_sd.resize(layout.targets.size());
  bundle.priors.scale_sd.resize(layout.targets.size());
  std::vector<Eigen::VectorXd> joint_sd(arms.size());
  std::map<std::pair<std::size_t, double>, std::vector<int>> poses_at;
  for (const CellMember& given : members) {
    if (given.setup != bundle.setup)
      throw data::InputError(given.camera + ": found " + to_string(given.setup) + ", expected " +
                             to_string(bundle.setup) + " as of the first");
    const std::size_t arm = index_of(arms, given.arm), camera = index_of(cameras, given.camera);
    const std::size_t target = in_hand ? 0 : arm;
    const std::optional<Eigen::Isometry3d>& B = layout.bases[arm];
    const std::optional<Eigen::Isometry3d>& Z = layout.targets[target];
    const bool comparable = Z && (!in_hand || B);
    const CellMember member =
        comparable ? aligned(given, in_hand ? Eigen::Isometry3d(B->inverse() * *Z) : *Z, notices) : given;
    place(member, arm, camera, layout);
    if (!layout.bases[arm] || !layout.cameras[camera])
      throw data::InputError(given.arm + " and " + given.camera +
                             " have nothing in common with the arms and cameras before them");
    bundle.intrinsics[camera] = member.intrinsics;
    bundle.priors.lenses[camera] =
        member.lens.parts.empty() ? usual_lens_prior(member.intrinsics) : member.lens;
    bundle.priors.warp_sd[target] = usual_warp_sd(member.points);
    bundle.priors.scale_sd[target] = usual_size_sd(member.points);
    for (std::size_t i = 0; i < member.observations.size(); ++i) {
      const Observation& observation = member.observations[i];
      std::vector<int>& known = poses_at[{arm, member.stamps[i]}];
      const auto same = std::find_if(known.begin(), known.end(), [&](int k) {
        return same_pose(bundle.poses[static_cast<std::size_t>(k)].T_base_gripper,
                         observation.T_base_gripper);
      });
      const int place = same == known.end() ? static_cast<int>(bundle.poses.size()) : *same;
      if (same == known.end()) {
        known.push_back(place);
        RobotPose pose;
        pose.arm = static_cast<int>(arm);
        pose.T_base_gripper = observation.T_base_gripper;
        pose.joint_motions = observation.joint_motions;
        joint_sd[arm] = joint_error_sd(observation);
        bundle.poses.push_back(pose);
      }
      BundleView view = make_view(member.points, observation);
      view.pose = place;
      view.camera = static_cast<int>(camera);
      view.target = static_cast<int>(target);
      bundle.views.push_back(std::move(view));
    }
  }
  for (const auto& B : layout.bases) bundle.bases.push_back(*B);
  for (const auto& C : layout.cameras) bundle.cameras.push_back(*C);
  for (const auto& Z : layout.targets) bundle.targets.push_back(*Z);
  bundle.scales.assign(bundle.targets.size(), 1.0);
  bundle.time_offsets.assign(bundle.bases.size(), 0.0);
  bundle.pivots.assign(bundle.bases.size(), Eigen::Vector3d::Zero());
  add_joint_errors(joint_sd, bundle, notices);
  return bundle;
}

Cell solve_cell(const std::vector<CellMember>& all, const CellSettings& given) {
  Cell cell{.joint = true, .notices = misfit_sentences(all)};
  const std::vector<CellMember> members = without_wrong_poses(all);
  const bool as_stated = given.target_size_sd == 0.0 || given.size_as_stated;
  const bool unknown_sizes = given.target_size_sd && std::isinf(*given.target_size_sd);
  RefineSettings settings = given.refine;
  settings.bundle.unknowns.scales = !as_stated;
  settings.bundle.unknowns.warps = settings.bundle.unknowns.edge_offsets = true;
  settings.bundle.unknowns.intrinsics = given.lens == LensKnowledge::stated ? 0 : kLensUnknowns;
  Bundle start = cell_bundle(members, &cell.notices);
  std::vector<double> size_sd = start.priors.scale_sd;
  if (given.target_size_sd) size_sd.assign(start.targets.size(), *given.target_size_sd);
  settings.bundle.unknowns.joint_errors = !start.joint_errors.empty();
  if (given.lens == LensKnowledge::unknown) start.priors.lenses.clear();
  if (as_stated || unknown_sizes)
    start.priors.scale_sd.clear();
  else
    start.priors.scale_sd = size_sd;
  SizedRefinement sized = refine_sizes(refine(std::move(start), settings), settings);
  const Refinement& refined = sized.refined;
  SystematicUncertainty& systematic = sized.systematic;
  if (given.size_as_stated)
    systematic.covariance += covariance_of_kept_sizes(refined, settings.bundle, sized.sizes, size_sd);
  cell.sizes = sized.sizes;
  const bool told = std::all_of(cell.sizes.begin(), cell.sizes.end(),
                                [](const TargetSize& size) { return size.wanted.has_value(); });
  if (unknown_sizes && !told)
    throw data::InputError(
        "the data do not tell the size of the targets: the robots move too little; leave --target-size "
        "solved out, or add views farther apart");
  const auto refuse = [&](const std::string& reason) {
    cell.usable = false;
    cell.refusals.push_back(reason);
    cell.notices.push_back(reason + "; the answer cannot be used");
  };
  if (!refined.converged) refuse("the joint refinement did not converge");
  for (const TargetSize& size : cell.sizes) {
    if (!size.far_off()) continue;
    if (sized.disputed && !as_stated)
      refuse(size_sentence(size));
    else
      cell.notices.push_back(size_sentence(size));
  }
  const SharedColumns columns = shared_columns(refined.bundle, settings.bundle.unknowns);
  systematic.covariance =
      with_lens_raised(systematic.covariance, columns, lens_disagreement(refined, settings.bundle));
  for (std::size_t c = 0; c < refined.bundle.cameras.size(); ++c) {
    cell.lenses.push_back(lens_estimate(refined.bundle, settings.bundle.unknowns, systematic.covariance, c));
    if (!cell.lenses.back().far_off.empty()) cell.notices.push_back(lens_sentence(cell.lenses.back()));
  }
  const std::vector<std::string> arms = names_of(members, &CellMember::arm);
  const std::vector<std::string> cameras = names_of(members, &CellMember::camera);
  const auto block = [&](int column) -> Matrix6d {
    return column < 0 ? Matrix6d(Matrix6d::Zero())
                      : Matrix6d(systematic.covariance.block<6, 6>(column, column));
  };
  // How much of what halves show has been added already.
  const auto grown = [&](int column) {
    if (column < 0) return 1.0;
    const Matrix6d noise = refined.covariance.block<6, 6>(column, column);
    return std::max(1.0, noise.ldlt().solve(block(column)).trace() / 6);
  };
  for (std::size_t a = 0; a < arms.size(); ++a)
    if (systematic.arms[a].found)
      cell.notices.push_back(arms[a] +
                             ": the robot's errors change smoothly with its pose; what they have in common "
                             "was added to the standard deviations");
  const std::string world = arms.front();
  const auto widened = [&](std::size_t base) {
    if (refined.bundle.poses.size() < 16) return 1.0;
    const std::vector<SplitCheck> checks = check_systematic(refined, settings.bundle, base);
    const SplitCheck* worst = nullptr;
    const int column = base == 0 ? columns.cameras.front() : columns.bases[base];
    const double factor = std::max(1.0, split_inflation(checks, &worst) / grown(column));
    if (worst != nullptr && factor > 1)
      cell.notices.push_back((base == 0 ? cameras.front() : arms[base]) + ": " + describe(worst->split) +
                             " differ by more than noise explains; its standard deviations were raised by " +
                             data::format_short(std::sqrt(factor)));
    return factor;
  };
  for (std::size_t a = 1; a < arms.size(); ++a)
    cell.bases.push_back({{world, arms[a], refined.bundle.bases[a]}, widened(a) * block(columns.bases[a])});
  const std::string parent = refined.bundle.setup == Setup::eye_in_hand ? "gripper" : world;
  const double camera_factor = widened(0);
  for (std::size_t c = 0; c < cameras.size(); ++c)
    cell.cameras.push_back(
        {{parent, cameras[c], refined.bundle.cameras[c]}, camera_factor * block(columns.cameras[c])});
  add_motions(cell, members, arms, cameras);
  for (const std::string& reason : cell_contradictions(members, refined, cell)) refuse(reason);
  cell.noise = refined.noise;
  cell.corner_rms = reprojection_rms(refined.bundle, true);
  cell.chain_rms = reprojection_rms(refined.bundle, false);
  return cell;
}

Cell compose_cell(const std::vector<std::string>& arms, const std::vector<Extrinsics>& calibrations) {
  Cell cell;
  const Extrinsics& first = calibrations.front();
  for (std::size_t i = 0; i < calibrations.size(); ++i) {
    const Extrinsics& other = calibrations[i];
    if (other.setup != Setup::eye_to_hand)
      throw data::InputError(arms[i] +
                             ": found eye-in-hand, expected eye-to-hand: a camera that rides on one arm "
                             "does not stand still for the other");
    if (i == 0) continue;
    // X_A Exp(a) Exp(-b) X_B^-1: the difference of both perturbations, carried through X_B.
    const Matrix6d carry = adjoint(other.transform.T);
    cell.bases.push_back({{arms.front(), arms[i], first.transform.T * other.transform.T.inverse()},
                          carry * (first.covariance + other.covariance) * carry.transpose()});
  }
  cell.cameras.push_back({{arms.front(), "camera", first.transform.T}, first.covariance});
  return cell;
}

Eigen::Matrix3d point_covariance(const CellFrame& frame, const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> J;
  J << frame.transform.T.linear(), -frame.transform.T.linear() * skew(p);
  return J * frame.covariance * J.transpose();
}

}  // namespace flash::calib
