#pragma once
#include <Eigen/Core>
#include <map>
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
};

/// Everything a search found; candidates in order of id.
struct GridResults {
  std::vector<Axis> axes;
  std::vector<std::string> recordings;  ///< names
  std::vector<CandidateResult> candidates;
};

/// Takes the weight from the keyframes at and beyond each recording's horizon and forms the scores of all
/// candidates anew from the keyframes that remain. Where none would remain, a recording keeps its own.
void drop_beyond_horizons(const std::vector<std::optional<double>>& horizons, GridResults& results);

/// What decides the results of a search, by name; see sysid/fingerprint.h.
using Fingerprint = std::map<std::string, std::string>;

/// What is to become of results that the folder holds already.
enum class Existing {
  refuse,
  resume,  ///< the search goes on from them
  replace  ///< they are removed, with summary, report and best motions
};

/// A folder of results that only ever grows: results.csv (one line a candidate; with several recordings its
/// offsets are those of the first), registrations.csv (one line a candidate and recording) and keyframes.csv
/// (one line a candidate, recording and keyframe). grid.json holds axes, recordings and the fingerprint of
/// inputs and settings.
///
/// It survives an end at any moment, by kill -9 or a power cut. Every batch is on the disk before the next
/// begins, its lines in results.csv last: a candidate is there as a whole or not at all. Opening the folder
/// again cuts off what belongs to none.
class ResultsStore {
 public:
  /// Creates `folder`, or treats what it holds as `existing` says. Throws data::InputError, with nothing
  /// changed, where another process writes to it, where it holds results that are to be refused, and where it
  /// is to go on with results of another fingerprint (naming what differs).
  ResultsStore(const std::string& folder, const std::vector<Axis>& axes,
               const std::vector<std::string>& recordings, const Fingerprint& fingerprint, Existing existing);
  ~ResultsStore();
  ResultsStore(const ResultsStore&) = delete;
  ResultsStore& operator=(const ResultsStore&) = delete;

  void append(const std::vector<CandidateResult>& batch);
  void append(const CandidateResult& result) { append(std::vector{result}); }
  const GridResults& results() const { return results_; }
  bool contains(int id) const;

 private:
  void begin(const std::vector<Axis>& axes, const std::vector<std::string>& recordings,
             const Fingerprint& fingerprint);
  void go_on(const Fingerprint& fingerprint);

  std::string folder_;
  GridResults results_;
  int lock_ = -1;  ///< descriptor of the file that is locked
};

/// Reads a folder written by ResultsStore. Throws data::InputError naming file and line: a line that is cut
/// off, which only a search that goes on repairs; a candidate that is not of the grid, or there twice; values
/// that no search can have written.
GridResults load_grid_results(const std::string& folder);

}  // namespace flash::sysid
