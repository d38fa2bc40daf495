#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/dataset/symmetry.h"
#include "calib/solve/robust_seed.h"

namespace flash::calib {

/// Another way to read the input.
struct Reading {
  std::string sentence;  ///< what is wrong with the input if this reading is right
  Setup setup = Setup::eye_in_hand;
  std::vector<Eigen::Isometry3d> T_base_gripper;  ///< of each view
  std::vector<bool> known;                        ///< views that have a pose in this reading
  bool target_inverted = false;                   ///< poses of the target are T_target_camera
};

/// Readings of the same numbers under the conventions that people mix up: the other setup, inverted poses,
/// both, millimetres and inches for metres, pairing off by one or two or in reverse, quaternions w x y z for
/// x y z w, poses of the target inverted where no picture gave them, and, where the file gave angles, all
/// other readings of them (rotation_from_angles), degrees for radians and radians for degrees. angles: as the
/// file gave them [rad], one a view, or none.
std::vector<Reading> alternative_readings(Setup setup, const std::vector<Observation>& observations,
                                          const std::vector<Eigen::Vector3d>& angles = {});

struct ConventionSettings {
  RobustSeedSettings robust_seed{.triples = 100, .kept = 3};
  double suspicious = 0.035;  ///< closing error of the majority, rotation [rad] and translation over distance
  double better = 4;          ///< how many times better another reading has to close
  double runner_up = 2;       ///< and how many times better than the next reading
  double paired = 2;          ///< how many times better another pairing has to close
  double plausible = 0.07;    ///< and to how little at most, as `suspicious`
};

struct Finding {
  std::string sentence;
  RobustSeed stated, found;  ///< how the input closes as it is stated, and as the finding reads it
  double size = 1;           ///< of the target, over the stated one
};

/// Tries the readings where the stated one closes badly. Empty where it closes well, where no other closes
/// clearly better, or where two do.
std::optional<Finding> check_convention(Setup setup, const std::vector<Observation>& observations,
                                        const std::vector<Symmetry>& symmetries, const RobustSeed& stated,
                                        const std::vector<Eigen::Vector3d>& angles = {},
                                        const ConventionSettings& settings = {});

/// Whether images and poses are paired off by one or two, or in reverse, where the stated reading closes well
/// enough for check_convention: a robot that is swept regularly moves much alike from view to view, so that a
/// shift is nearly consistent, and the answer far off. Empty where no such reading closes `paired` times
/// better, of few views as many times as chance does not.
std::optional<Finding> check_pairing(Setup setup, const std::vector<Observation>& observations,
                                     const std::vector<Symmetry>& symmetries, const RobustSeed& stated,
                                     const ConventionSettings& settings = {});

/// Whether the stated reading closes with a target of another size, which is estimated. Empty as that of
/// check_convention.
std::optional<Finding> check_size(Setup setup, const std::vector<Observation>& observations,
                                  const std::vector<Symmetry>& symmetries, const RobustSeed& stated,
                                  const ConventionSettings& settings = {});

}  // namespace flash::calib
