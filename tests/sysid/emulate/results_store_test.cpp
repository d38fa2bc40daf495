#include "sysid/emulate/results_store.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "data/files/atomic_file.h"
#include "data/files/sha256.h"
#include "sysid/emulate/results_reader.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;

const std::vector<Axis> kAxes = {{"young", {10, 100}, true}, {"friction", {0.1, 0.3}, false}};

const Fingerprint kPrint = {{"time_step_s", "0.01"}, {"asset friction", "0.3"}};

CandidateResult result_of(int id, double score) {
  CandidateResult result;
  result.id = id;
  result.values = {id < 2 ? 10.0 : 100.0, id % 2 ? 0.3 : 0.1};
  result.score = 1.5 * score;
  result.converged = true;
  result.residual_max = 1e-4;
  RecordingScore recording;
  recording.score = score;
  recording.offset = {0.01, -0.02, 0.1 / 3};
  recording.yaw = 0.05;
  recording.time_offset = -0.04;
  recording.bounds_hit = {"offset_x", "time"};
  recording.keyframes = {{0.1, score, 120, 1}, {0.2, 0, 0, 0}};
  result.recordings = {recording, recording};
  result.recordings[1].score = result.recordings[1].keyframes[0].score = 2 * score;
  return result;
}

CandidateResult diverged(int id) {
  CandidateResult result = result_of(id, std::numeric_limits<double>::infinity());
  result.status = CandidateStatus::diverged;
  result.converged = false;
  for (RecordingScore& recording : result.recordings) recording.keyframes.clear();
  return result;
}

class Results : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = (fs::temp_directory_path() / ("flash_grid_results_" + std::to_string(::getpid()))).string();
    fs::remove_all(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  std::string folder;
};

TEST_F(Results, ComeBackAsTheyWereWritten) {
  {
    ResultsStore store(folder, kAxes, {"lift, one", "lift two"}, kPrint, Existing::refuse);
    store.append(result_of(3, 0.005));
    store.append(diverged(0));
    EXPECT_EQ(store.results().candidates.front().id, 0);
  }
  const GridResults results = load_grid_results(folder);
  EXPECT_EQ(results.recordings, (std::vector<std::string>{"lift, one", "lift two"}));
  EXPECT_EQ(results.axes[0].name, "young");
  EXPECT_TRUE(results.axes[0].logarithmic);
  ASSERT_EQ(results.candidates.size(), 2u);
  EXPECT_EQ(results.candidates[0].status, CandidateStatus::diverged);
  EXPECT_EQ(results.candidates[0].score, std::numeric_limits<double>::infinity());
  const CandidateResult& result = results.candidates[1];
  EXPECT_EQ(result.values, (std::vector<double>{100, 0.3}));
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.recordings[1].score, 0.01);
  EXPECT_EQ(result.recordings[0].offset, Eigen::Vector3d(0.01, -0.02, 0.1 / 3));
  EXPECT_EQ(result.recordings[0].bounds_hit, (std::vector<std::string>{"offset_x", "time"}));
  ASSERT_EQ(result.recordings[0].keyframes.size(), 2u);
  EXPECT_EQ(result.recordings[0].keyframes[0].points, 120);
  EXPECT_EQ(result.recordings[0].keyframes[1].weight, 0);
}

// As docs/formats.md says it.
TEST_F(Results, DigestIsThatOfTheLinesAndOfTheSearch) {
  {
    ResultsStore store(folder, kAxes, {"lift, one", "lift two"}, kPrint, Existing::refuse);
    store.append(result_of(3, 0.005));
  }
  const auto text = [&](const char* file) { return data::read_file(folder + "/" + file); };
  const auto lines = [&](const char* file) { return text(file).substr(text(file).find('\n') + 1); };
  const std::string line = lines("results.csv");
  const std::size_t last = line.rfind(',');
  EXPECT_EQ(line.substr(last + 1),
            data::sha256(data::sha256(text("grid.json")) + "\n" + line.substr(0, last) + "\n" +
                         lines("registrations.csv") + lines("keyframes.csv"))
                    .substr(0, 16) +
                "\n");
}

TEST_F(Results, GoOnWhereTheyStoppedAfterACutLine) {
  {
    ResultsStore store(folder, kAxes, {"a", "b"}, kPrint, Existing::refuse);
    store.append(result_of(0, 0.005));
    store.append(result_of(1, 0.006));
  }
  std::ofstream(folder + "/results.csv", std::ios::app) << "2,100,0.1,0.00";
  {
    ResultsStore store(folder, kAxes, {"a", "b"}, kPrint, Existing::resume);
    EXPECT_TRUE(store.contains(1));
    EXPECT_FALSE(store.contains(2));
    store.append(result_of(2, 0.007));
  }
  const GridResults results = load_grid_results(folder);
  ASSERT_EQ(results.candidates.size(), 3u);
  EXPECT_EQ(results.candidates[2].recordings[0].score, 0.007);
}

