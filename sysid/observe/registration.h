#pragma once
#include <string>
#include <vector>

#include "sysid/observe/cloud_search.h"
#include "sysid/observe/score.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// Largest deviation from zero of each nuisance parameter; zero keeps it at zero.
struct RegistrationBounds {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< [m]
  double yaw = 0;                                    ///< [rad]
  double time = 0;                                   ///< [s]
};

struct RegistrationSettings {
  int iterations = 20;                    ///< Gauss-Newton steps at most
  int points_per_keyframe = 400;          ///< evenly thinned for the fit; the final score uses all
  double tolerance = 1e-6;                ///< stops when a step gains less than this share of the score
  double softening = 5e-4;                ///< distance below which residuals count as quadratic [m]
  std::vector<double> time_starts = {0};  ///< the fit starts from each and keeps the best [s]
};

/// Which parameters all recordings of a batch have in common.
struct SharedRegistration {
  bool offset = false;
  bool yaw = false;
  bool time = false;
};

/// One recording to register a simulated motion to. The pointed-to data must outlive the call.
struct RegistrationProblem {
  const data::Triangles* triangles = nullptr;
  const Motion* motion = nullptr;
  const std::vector<Observation>* observations = nullptr;
  const SheetDistance* sheet = nullptr;  ///< of `triangles`, to be copied; none: made
  RegistrationBounds bounds;
  Registration start;  ///< pivot and up are kept, the rest is where the fit starts
  data::CropBox crop{};
  /// Of the observations' clouds, thinned as the settings say; none: the processor searches.
  CloudSearches searches = {};
};

/// Nuisance bounds and pivot of the recording; `replay` and `motion` must outlive it.
RegistrationProblem registration_problem(const Replay& replay, const Motion& motion);

struct RegistrationFit {
  Registration registration;
  std::vector<double> keyframe_scores;  ///< all points; zero where a keyframe carries none [m]
  double score = 0;                     ///< their weighted mean [m]
  std::vector<std::string> bounds_hit;  ///< "offset_x", "yaw", "time", ...
};

/// Minimises the sum over problems of the score over offset, yaw and time, all terms but force and two-sided.
/// Levenberg steps on the distances with weights 1 / d (so that the fixed point minimises the mean distance,
/// not its square); trimmed points carry no weight; parameters at a bound are dropped while the descent
/// points outward. The derivative by time comes from the surface's own velocity.
std::vector<RegistrationFit> register_motions(const std::vector<RegistrationProblem>& problems,
                                              const Objective& objective,
                                              const RegistrationSettings& settings = {},
                                              const SharedRegistration& shared = {});

/// The registrations alone, without the scores of all points.
std::vector<Registration> find_registrations(const std::vector<RegistrationProblem>& problems,
                                             const Objective& objective,
                                             const RegistrationSettings& settings = {},
                                             const SharedRegistration& shared = {});

}  // namespace flash::sysid
