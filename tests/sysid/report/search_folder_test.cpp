#include "sysid/report/search_folder.h"

#include <gtest/gtest.h>

#include "data/files/error.h"
#include "sysid/emulate/candidate_lines.h"
#include "sysid/emulate/results_store.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

/// A search of one candidate whose surface is `score` away, with its summary.
void save_search(const std::string& folder, double score) {
  ResultsStore store(folder, {{"young", {10}, true}}, {"lift"}, {}, Existing::refuse);
  CandidateResult candidate;
  candidate.values = {10};
  candidate.score = score;
  candidate.converged = true;
  RecordingScore& recording = candidate.recordings.emplace_back();
  recording.score = score;
  recording.keyframes = {{0.1, score, 100, 1}};
  store.append(candidate);
  Summary summary;
  summary.tool_version = FLASH_VERSION;
  summary.candidates = 1;
  summary.results_digest = digest_of(store.results());
  save_summary(summary, folder + "/summary.json");
}

TEST(SearchFolder, HoldsTheSummaryOfItsOwnTables) {
  const data::TemporaryFolder folder;
  const std::string run = folder / "run", other = folder / "other";
  save_search(run, 0.004);
  save_search(other, 0.005);
  EXPECT_EQ(load_search_folder(run).results.candidates.size(), 1u);
  save_summary(load_search_folder(other).summary, run + "/summary.json");
  const std::string message = data::input_error_of([&] { load_search_folder(run); });
  EXPECT_EQ(message.find(run + "/summary.json: results_digest: found \""), 0u) << message;
}

}  // namespace
}  // namespace flash::sysid
