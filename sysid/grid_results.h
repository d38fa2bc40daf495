#pragma once
#include <string>
#include <vector>

#include "sysid/parameter_grid.h"

namespace flash::sysid {

/// How one keyframe of one recording was met.
struct KeyframeScore {
  double t = 0;      ///< of the recording [s]
  double score = 0;  ///< [m]; meaningless when points == 0
  int points = 0;    ///< observed points inside the crop
};

/// One candidate on one recording.
struct RecordingScore {
  double score = 0;              ///< mean over the keyframes that carry points [m]
  double offset[3] = {0, 0, 0};  ///< nuisance: simulation to observation [m]
  double yaw = 0;                ///< nuisance: about gravity [rad]
  double time_offset = 0;        ///< nuisance: simulated time minus recorded time [s]
  std::string bounds_hit;        ///< names of nuisance parameters at a bound, separated by spaces
  std::vector<KeyframeScore> keyframes;
};

enum class CandidateStatus {
  ok,
  unconverged,  ///< some step missed the tolerance; the score stands but is not to be trusted alone
  diverged      ///< positions left the numbers; no score
};

const char* name_of(CandidateStatus status);  ///< "ok", "unconverged", "diverged"

struct CandidateResult {
  int id = 0;                  ///< of the candidate in the grid
  std::vector<double> values;  ///< one an axis
  double score = 0;            ///< mean over recordings [m]; infinity when diverged
  bool converged = false;
  double residual_max = 0;     ///< worst step, |r| / |M g|
  double penetration_max = 0;  ///< [m]
  CandidateStatus status = CandidateStatus::ok;
  std::vector<RecordingScore> recordings;
};

/// Everything a search found; candidates in order of id.
struct GridResults {
  std::vector<Axis> axes;
  std::vector<std::string> recordings;  ///< names
  std::vector<CandidateResult> candidates;
};

/// results.csv (one line a candidate) and keyframes.csv (one line a candidate, recording and keyframe) are
/// only ever appended to; a line is flushed as its candidate is known, keyframes first. `grid.json` beside
/// them holds the fingerprint of inputs and settings, so that a run is never continued with others. Throws
/// data::InputError when the folder holds results of another fingerprint.
class ResultsStore {
 public:
  /// Opens or creates the files in `folder`; what is already there is read when `resume`, an error otherwise
  /// unless the folder holds no results.
  ResultsStore(const std::string& folder, const std::vector<Axis>& axes,
               const std::vector<std::string>& recordings, const std::string& fingerprint, bool resume);
  void append(const CandidateResult& result);
  const GridResults& results() const { return results_; }

 private:
  std::string folder_;
  GridResults results_;
};

/// Reads a folder written by ResultsStore. Throws data::InputError naming file and line.
GridResults load_grid_results(const std::string& folder);

}  // namespace flash::sysid