TEST_F(Results, AreNeverMixedWithOthers) {
  { ResultsStore(folder, kAxes, {"a"}, kPrint, Existing::refuse); }
  EXPECT_THROW(ResultsStore(folder, kAxes, {"a"}, kPrint, Existing::refuse), data::InputError);
  const Fingerprint other = {{"time_step_s", "0.005"}, {"asset friction", "0.4"}};
  EXPECT_EQ(
      data::input_error_of([&] { ResultsStore(folder, kAxes, {"a"}, other, Existing::resume); }),
      folder +
          ": --resume: these are not the inputs and settings of its results: asset friction was 0.3 and is "
          "0.4, and 1 more; name another folder, or repeat the first command");
  EXPECT_NO_THROW(ResultsStore(folder, kAxes, {"a"}, kPrint, Existing::resume));
}

// Their lines stand in it, and results.csv repeats the registration of the first.
TEST_F(Results, OfRecordingsInAnotherOrderAreNotGoneOnWith) {
  { ResultsStore(folder, kAxes, {"a", "b"}, kPrint, Existing::refuse); }
  EXPECT_EQ(data::input_error_of([&] {
              ResultsStore(folder, kAxes, {"b", "a"}, kPrint, Existing::resume);
            }),
            folder + ": --resume: found the recordings b, a, expected a, b, in the order of its results");
  EXPECT_NO_THROW(ResultsStore(folder, kAxes, {"a", "b"}, kPrint, Existing::resume));
}

TEST_F(Results, WithoutTheirGridFileAreLeftAsTheyAre) {
  {
    ResultsStore store(folder, kAxes, {"a", "b"}, kPrint, Existing::refuse);
    store.append(result_of(0, 0.005));
  }
  const std::string whole = folder + "/whole";
  fs::create_directories(whole);
  for (const char* table : {"results.csv", "registrations.csv", "keyframes.csv"})
    fs::rename(folder + "/" + table, whole + "/" + table);
  for (const char* file : {"summary.json", "report.html", "best"}) std::ofstream(whole + "/" + file) << "{}";
  fs::remove(folder + "/grid.json");
  for (const char* file :
       {"results.csv", "registrations.csv", "keyframes.csv", "summary.json", "report.html", "best"}) {
    const std::string there = folder + "/there/";
    fs::create_directories(there);
    fs::copy(whole + "/" + file, there);
    for (const Existing existing : {Existing::refuse, Existing::resume})
      EXPECT_EQ(data::input_error_of([&] {
                  ResultsStore(there, kAxes, {"a", "b"}, kPrint, existing);
                }),
                there + ": found " + file +
                    " without the grid.json of its search, expected a folder without results; name another "
                    "folder, or --force to overwrite");
    EXPECT_EQ(std::distance(fs::directory_iterator(there), {}), 1) << file;  // not even .lock
    EXPECT_EQ(data::read_file(there + file), data::read_file(whole + "/" + file));
    EXPECT_NO_THROW(ResultsStore(there, kAxes, {"a", "b"}, kPrint, Existing::replace));
    fs::remove_all(there);
  }
}

// grid.json is written last.
TEST_F(Results, OfASearchThatWasKilledAtItsBeginningAreBegunAgain) {
  { ResultsStore(folder, kAxes, {"a", "b"}, kPrint, Existing::refuse); }
  std::ofstream(folder + "/results.csv", std::ios::trunc).flush();
  fs::remove(folder + "/grid.json");
  for (const Existing existing : {Existing::refuse, Existing::resume}) {
    ResultsStore(folder, kAxes, {"a", "b"}, kPrint, existing).append(result_of(0, 0.005));
    EXPECT_EQ(load_grid_results(folder).candidates.size(), 1u);
    { ResultsStore(folder, kAxes, {"a", "b"}, kPrint, Existing::replace); }
    fs::remove(folder + "/grid.json");
  }
}

// A rename that a power cut has cut short.
TEST_F(Results, WithAnEmptyTableGoOnFromTheBeginning) {
  const auto text = [&](const char* file) { return data::read_file(folder + "/" + file); };
  { ResultsStore(folder, kAxes, {"a", "b"}, kPrint, Existing::refuse).append(result_of(0, 0.005)); }
  const char* const files[] = {"results.csv", "registrations.csv", "keyframes.csv"};
  std::vector<std::string> whole;
  for (const char* file : files) whole.push_back(text(file));
  for (const char* empty : files) {
    std::ofstream(folder + "/" + empty, std::ios::trunc).flush();
    EXPECT_EQ(data::input_error_of([&] { load_grid_results(folder); }),
              folder + "/" + empty +
                  ": header: found an empty file, expected the names of the columns; grid --resume finds its "
                  "lines again");
    ResultsStore store(folder, kAxes, {"a", "b"}, kPrint, Existing::resume);
    EXPECT_FALSE(store.contains(0)) << empty;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_EQ(text(files[i]), whole[i].substr(0, whole[i].find('\n') + 1)) << files[i];
    store.append(result_of(0, 0.005));
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(text(files[i]), whole[i]) << files[i];
  }
}

