#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/residual_likelihood.h"
#include "sysid/observe/linear_observations.h"

namespace flash::sysid {

/// A motion of each recording, kept once however many errors it is part of.
struct Motions {
  std::vector<Replay> replays;  ///< of the motions; other meshes and steps than those observed, or the same
  std::vector<ReplayResult> results;
};

struct MotionTerm {
  double factor = 1;
  std::shared_ptr<const Motions> motions;
};

/// A sum of motions whose factors add up to zero.
using MotionChange = std::vector<MotionTerm>;

/// An error of known shape, one standard deviation of it.
struct KnownError {
  MotionChange terms;
  bool shared = true;     ///< all recordings have the same error, not each its own
  bool corrects = false;  ///< the likelihood is that of motions moved by it; its size stays uncertain
};

/// How likely motions of several recordings are. The registration of each is fitted within its bounds, all
/// alike likely; how rows change with it and with errors of known shape is that at a reference motion.
class MotionLikelihood {
 public:
  /// `reference`: a motion a replay, near those to be asked about. `rates`: how motions change there with
  /// each parameter, over about what is likely of it.
  MotionLikelihood(const std::vector<Replay>& replays, const std::vector<ReplayResult>& reference,
                   const ScoreSettings& settings, std::optional<double> repeatability,
                   const std::vector<KnownError>& errors, const std::vector<MotionChange>& rates);

  std::size_t recordings() const { return recordings_.size(); }

  /// -2 log likelihood of motions, one a recording, up to a constant.
  double deviance(const std::vector<Motion>& motions) const;

  const ResidualLikelihood& of_recording(std::size_t r) const { return recordings_[r].likelihood; }

 private:
  using Nuisance = Eigen::Matrix<double, 5, 1>;  ///< offset [m], yaw [rad], time [s]
  struct Recording {
    Replay replay;
    Nuisance registration;  ///< of the reference
    Nuisance bounds;
    Objective objective;
    Eigen::VectorXd scale;                                ///< of each row: by its stated error
    Eigen::Matrix<double, Eigen::Dynamic, 5> registered;  ///< by what the registration moves each row
    Eigen::VectorXd correction;                           ///< [m]
    ResidualLikelihood likelihood;
  };
  /// Signed distances of what was observed to a motion under a registration, as rows (ObservedRows), with
  /// what the registration explains of them [m].
  static Eigen::VectorXd residuals(const Recording& recording, const Motion& motion,
                                   const Nuisance& registration);

  std::vector<Recording> recordings_;
};

}  // namespace flash::sysid
