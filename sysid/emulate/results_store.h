#pragma once
#include <string>
#include <vector>

#include "sysid/emulate/grid_file.h"
#include "sysid/emulate/grid_results.h"

namespace flash::sysid {

/// What is to become of results that the folder holds already.
enum class Existing {
  refuse,
  resume,  ///< the search goes on from them
  replace  ///< they are removed, with summary, report and best motions
};

/// Of what lies in folders of the folder: of several, none removes what another may be writing.
enum class Writers { one, several };

/// A folder of results that only ever grows: results.csv (one line a candidate; with several recordings its
/// offsets are those of the first), registrations.csv (one line a candidate and recording) and keyframes.csv
/// (one line a candidate, recording and keyframe). grid.json holds axes, recordings and the fingerprint of
/// inputs and settings. The digest in a line of results.csv binds the lines of a candidate to each other and
/// to grid.json.
///
/// It survives an end at any moment, by kill -9 or a power cut. Every batch is on the disk before the next
/// begins, its lines in results.csv last: a candidate is there as a whole or not at all. Opening the folder
/// again cuts off what belongs to none, and candidates at the end that one of the files has lost.
class ResultsStore {
 public:
  /// Creates `folder`, or treats what it holds as `existing` says. Throws data::InputError, with nothing
  /// changed, where another process writes to it; where it holds results that are to be refused; where it is
  /// to go on with results of another fingerprint (naming what differs) or of recordings in another order;
  /// and, unless they are to be replaced, where it holds results without grid.json. Throws std::system_error
  /// where no file can be made in it.
  ResultsStore(const std::string& folder, const std::vector<Axis>& axes,
               const std::vector<std::string>& recordings, const Fingerprint& fingerprint, Existing existing,
               Writers writers = Writers::one);
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
  void go_on(const std::vector<Axis>& axes, const std::vector<std::string>& recordings,
             const Fingerprint& fingerprint);

  std::string folder_;
  std::string search_;  ///< search_digest
  GridResults results_;
  int lock_ = -1;  ///< descriptor of the file that is locked
};

}  // namespace flash::sysid