// What is left when the program ends between the lines of a batch, or within one.
TEST_F(Results, LinesThatBelongToNoResultAreCutOffAndTheRestStaysAsItWas) {
  {
    ResultsStore store(folder, kAxes, {"a", "b"}, kPrint, Existing::refuse);
    store.append({result_of(0, 0.005), result_of(1, 0.006)});
  }
  const auto text = [&](const char* file) { return data::read_file(folder + "/" + file); };
  const char* const files[] = {"results.csv", "registrations.csv", "keyframes.csv"};
  std::vector<std::string> whole;
  for (const char* file : files) whole.push_back(text(file));
  std::ofstream(folder + "/keyframes.csv", std::ios::app)
      << "2,a,0.1,0.5,120,1\n2,a,0.2,0.5,120,1\n2,b,0.1,0.";
  std::ofstream(folder + "/registrations.csv", std::ios::app) << "2,a,0.5,0,0,0,0,0,\n2,";
  std::ofstream(folder + "/results.csv", std::ios::app) << "2,100,0.1,0.00";
  std::ofstream(folder + "/summary.json.123-0.tmp") << "{";
  ResultsStore(folder, kAxes, {"a", "b"}, kPrint, Existing::resume);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(text(files[i]), whole[i]) << files[i];
  EXPECT_FALSE(fs::exists(folder + "/summary.json.123-0.tmp"));
}

TEST_F(Results, HaveOneWriterAtATime) {
  const ResultsStore store(folder, kAxes, {"a"}, kPrint, Existing::refuse);
  EXPECT_NE(data::input_error_of([&] {
              ResultsStore(folder, kAxes, {"a"}, kPrint, Existing::resume);
            }).find("another run is writing to it"),
            std::string::npos);
}

TEST_F(Results, OfARunningSearchAreNotReplaced) {
  {
    ResultsStore store(folder, kAxes, {"a", "b"}, kPrint, Existing::refuse);
    store.append(result_of(0, 0.005));
    EXPECT_THROW(ResultsStore(folder, kAxes, {"a", "b"}, kPrint, Existing::replace), data::InputError);
    EXPECT_EQ(load_grid_results(folder).candidates.size(), 1u);
  }
  fs::create_directories(folder + "/best/a");
  std::ofstream(folder + "/summary.json") << "{}";
  std::ofstream(folder + "/notes.txt") << "mine";
  const ResultsStore store(folder, kAxes, {"a", "b"}, kPrint, Existing::replace);
  EXPECT_TRUE(load_grid_results(folder).candidates.empty());
  EXPECT_FALSE(fs::exists(folder + "/best"));
  EXPECT_FALSE(fs::exists(folder + "/summary.json"));
  EXPECT_TRUE(fs::exists(folder + "/notes.txt"));
}

TEST_F(Results, HeaderNamesTheColumnsOfTheContract) {
  { ResultsStore(folder, kAxes, {"a"}, kPrint, Existing::refuse); }
  std::ifstream file(folder + "/results.csv");
  std::string header;
  std::getline(file, header);
  EXPECT_EQ(header,
            "id,young,friction,score_m,converged,residual_max,penetration_max_m,offset_x,offset_y,offset_z,"
            "time_offset_s,status,yaw_rad,bounds_hit,digest");
}

GridResults two_keyframes() {
  CandidateResult candidate;
  candidate.recordings.resize(2);
  candidate.recordings[0].keyframes = {{1.0, 0.002, 100, 1}, {2.0, 0.008, 100, 1}};
  candidate.recordings[1].keyframes = {{1.0, 0.004, 100, 1}, {2.0, 0.006, 100, 1}};
  for (RecordingScore& recording : candidate.recordings) recording.score = 0.005;
  candidate.score = 0.005;
  GridResults results;
  results.candidates = {candidate};
  return results;
}

TEST(GridResults, ScoresAreFormedFromWhatIsPredictable) {
  GridResults results = two_keyframes();
  drop_beyond_horizons({1.5, std::nullopt}, results);
  const CandidateResult& candidate = results.candidates[0];
  EXPECT_DOUBLE_EQ(candidate.recordings[0].score, 0.002);
  EXPECT_EQ(candidate.recordings[0].keyframes[1].weight, 0);
  EXPECT_DOUBLE_EQ(candidate.recordings[1].score, 0.005);
  EXPECT_DOUBLE_EQ(candidate.score, 0.0035);
}

TEST(GridResults, ARecordingIsNeverLeftWithoutKeyframes) {
  GridResults results = two_keyframes();
  drop_beyond_horizons({0.5, 0.5}, results);
  EXPECT_DOUBLE_EQ(results.candidates[0].score, 0.005);
}

}  // namespace
}  // namespace flash::sysid
