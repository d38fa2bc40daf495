#pragma once
#include <string>

#include "calib/calibrate/cell.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {

/// A scene as what one arm and one camera of a cell have seen, a second between its views.
inline CellMember member_of(const HandEyeScene& scene, const std::string& arm,
                            const std::string& camera = "camera") {
  CellMember member{.arm = arm, .camera = camera, .setup = scene.settings.setup, .intrinsics = scene.camera};
  member.points = scene.points;
  member.symmetries = grid_symmetries(scene.points);
  member.observations = scene.observations;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) member.stamps.push_back(static_cast<double>(i));
  member.poses = shah(loops_of(scene));
  member.corner_px = scene.settings.corner_px;
  return member;
}

}  // namespace flash::calib
