#pragma once
#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "apps/sysid/options.h"
#include "apps/sysid/progress_line.h"
#include "data/asset/asset.h"
#include "sysid/emulate/results_store.h"
#include "sysid/infer/answer.h"
#include "sysid/infer/time_left.h"
#include "sysid/replay/replay.h"

namespace flash {

/// A search made ready: what is simulated, and where its answer goes.
struct Search {
  data::Asset asset;
  std::vector<sysid::Replay> replays;
  sysid::GridSettings settings;
  sysid::AnswerSettings asked;
  std::vector<std::string> map;  ///< the two parameters of the report's score map; empty: chosen
  std::string out;
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  bool plan = true;              ///< say what to record next
  double candidate_seconds = 0;  ///< that one takes at least, kept motions apart; 0: not known
};

/// Shows how far an answer is, told by any thread.
class AnswerLine {
 public:
  /// `stage`: in which the work begins; candidates where lattices follow at once.
  AnswerLine(const CommonOptions& options, const sysid::AnswerWork& most, const sysid::TimeLeft& time,
             sysid::SearchStage stage);
  void take(const sysid::AnswerWork& done, const sysid::AnswerWork& spared);
  const sysid::TimeLeft& time() const { return time_; }

 private:
  std::mutex mutex_;
  ProgressLine line_;
  sysid::AnswerMeter meter_;
  sysid::TimeLeft time_;
};

/// Simulates what `store` does not hold yet, finds the answer and writes it: summary.json, report.html and
/// the estimate's overlays. Returns the exit code.
int run_search(Search& search, sysid::ResultsStore& store, const CommonOptions& options);

}  // namespace flash
