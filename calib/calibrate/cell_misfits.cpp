#include "calib/calibrate/cell_misfits.h"

#include <algorithm>
#include <span>

namespace flash::calib {
namespace {

enum class Fault { robot, camera, either };

/// What the cameras of a cell make of one pose of an arm.
struct Witnesses {
  int for_it = 0, against = 0;  ///< cameras that use it, and that leave it out
  Fault fault() const {
    if (against > 1 && against > for_it) return Fault::robot;
    return for_it > 0 ? Fault::camera : Fault::either;
  }
};

Witnesses witnesses_of(std::span<const CellMember> members, const std::string& arm, double stamp,
                       const Eigen::Isometry3d& pose) {
  Witnesses witnesses;
  for (const CellMember& member : members) {
    if (member.arm != arm) continue;
    for (std::size_t i = 0; i < member.observations.size(); ++i)
      witnesses.for_it += member.stamps[i] == stamp && same_pose(member.observations[i].T_base_gripper, pose);
    for (const MisfitView& view : member.misfits)
      witnesses.against += view.stamp == stamp && same_pose(view.T_base_gripper, pose);
  }
  return witnesses;
}

/// "003.png, 011.png"
std::string listed(const std::vector<std::string>& images) {
  std::string text;
  for (const std::string& image : images) text += (text.empty() ? "" : ", ") + image;
  return text;
}

/// The misfits of a member that are of this fault; of the robot's only those that no member before it names.
std::vector<std::string> images_of(const std::vector<CellMember>& members, std::size_t at, Fault fault) {
  std::vector<std::string> images;
  const CellMember& member = members[at];
  for (const MisfitView& view : member.misfits) {
    if (witnesses_of(members, member.arm, view.stamp, view.T_base_gripper).fault() != fault) continue;
    const std::span before = std::span(members).first(at);
    const bool named = fault == Fault::robot &&
                       witnesses_of(before, member.arm, view.stamp, view.T_base_gripper).against > 0;
    if (!named) images.push_back(view.image);
  }
  return images;
}

}  // namespace

bool same_pose(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  constexpr double kShift = 1e-4, kTurn = 3e-4;  // [m], [rad]: as four digits, or 0.01 deg, are rounded
  const Vector6d apart = motion_between(a, b);
  return apart.head<3>().norm() < kShift && apart.tail<3>().norm() < kTurn;
}

std::vector<std::string> misfit_sentences(const std::vector<CellMember>& members) {
  std::vector<std::string> sentences;
  for (const Fault fault : {Fault::robot, Fault::camera, Fault::either})
    for (std::size_t i = 0; i < members.size(); ++i) {
      const std::vector<std::string> images = images_of(members, i, fault);
      if (images.empty()) continue;
      const std::string &arm = members[i].arm, &camera = members[i].camera;
      if (fault == Fault::robot)
        sentences.push_back(arm + ": the robot's poses at " + listed(images) +
                            " do not fit in most cameras that saw them: its poses or joints are wrong there, "
                            "and no camera uses them");
      else if (fault == Fault::camera)
        sentences.push_back(
            camera + ": " + listed(images) +
            ": left out, as other cameras fit at these poses: they are pictures of other poses, or "
            "their corners are wrong");
      else
        sentences.push_back(
            camera + ": " + listed(images) + " of " + arm +
            ": left out, and no other camera saw these poses: the pictures or the poses are wrong");
    }
  return sentences;
}

std::vector<CellMember> without_wrong_poses(std::vector<CellMember> members) {
  const std::vector<CellMember> all = members;
  for (CellMember& member : members) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < member.observations.size(); ++i) {
      if (witnesses_of(all, member.arm, member.stamps[i], member.observations[i].T_base_gripper).fault() ==
          Fault::robot)
        continue;
      if (kept != i) {
        member.observations[kept] = std::move(member.observations[i]);
        member.stamps[kept] = member.stamps[i];
      }
      ++kept;
    }
    member.observations.resize(kept);
    member.stamps.resize(kept);
  }
  return members;
}

}  // namespace flash::calib
