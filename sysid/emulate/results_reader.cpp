#include "sysid/emulate/results_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "sysid/emulate/candidate_lines.h"
#include "sysid/emulate/grid_file.h"
#include "sysid/emulate/results_table.h"
#include "sysid/observe/registration_parameter.h"

namespace flash::sysid {
namespace {

std::string path_of(const std::string& folder, const char* file) {
  return (std::filesystem::path(folder) / file).string();
}

/// Numbers are read back as they were written; only the order of a sum may differ.
bool same_sum(double a, double b) { return a == b || std::abs(a - b) <= 1e-9 * std::abs(b); }

CandidateStatus status_of(const Row& row) {
  const std::string& text = row.text("status");
  for (const auto status : {CandidateStatus::ok, CandidateStatus::unconverged, CandidateStatus::diverged}) {
    if (text == to_string(status)) return status;
  }
  throw row.error("status", "ok, unconverged or diverged");
}

/// What a score can be under a status.
void check_score(const Row& row, CandidateStatus status) {
  const bool none = std::isinf(row.score("score_m")), diverged = status == CandidateStatus::diverged;
  if (none != diverged)
    throw row.error("score_m", std::string(diverged ? "inf" : "a finite number") + ", as the status is " +
                                   to_string(status));
}

std::vector<std::string> bounds_of(const Row& row) {
  std::vector<std::string> bounds;
  for (const std::string_view word : data::split(row.text("bounds_hit"))) {
    if (word.empty()) continue;
    if (std::none_of(std::begin(registration_parameters), std::end(registration_parameters),
                     [&](const RegistrationParameter& parameter) { return word == parameter.name; }))
      throw row.error("bounds_hit", "names of offset_x, offset_y, offset_z, yaw and time");
    bounds.emplace_back(word);
  }
  return bounds;
}

/// One line of results.csv. Throws data::InputError unless it is of a candidate of the grid.
CandidateResult read_result(const Row& row, const GridFile& grid) {
  CandidateResult result;
  result.id = row.index("id");
  const double count = count_candidates(grid.axes);
  if (!(result.id < count))
    throw row.error("id", "0 to " + data::format_number(count - 1) + ", a candidate of grid.json");
  result.values = values_of(grid.axes, result.id);
  for (std::size_t k = 0; k < grid.axes.size(); ++k)
    row.expect(grid.axes[k].name, result.values[k], "as in grid.json");
  result.score = row.score("score_m");
  result.converged = row.boolean("converged");
  result.residual_max = row.not_negative("residual_max");
  result.penetration_max = row.not_negative("penetration_max_m");
  for (const char* name : {"offset_x", "offset_y", "offset_z", "time_offset_s", "yaw_rad"}) row.finite(name);
  result.status = status_of(row);
  if (result.converged != (result.status == CandidateStatus::ok))
    throw row.error("converged", std::string(result.converged ? "false" : "true") + ", as the status is " +
                                     to_string(result.status));
  check_score(row, result.status);
  if (!grid.fingerprint || !result.converged) return result;
  const auto tolerance = grid.fingerprint->find("tolerance");
  const auto allowed =
      tolerance == grid.fingerprint->end() ? std::nullopt : data::parse_number(tolerance->second);
  if (allowed && result.residual_max > *allowed && !same_sum(result.residual_max, *allowed))
    throw row.error("residual_max",
                    "at most the tolerance of " + tolerance->second + " in grid.json, as it converged");
  return result;
}

/// Reads registrations and keyframes beside each other, candidate by candidate.
class ScoreReader {
 public:
  ScoreReader(const std::string& folder, const std::vector<std::string>& recordings, CutLine cut)
      : registrations_(path_of(folder, "registrations.csv"), registrations_columns(), cut),
        keyframes_(path_of(folder, "keyframes.csv"), keyframes_columns(), cut),
        names_(recordings),
        observed_(recordings.size()) {}

  /// Those of `result`, which are next in both files. False where one of them ends before.
  bool read(CandidateResult& result) {
    lines_ = {};
    for (std::size_t r = 0; r < names_.size(); ++r) {
      const Row* const row = registrations_.row();
      if (row == nullptr) return lacks(registrations_);
      expect_next(*row, result.id, names_[r]);
      RecordingScore& recording = result.recordings.emplace_back();
      recording.score = row->score("score_m");
      check_score(*row, result.status);
      recording.offset = {row->finite("offset_x"), row->finite("offset_y"), row->finite("offset_z")};
      recording.yaw = row->finite("yaw_rad");
      recording.time_offset = row->finite("time_offset_s");
      recording.bounds_hit = bounds_of(*row);
      if (result.status != CandidateStatus::diverged) {
        if (!read_keyframes(result.id, r, recording.keyframes)) return lacks(keyframes_);
        const double mean = mean_score(recording.keyframes).value_or(std::numeric_limits<double>::infinity());
        if (!same_sum(recording.score, mean)) {
          if (keyframes_.row() == nullptr && first_ == result.id) return lacks(keyframes_);
          throw row->error("score_m", data::format_number(mean) + ", the mean of its keyframes.csv");
        }
      }
      lines_.registrations += std::string(row->line()) + '\n';
      registrations_.next();
    }
    return true;
  }

  /// Throws where what is left belongs to a candidate of `ids`; with `refuse`, where anything is left.
  void expect_no_more(const std::set<int>& ids, Incomplete incomplete) {
    for (Table* table : {&registrations_, &keyframes_})
      for (; table->row() != nullptr; table->next()) {
        const int id = table->row()->index("id");
        if (ids.count(id) > 0) throw table->row()->error("id", "no more lines of this candidate");
        if (incomplete == Incomplete::refuse)
          throw table->row()->error("id", "a candidate of results.csv; grid --resume finds it again");
      }
  }

