#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/uncertainty/systematic_uncertainty.h"

namespace flash::calib {

/// Over that which a solution begins with, what a solution looks for: one that starts farther off tends to
/// zero or infinity.
constexpr bool measurable_size(double size) { return size > 0.5 && size < 2; }

/// What pictures and robot tell of the size of a target, over the size stated. It moves the camera by as
/// large a share of its distance.
struct TargetSize {
  double estimate = 1;  ///< that the answer is for: prior and pictures together
  double sd = 0;
  double prior_sd = 0;  ///< 0: taken as stated; infinity: nothing was known
  /// Of pictures and robot alone. None where they do not tell it, as those of a robot that turns and never
  /// moves along, without depth.
  struct Wanted {
    double estimate = 1, sd = 0;
  };
  std::optional<Wanted> wanted = {};

  /// The pictures want a size that the prior all but excludes.
  bool far_off() const;
};

/// A solution with what is known of its targets' sizes (Priors::scale_sd), and its whole uncertainty.
struct SizedRefinement {
  Refinement refined;
  SystematicUncertainty systematic;
  std::vector<TargetSize> sizes;  ///< of each target
  bool disputed = false;          ///< a size is far off, and without its prior the answer would be another
};

/// The size as one more unknown beside its prior. Errors that views share make pictures look surer of it than
/// they are: the prior weighs more by as much as they add to its deviation, so that both count by their whole
/// variances. refined: the solution where it does not; settings: those it was made with; begun: sizes that it
/// began with.
SizedRefinement refine_sizes(Refinement refined, const RefineSettings& settings, double begun = 1);

/// Covariance of the shared unknowns that comes of sizes that are kept as stated, each known to `sd` of it:
/// how they follow a size, times what it may be off. By what pictures want beyond that and their own
/// deviation, it is off as well.
Eigen::MatrixXd covariance_of_kept_sizes(const Refinement& refined, const BundleSettings& settings,
                                         const std::vector<TargetSize>& sizes, const std::vector<double>& sd);

/// Likewise of sizes that were solved for, where prior and pictures contradict each other: the print may be
/// as stated and the unit of the robot or the lens wrong, or the print. So the size may be off by as much as
/// either says, from two of their deviations on.
Eigen::MatrixXd covariance_of_disputed_sizes(const Refinement& refined, const BundleSettings& settings,
                                             const std::vector<TargetSize>& sizes);

/// "the estimated size of the target is 1.0400 +- 0.0080 (2 sd) of the stated one ...", of a size that is far
/// off.
std::string size_sentence(const TargetSize& size);

}  // namespace flash::calib
