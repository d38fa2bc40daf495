#include "sysid/emulate/results_reader.h"

#include <gtest/gtest.h>

#include <limits>
#include <string_view>

#include "data/files/atomic_file.h"
#include "data/files/text.h"
#include "sysid/emulate/results_store.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

/// Three candidates on two recordings of three keyframes each; the second candidate diverged.
class ResultsReader : public ::testing::Test {
 protected:
  ResultsReader() {
    ResultsStore store(run, {{"young", {10, 100, 1000}, true}}, {"a", "b"}, {{"tolerance", "0.001"}},
                       Existing::refuse);
    store.append(ok(0, 10, 0.004));
    CandidateResult lost;
    lost.id = 1;
    lost.values = {100};
    lost.status = CandidateStatus::diverged;
    lost.score = std::numeric_limits<double>::infinity();
    lost.recordings.resize(2);
    for (RecordingScore& recording : lost.recordings) recording.score = lost.score;
    store.append(lost);
    store.append(ok(2, 1000, 0.008));
  }

  static CandidateResult ok(int id, double young, double score) {
    CandidateResult result;
    result.id = id;
    result.values = {young};
    result.score = score;
    result.converged = true;
    result.residual_max = 9e-4;
    RecordingScore recording;
    recording.score = score;
    recording.keyframes = {{0, score / 2, 84, 1}, {0.2, 0, 0, 1}, {0.4, 1.5 * score, 100, 1}};
    result.recordings = {recording, recording};
    return result;
  }

  std::string file(const std::string& name) const { return run + "/" + name; }

  /// The message about a file in which `from` became `to`, and the same where a search is to go on.
  std::string message_of(const std::string& name, const std::string& from, const std::string& to) const {
    const std::string whole = data::read_file(file(name));
    std::string changed = whole;
    const std::size_t place = changed.find(from);
    EXPECT_NE(place, std::string::npos) << from;
    changed.replace(place, from.size(), to);
    data::write_atomically(file(name), changed);
    const std::string message = data::input_error_of([&] { load_grid_results(run); });
    EXPECT_EQ(data::input_error_of([&] { load_grid_results(run, Incomplete::leave_out); }), message);
    data::write_atomically(file(name), whole);
    return message.substr(0, run.size()) == run ? message.substr(run.size() + 1) : message;
  }

  void shorten(const std::string& name, std::size_t lines) const {
    std::string text = data::read_file(file(name));
    for (std::size_t i = 0; i < lines; ++i) text.resize(text.rfind('\n', text.size() - 2) + 1);
    data::write_atomically(file(name), text);
  }

  data::TemporaryFolder folder;
  std::string run = folder / "run";
};

TEST_F(ResultsReader, TakesWhatASearchWrote) { EXPECT_EQ(load_grid_results(run).candidates.size(), 3u); }

TEST_F(ResultsReader, NamesValuesOfResultsThatNoSearchCanHaveFound) {
  const auto message = [&](const std::string& from, const std::string& to) {
    return message_of("results.csv", from, to);
  };
  EXPECT_EQ(message(",0.004,", ",-5,").find("results.csv:2: score_m: found \"-5\""), 0u);
  EXPECT_EQ(message(",0.004,", ",nan,").find("results.csv:2: score_m: found \"nan\""), 0u);
  EXPECT_EQ(message(",0.004,", ",1e300,").find("results.csv:2: score_m"), 0u);
  EXPECT_EQ(message(",0.004,", ",0.005,"),
            "results.csv:2: score_m: found \"0.005\", expected 0.004, the mean of its registrations.csv");
  EXPECT_EQ(message("\n0,10,", "\n0,-10,").find("results.csv:2: young: found \"-10\""), 0u);
  EXPECT_EQ(message(",true,", ",maybe,").find("results.csv:2: converged"), 0u);
  EXPECT_EQ(message("\n0,10,", "\n99,10,").find("results.csv:2: id"), 0u);
  EXPECT_EQ(message("\n0,10,", "\n2,10,").find("results.csv:2: young"), 0u);
  EXPECT_EQ(message("\n0,10,", "\n0,10\xff,").find("results.csv:2: found a byte"), 0u);
  EXPECT_EQ(message("\n0,10,", "\n1e300,10,").find("results.csv:2: id"), 0u);
  EXPECT_EQ(message("\n1,100,inf,", "\n1,100,0.1,").find("results.csv:3: score_m: found \"0.1\""), 0u);
  EXPECT_EQ(
      message(",9e-04,", ",99999999999999999999,"),
      "results.csv:2: residual_max: found \"99999999999999999999\", expected at most the tolerance of 0.001 "
      "in grid.json, as it converged");
}

