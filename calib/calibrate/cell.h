#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/extrinsics.h"
#include "calib/dataset/dataset.h"
#include "calib/dataset/symmetry.h"
#include "calib/dataset/target.h"
#include "calib/uncertainty/target_size.h"

namespace flash::calib {

/// A view that a calibration left out as it does not fit the others.
struct MisfitView {
  std::string image;
  double stamp = 0;
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();  ///< as reported
};

/// What one camera saw of one arm. All members of a cell are eye-to-hand, or all eye-in-hand.
struct CellMember {
  std::string arm, camera;  ///< names; members that share one share its unknowns
  Setup setup = Setup::eye_to_hand;
  data::CameraIntrinsics intrinsics;  ///< as the member's own solution has them
  LensPrior lens = {};                ///< what was known of them; empty: as usual
  Eigen::Matrix3Xd points = {};       ///< of the target
  std::vector<Symmetry> symmetries = {};
  std::vector<Observation> observations = {};  ///< in use, T_camera_target the chosen pose alone
  std::vector<double> stamps = {};             ///< equal stamps and poses of one arm are one pose of it
  std::vector<MisfitView> misfits = {};
  HandEyePoses poses = {};  ///< of the calibration by itself
  Matrix6d covariance = Matrix6d::Zero();
  Matrix6d motion_covariance = Matrix6d::Zero();  ///< as Calibration has it
  double corner_px = 0;                           ///< noise of its corners, by itself; 0: not known
};

/// The views in use as a member of a cell.
CellMember cell_member(const std::string& arm, const std::string& camera, const Dataset& dataset,
                       const Target& target, const Calibration& calibration);

/// A frame of the cell in the base of the first arm (eye-in-hand: cameras in the gripper).
struct CellFrame {
  NamedTransform transform;
  Matrix6d covariance = Matrix6d::Zero();  ///< right perturbation (dt, dtheta) [m, rad]
};

struct Cell {
  bool joint = false;  ///< one solution from all images; otherwise composed of single calibrations
  std::vector<CellFrame> bases = {}, cameras = {};
  NoiseLevels noise = {};
  std::vector<TargetSize> sizes = {};     ///< of the targets; none where composed
  std::vector<LensEstimate> lenses = {};  ///< of the cameras; none where composed
  bool usable = true;
  double corner_rms = 0, chain_rms = 0;  ///< with and without corrections, 2-D rms per corner [px]
  std::vector<std::string> notices = {};
  std::vector<std::string> refusals = {};  ///< why it is not usable; each is a notice as well
};

/// T_armA_armB = X_A X_B^-1 for every further calibration on one camera that stands still, with the
/// covariances of both. Throws data::InputError where one is eye-in-hand.
Cell compose_cell(const std::vector<std::string>& arms, const std::vector<Extrinsics>& calibrations);

/// The bundle of all members: bases, cameras, targets and robot corrections in one, first arm and first
/// member leading. Targets that are seen in the other family of their symmetry are turned first. Throws
/// data::InputError where a member has neither its arm nor its camera in common with those before it.
Bundle cell_bundle(const std::vector<CellMember>& members, std::vector<std::string>* notices = nullptr);

struct CellSettings {
  RefineSettings refine;
  std::optional<double> target_size_sd = {};  ///< as in CalibrateSettings
  bool size_as_stated = false;                ///< likewise
  LensKnowledge lens = LensKnowledge::near;
};

/// Solved by errors in variables, with lenses, sizes, warps and edges of targets among the unknowns. Views
/// that members left out are named by whose fault they are (misfit_sentences).
Cell solve_cell(const std::vector<CellMember>& members, const CellSettings& settings = {});

/// Covariance of where a point lies, p in the frame's child, seen from its parent [m^2].
Eigen::Matrix3d point_covariance(const CellFrame& frame, const Eigen::Vector3d& p);

}  // namespace flash::calib
