#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/discrepancy.h"
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

/// An error of known shape, one standard deviation of it: a sum of motions whose factors add up to zero.
struct KnownError {
  std::vector<MotionTerm> terms;
  bool shared = true;     ///< all recordings have the same error, not each its own
  bool corrects = false;  ///< the likelihood is that of motions moved by it; its size stays uncertain
};

/// How likely motions of several recordings are. Observed points keep their places and the registration is
/// linear about that of a reference motion. The registration is normal about zero, of the standard deviation
/// of an even distribution over its bounds (b / sqrt(3)), and integrated out with noise and discrepancy.
class MotionLikelihood {
 public:
  /// `reference`: a motion a replay, near those to be asked about.
  MotionLikelihood(const std::vector<Replay>& replays, const std::vector<ReplayResult>& reference,
                   const ScoreSettings& settings, std::optional<double> repeatability,
                   const std::vector<KnownError>& errors);

  std::size_t recordings() const { return recordings_.size(); }

  /// Signed distances of what was observed to a motion of recording r, as its rows (DiscrepancyModel) [m].
  Eigen::VectorXd residuals(std::size_t r, const Motion& motion) const;

  /// -2 log likelihood of sets of motions, from their residuals: a matrix a recording, a set a column.
  Eigen::VectorXd deviance(const std::vector<Eigen::MatrixXd>& residuals) const;

  const DiscrepancyModel& model(std::size_t r) const { return recordings_[r].model; }

 private:
  struct Recording {
    Replay replay;
    Registration registration;
    Objective objective;
    Eigen::VectorXd scale;       ///< of each row: by its stated error
    Eigen::VectorXd registered;  ///< by what the registration moves each row [m]
    Eigen::VectorXd correction;  ///< [m]
    DiscrepancyModel model;
  };
  std::vector<Recording> recordings_;
};

}  // namespace flash::sysid
