#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "sysid/emulate/parameter_grid.h"

namespace flash::sysid {

/// How one keyframe of one recording was met.
struct KeyframeScore {
  double t = 0;       ///< of the recording [s]
  double score = 0;   ///< [m]; meaningless when points == 0
  int points = 0;     ///< observed points inside the crop, all terms
  double weight = 1;  ///< in the recording's score
};

/// One candidate on one recording; the convention of offset, yaw and time_offset is that of Registration.
struct RecordingScore {
  double score = 0;  ///< weighted mean over the keyframes that carry points [m]
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< [m]
  double yaw = 0;                                    ///< [rad]
  double time_offset = 0;                            ///< [s]
  std::vector<std::string> bounds_hit;  ///< nuisance parameters at a bound: "offset_x", "yaw", ...
  std::vector<KeyframeScore> keyframes;
};

enum class CandidateStatus {
  ok,
  unconverged,  ///< some step missed the tolerance: the score stands, with doubt
  diverged      ///< positions left the numbers: no score
};

const char* to_string(CandidateStatus status);  ///< "ok", "unconverged", "diverged"

struct CandidateResult {
  int id = 0;                  ///< of the candidate in the grid
  std::vector<double> values;  ///< one an axis
  double score = 0;            ///< mean over recordings [m]; infinity when diverged
  bool converged = false;
  double residual_max = 0;     ///< worst step, |r| / |M g|
  double penetration_max = 0;  ///< [m]
  CandidateStatus status = CandidateStatus::ok;
  std::vector<RecordingScore> recordings;
  std::string digest;  ///< of its lines in the tables (candidate_lines.h); empty before they are written
};

/// Everything a search found; candidates in order of id.
struct GridResults {
  std::vector<Axis> axes;
  std::vector<std::string> recordings;  ///< names
  std::vector<CandidateResult> candidates;
};

/// The place of the smallest finite score among the candidates; -1 where all diverged.
int best_of(const GridResults& results);

/// Takes the weight from the keyframes at and beyond each recording's horizon and forms the scores of all
/// candidates anew from the keyframes that remain. Where none would remain, a recording keeps its own.
void drop_beyond_horizons(const std::vector<std::optional<double>>& horizons, GridResults& results);

/// Weighted mean of the keyframes that carry points [m]; empty where none does.
std::optional<double> mean_score(const std::vector<KeyframeScore>& keyframes);

}  // namespace flash::sysid