  /// Of the candidate that was read last; `result` is left empty.
  const CandidateLines& lines() const { return lines_; }

  /// The file that ended within a candidate.
  const std::string& ended() const { return ended_; }

 private:
  bool lacks(const Table& table) {
    ended_ = table.path();
    return false;
  }

  static void expect_next(const Row& row, int id, const std::string& recording) {
    const std::string why = "the next of results.csv and grid.json";
    row.expect("id", id, why);
    row.expect("recording", recording, why);
  }

  /// The first candidate tells what was observed; the others have the same. False where the file ends before.
  bool read_keyframes(int id, std::size_t r, std::vector<KeyframeScore>& keyframes) {
    if (first_ < 0) first_ = id;
    const std::string why = "as of candidate " + std::to_string(first_);
    const auto read_one = [&](const Row& row) {
      lines_.keyframes += std::string(row.line()) + '\n';
      const double score = row.score("score_m");
      if (!std::isfinite(score)) throw row.error("score_m", "a finite number");
      return KeyframeScore{row.finite("t"), score, row.index("points"), row.not_negative("weight")};
    };
    if (first_ == id) {
      for (const Row* row = keyframes_.row();
           row != nullptr && row->index("id") == id && row->text("recording") == names_[r];
           keyframes_.next(), row = keyframes_.row())
        keyframes.push_back(read_one(*row));
      observed_[r] = keyframes;
      if (keyframes.empty() && keyframes_.row() != nullptr) expect_next(*keyframes_.row(), id, names_[r]);
      return !keyframes.empty();
    }
    for (const KeyframeScore& observed : observed_[r]) {
      const Row* const row = keyframes_.row();
      if (row == nullptr) return false;
      expect_next(*row, id, names_[r]);
      row->expect("t", observed.t, why);
      row->expect("points", observed.points, why);
      row->expect("weight", observed.weight, why);
      keyframes.push_back(read_one(*row));
      keyframes_.next();
    }
    return true;
  }

  Table registrations_, keyframes_;
  const std::vector<std::string>& names_;
  std::vector<std::vector<KeyframeScore>> observed_;  ///< by recording, of the first candidate that has any
  int first_ = -1;                                    ///< its id
  std::string ended_;
  CandidateLines lines_;
};

/// results.csv repeats what registrations.csv holds: the mean of the scores, and the first registration.
void check_against_recordings(const Row& row, const CandidateResult& result) {
  double mean = 0;
  for (const RecordingScore& recording : result.recordings)
    mean += recording.score / static_cast<double>(result.recordings.size());
  if (!same_sum(result.score, mean))
    throw row.error("score_m", data::format_number(mean) + ", the mean of its registrations.csv");
  const RecordingScore& first = result.recordings.front();
  const std::string why = "as in registrations.csv";
  row.expect("offset_x", first.offset.x(), why);
  row.expect("offset_y", first.offset.y(), why);
  row.expect("offset_z", first.offset.z(), why);
  row.expect("yaw_rad", first.yaw, why);
  row.expect("time_offset_s", first.time_offset, why);
}

/// The digest stands last in its line and covers the rest of it.
void check_digest(const Row& row, CandidateLines lines, const std::string& search) {
  lines.result = row.line().substr(0, row.line().rfind(','));
  row.expect(
      "digest", digest_of(lines, search),
      "as of its lines in the tables and grid.json: one belongs to another search, or was edited; grid "
      "--force searches anew");
}

/// Only axes and numbers stand in results.csv.
void check_plain_text(const std::string& path) {
  const std::string text = data::read_file(path);
  const auto odd = std::find_if(text.begin(), text.end(),
                                [](char c) { return (c < ' ' || c > '~') && c != '\n' && c != '\r'; });
  if (odd != text.end())
    throw data::InputError(path + ":" + std::to_string(1 + std::count(text.begin(), odd, '\n')) +
                           ": found a byte that is no letter, digit or sign");
}

}  // namespace

GridResults load_grid_results(const std::string& folder, Incomplete incomplete) {
  const GridFile grid = load_grid_file(path_of(folder, "grid.json"));
  const CutLine cut = incomplete == Incomplete::refuse ? CutLine::refuse : CutLine::leave_out;
  check_plain_text(path_of(folder, "results.csv"));
  const std::string search = search_digest(grid);
  Table lines(path_of(folder, "results.csv"), results_columns(grid.axes), cut);
  ScoreReader scores(folder, grid.recordings, cut);
  GridResults results{grid.axes, grid.recordings, {}};
  std::set<int> seen, whole;
  for (bool complete = true; lines.row() != nullptr; lines.next()) {
    CandidateResult result = read_result(*lines.row(), grid);
    if (!seen.insert(result.id).second) throw lines.row()->error("id", "each id once");
    complete = complete && scores.read(result);
    if (!complete && incomplete == Incomplete::refuse)
      throw data::InputError(
          scores.ended() + ": candidate " + std::to_string(result.id) +
          ": found the end of the file, expected all its lines; grid --resume finds it again");
    if (!complete) continue;
    check_against_recordings(*lines.row(), result);
    check_digest(*lines.row(), scores.lines(), search);
    result.digest = lines.row()->text("digest");
    whole.insert(result.id);
    results.candidates.push_back(std::move(result));
  }
  scores.expect_no_more(whole, incomplete);
  std::sort(results.candidates.begin(), results.candidates.end(),
            [](const CandidateResult& a, const CandidateResult& b) { return a.id < b.id; });
  return results;
}

}  // namespace flash::sysid
