#pragma once
#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "apps/sysid_options.h"
#include "data/asset.h"
#include "sysid/emulate/results_store.h"
#include "sysid/infer/answer.h"
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
  bool plan = true;  ///< say what to record next
};

/// Shows how far an answer is, told by any thread.
class AnswerLine {
 public:
  AnswerLine(const CommonOptions& options, const sysid::AnswerWork& most) : line_(options), meter_(most) {}
  void take(const sysid::AnswerWork& done, const sysid::AnswerWork& spared);

 private:
  std::mutex mutex_;
  ProgressLine line_;
  sysid::AnswerMeter meter_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Simulates what `store` does not hold yet, finds the answer and writes it: summary.json, report.html and
/// the estimate's overlays. Returns the exit code.
int run_search(Search& search, sysid::ResultsStore& store, const CommonOptions& options);

}  // namespace flash
