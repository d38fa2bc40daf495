#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate/method_comparison.h"
#include "calib/calibrate/place_along.h"
#include "calib/calibrate/use.h"
#include "calib/dataset/symmetry.h"
#include "calib/solve/convention_check.h"
#include "calib/solve/errors_in_variables.h"
#include "calib/solve/pose_space.h"
#include "calib/solve/view_selection.h"
#include "calib/uncertainty/correlated_pose_errors.h"
#include "calib/uncertainty/knock.h"
#include "calib/uncertainty/lens_estimate.h"
#include "calib/uncertainty/observability.h"
#include "calib/uncertainty/split_check.h"
#include "calib/uncertainty/target_size.h"

namespace flash::calib {

/// Whether the time between pictures and poses is an unknown, where the poses are a stream over time.
enum class ClockOffset {
  where_it_matters,  ///< the robot moves at the pictures
  solved,
  none  ///< one clock; an offset that stands out is warned of
};

struct CalibrateSettings {
  Use use = Use::workspace;
  ViewSelectionSettings selection;
  ConventionSettings convention;
  std::vector<Eigen::Vector3d> angles;  ///< of each view, where the robot's file gave angles [rad]
  RefineSettings refine;
  int least_views = 4;    ///< fewer are refused
  double hopeless = 0.2;  ///< closing error of the majority beyond which nothing is solved, as `suspicious`
  double surprise = 35;   ///< squared size of a correction over that of most views, 6 degrees of freedom
  int folds = 10;         ///< of the held-out residuals
  unsigned held_out_seed = 0;  ///< by which their views are drawn; 0: interleaved
  std::vector<ClosedForm> closed_forms = calib::closed_forms();  ///< of the comparison table
  /// Of the target's size over the stated one, before a picture is taken; 0: as stated; infinity: not known;
  /// none: usual_size_sd.
  std::optional<double> target_size_sd = {};
  bool size_as_stated = false;  ///< it is not solved for, and what it may be off counts in the covariance
  LensKnowledge lens = LensKnowledge::near;
  LensCovariance lens_covariance = LensCovariance::Zero();   ///< as it was stated; zero: nothing was
  ClockOffset clock_offset = ClockOffset::where_it_matters;  ///< of pictures (calibrate_images())
  /// Of camera or target along the axis that the robot turns about, where it turns about one alone.
  std::optional<MeasuredHeight> height = {};
  bool motions = true;  ///< of camera and target are looked for; else both are taken to have stood still
  int threads = 1;      ///< of held-out residuals and splits; 0: one a processor
};

struct ViewResult {
  bool used = true;
  std::string reason;
  double px = 0;                           ///< reprojection with the view's correction, 2-D rms per corner
  double chain_px = 0;                     ///< without
  Vector6d correction = Vector6d::Zero();  ///< of the robot's pose, of a used view
};

/// What a knock during the recording parts from the answer.
struct KnockedPart {
  Knock knock = {};
  std::string view = {};  ///< the first after it
  bool before = true;     ///< the part is that before the knock; else that after it
  int views = 0;
  std::optional<HandEyePoses> poses = {};  ///< where it has enough views for a solution of its own
};

struct Calibration {
  Setup setup = Setup::eye_in_hand;
  ViewSelection selection;
  std::vector<int> used;  ///< views in the solution, by their place in the set
  Refinement refined;
  std::optional<SightNoise> sight_noise;  ///< of pairs of poses
  HandEyePoses poses;
  Matrix6d covariance = Matrix6d::Zero();         ///< of X, right perturbation (dt, dtheta)
  Matrix6d repeatable = covariance;               ///< of what scatters alone
  Matrix6d motion_covariance = Matrix6d::Zero();  ///< what both hold of camera or target that may have moved
  Method method = Method::errors_in_variables;    ///< that the poses are of: that, or pixels
  LensEstimate lens;
  double lens_view_factor =
      1;  ///< of the variances of lens and print, which views that disagree raised by it
  WarpEstimate warp;
  std::optional<EdgeOffset> edges;    ///< of a target with corners of edges
  Unknowns unknowns;                  ///< of the solution
  Eigen::MatrixXd shared_covariance;  ///< of all shared unknowns (SharedColumns), before splits widen it
  double corner_rms = 0;              ///< with corrections, 2-D rms per corner [px]
  double chain_rms = 0;               ///< without [px]
  double centre_rms = 0;  ///< of the target's projected middle against the view's own pose, without [px]
  HeldOut held_out;
  UseError use;
  std::vector<ComparedMethod> comparison;  ///< the answer last
  std::vector<ViewResult> views;
  RotationDiversity diversity;
  std::optional<PlaceAlong> along;  ///< of a robot that turns about one axis, or nearly
  WeakestDirection weakest;
  std::optional<TargetSize> size;
  std::optional<TargetSize> focal_length;  ///< of pairs: over that with which target poses were made
  double size_begun = 1;             ///< of the target over the stated one, with which the solution began
  std::vector<SplitCheck> splits;    ///< of X, interleaved first; none where there are too few views
  double covariance_factor = 1;      ///< by which the splits have widened the covariance
  CorrelatedPoseErrors pose_errors;  ///< of the robot, which the covariance holds
  std::optional<KnockedPart> other_part;
  std::optional<Drift> drift;         ///< the answer is of where camera and target were at the last view
  std::vector<std::string> warnings;  ///< worst first
  bool usable = true;
  std::vector<std::string> refusals = {};  ///< why it is not usable, worst first; each is a warning as well
};

/// Puts a sentence before all others. One that refuses says so, and leaves the answer unusable.
void tell_first(Calibration& calibration, std::string sentence, bool refuses = false);

/// Pose pairs are seen by no camera.
bool has_pixels(const Calibration& calibration);

/// What all calibrations start with: enough views, turns, numbering and planar poses chosen, a
/// convention that closes. Returns the observations in use and fills `result` so far; where the target's size
/// is to be solved for and is far from the stated one, both with poses of a target of
/// Calibration::size_begun. Throws data::InputError.
std::vector<Observation> prepare(Calibration& result, const std::vector<Observation>& observations,
                                 const std::vector<Symmetry>& symmetries, const CalibrateSettings& settings);

/// Poses of the target as they were given, where prepare() had them resized.
void restore_size(Calibration& result);

/// The axis that nearly all turns are about, if there is one. Throws data::InputError where there is none,
/// and a height was measured.
std::optional<OneAxis> axis_of(Setup setup, const std::vector<Observation>& used,
                               const CalibrateSettings& settings);

/// Of the target from the camera, in the middle [m].
double usual_distance(const std::vector<Observation>& observations);

/// What an answer about one axis ends with: the covariances hold what is not told, and a warning says so.
void state_along(Calibration& result);

/// What all end with: views, observability, warnings. False where the answer is implausible, the first of
/// them.
bool finish(Calibration& result, const std::vector<Observation>& used);

/// From observations to the answer: views selected, seed, bundle, errors in variables, a second look for
/// views that do not belong, held-out residuals, comparison; lens, size, warp and edges of the target among
/// the unknowns, with what is known of them. Throws data::InputError where too few views are left or nothing
/// can be determined, with the one sentence that names the cause.
Calibration calibrate(Setup setup, const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                      const std::vector<Symmetry>& symmetries, const std::vector<Observation>& observations,
                      const CalibrateSettings& settings = {});

}  // namespace flash::calib