TEST_F(ResultsReader, ExpectsOneRegistrationACandidateAndRecording) {
  const auto message = [&](const std::string& from, const std::string& to) {
    return message_of("registrations.csv", from, to);
  };
  const std::string first = "0,a,0.004,0,0,0,0,0,\n";
  EXPECT_EQ(message(first, "").find("registrations.csv:2: recording: found \"b\", expected \"a\""), 0u);
  EXPECT_EQ(message(first, first + first).find("registrations.csv:3: recording: found \"a\""), 0u);
  EXPECT_EQ(message("0,b,", "0,c,").find("registrations.csv:3: recording: found \"c\""), 0u);
  EXPECT_EQ(message("0,b,", "7,b,").find("registrations.csv:3: id: found \"7\", expected 0"), 0u);
  EXPECT_EQ(message("0,b,0.004", "0,b,0").find("registrations.csv:3: score_m: found \"0\", expected 0.004"),
            0u);
  EXPECT_EQ(message("0,b,0.004,0", "0,b,0.004,inf").find("registrations.csv:3: offset_x"), 0u);
  EXPECT_EQ(
      message("0,a,0.004,0", "0,a,0.004,0.01").find("results.csv:2: offset_x: found \"0\", expected 0.01"),
      0u);
  EXPECT_EQ(message("0,0,\n0,b", "0,0,yes\n0,b").find("registrations.csv:2: bounds_hit"), 0u);
  EXPECT_EQ(message("1,a,inf", "1,a,0.1").find("registrations.csv:4: score_m"), 0u);
}

TEST_F(ResultsReader, ExpectsTheSameKeyframesOfEveryCandidate) {
  const auto message = [&](const std::string& from, const std::string& to) {
    return message_of("keyframes.csv", from, to);
  };
  EXPECT_EQ(message("2,a,0.2,", "2,a,0.3,"),
            "keyframes.csv:9: t: found \"0.3\", expected 0.2, as of candidate 0");
  EXPECT_EQ(message("2,a,0.2,0,0,1\n", "").find("keyframes.csv:9: t: found \"0.4\", expected 0.2"), 0u);
  EXPECT_EQ(message("2,a,0.4,0.012,100,1\n", "").find("keyframes.csv:10: recording: found \"b\""), 0u);
  EXPECT_EQ(message("2,a,0,0.004,84,1", "2,a,0,0.004,0,1")
                .find("keyframes.csv:8: points: found \"0\", expected 84"),
            0u);
  EXPECT_EQ(message("2,a,0,0.004,84,1", "2,a,0,0.004,84,2").find("keyframes.csv:8: weight"), 0u);
  EXPECT_EQ(message("2,a,0,0.004,84,1", "2,a,0,inf,84,1").find("keyframes.csv:8: score_m"), 0u);
  EXPECT_EQ(message("2,a,0,0.004,", "2,a,0,0.005,").find("registrations.csv:6: score_m"), 0u);
  EXPECT_EQ(message("0,a,0.4,0.006,100,1\n", "").find("registrations.csv:2: score_m"), 0u);
  EXPECT_EQ(message("0,b,0,", "1,b,0,").find("keyframes.csv:5: id: found \"1\", expected 0"), 0u);
  const std::string last = "2,b,0.4,0.012,100,1\n";
  EXPECT_EQ(message(last, last + last).find("keyframes.csv:14: id: found \"2\", expected no more lines"), 0u);
}

// What agrees with all else that the tables say.
TEST_F(ResultsReader, LinesThatWereEditedAreToldByTheirDigest) {
  const auto expect_named = [&](const char* table, const char* line, const char* from, const char* to) {
    const std::string message = message_of(table, from, to);
    EXPECT_EQ(message.find(std::string("results.csv:") + line + ": digest: found \""), 0u) << message;
    EXPECT_NE(message.find("belongs to another search, or was edited"), std::string::npos) << message;
  };
  expect_named("results.csv", "2", ",9e-04,0,", ",9e-04,0.5,");         // penetration_max_m
  expect_named("registrations.csv", "2", "0,0,\n0,b", "0,0,yaw\n0,b");  // bounds_hit
  expect_named("registrations.csv", "2", "0,b,0.004,0", "0,b,0.004,0.01");
  expect_named("keyframes.csv", "4", "2,b,0.2,0,", "2,b,0.2,0.5,");  // of no points
  expect_named("grid.json", "2", "\"log\": true", "\"log\": false");
  EXPECT_EQ(message_of("results.csv", ",digest", ""),
            "results.csv: header: column 14: found none, expected \"digest\"; grid --force searches anew");
}

TEST_F(ResultsReader, CandidatesThatWereExchangedInAllTablesAreToldByTheirDigest) {
  const std::string whole = data::read_file(file("results.csv"));
  const auto exchange = [&](const std::string& name, const std::string& zero, const std::string& two) {
    std::string text;
    const std::string old = data::read_file(file(name));
    data::LineReader lines(old);
    for (std::string_view line; lines.next(line);) {
      const bool is_zero = line.starts_with(zero), is_two = line.starts_with(two);
      text += is_zero  ? two + std::string(line.substr(zero.size()))
              : is_two ? zero + std::string(line.substr(two.size()))
                       : std::string(line);
      text += '\n';
    }
    // Back into the order of the ids.
    std::vector<std::string> heads = {"id,", "0,", "1,", "2,"};
    std::string sorted;
    for (const std::string& head : heads) {
      data::LineReader again(text);
      for (std::string_view line; again.next(line);)
        if (line.starts_with(head)) sorted += std::string(line) + '\n';
    }
    data::write_atomically(file(name), sorted);
  };
  exchange("results.csv", "0,10,", "2,1000,");
  exchange("registrations.csv", "0,", "2,");
  exchange("keyframes.csv", "0,", "2,");
  EXPECT_NE(data::read_file(file("results.csv")), whole);
  EXPECT_EQ(data::input_error_of([&] { load_grid_results(run); }).find(file("results.csv") + ":2: digest: "),
            0u);
}

TEST_F(ResultsReader, TablesOfAnotherSearchAreToldByTheirDigest) {
  const std::string other = folder / "other";
  {
    ResultsStore store(other, {{"young", {10, 100, 1000}, true}}, {"a", "b"},
                       {{"tolerance", "0.001"}, {"fixed friction", "0.5"}}, Existing::refuse);
    store.append(ok(0, 10, 0.004));
  }
  for (const char* table : result_tables)
    data::write_atomically(file(table), data::read_file(other + "/" + table));
  EXPECT_EQ(load_grid_results(other).candidates.size(), 1u);
  EXPECT_EQ(data::input_error_of([&] { load_grid_results(run); }).find(file("results.csv") + ":2: digest: "),
            0u);
}

TEST_F(ResultsReader, LinesMayEndAsOtherSystemsEndThem) {
  const std::vector<CandidateResult> before = load_grid_results(run).candidates;
  for (const char* table : result_tables) {
    std::string text;
    for (const char c : data::read_file(file(table))) text += c == '\n' ? "\r\n" : std::string(1, c);
    data::write_atomically(file(table), text);
  }
  const std::vector<CandidateResult> after = load_grid_results(run).candidates;
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) EXPECT_EQ(after[i].digest, before[i].digest);
}

// Which no kill leaves, but a disk that lost the end of a file, or a copy that stopped.
TEST_F(ResultsReader, CandidatesThatOneFileLostAreNamedOrLeftOut) {
  for (const char* name : {"keyframes.csv", "registrations.csv"}) {
    const std::string whole = data::read_file(file(name));
    shorten(name, 1);
    EXPECT_EQ(data::input_error_of([&] { load_grid_results(run); }),
              file(name) +
                  ": candidate 2: found the end of the file, expected all its lines; grid --resume "
                  "finds it again");
    EXPECT_EQ(load_grid_results(run, Incomplete::leave_out).candidates.size(), 2u);
    const auto lines = static_cast<std::size_t>(std::count(whole.begin(), whole.end(), '\n'));
    for (std::size_t left = lines - 2; left > 0; --left) {
      shorten(name, 1);
      EXPECT_LE(load_grid_results(run, Incomplete::leave_out).candidates.size(), left / 2) << name << left;
    }
    EXPECT_NE(data::input_error_of([&] { load_grid_results(run); }).find("candidate 0"), std::string::npos);
    data::write_atomically(file(name), whole);
  }
  shorten("results.csv", 1);
  EXPECT_NE(data::input_error_of([&] {
              load_grid_results(run);
            }).find("registrations.csv:6: id: found \"2\", expected a candidate of results.csv"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::sysid
