#include "sysid/emulate/results_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "data/atomic_file.h"
#include "data/error.h"
#include "data/json_reader.h"
#include "data/text.h"
#include "sysid/emulate/fingerprint.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;
constexpr const char* kSchema = "flash-sysid-grid/1";

std::string path_of(const std::string& folder, const char* file) {
  return (fs::path(folder) / file).string();
}

/// A CSV field: quoted where it holds a comma or a quote.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words;
  for (const std::string_view word : data::split(text)) {
    if (!word.empty()) words.emplace_back(word);
  }
  return words;
}

std::string results_header(const std::vector<Axis>& axes) {
  std::string header = "id";
  for (const Axis& axis : axes) header += "," + axis.name;
  return header +
         ",score_m,converged,residual_max,penetration_max_m,offset_x,offset_y,offset_z,time_offset_s,status,"
         "yaw_rad,"
         "bounds_hit\n";
}
constexpr const char* kRegistrationsHeader =
    "id,recording,score_m,offset_x,offset_y,offset_z,yaw_rad,time_offset_s,bounds_hit\n";
constexpr const char* kKeyframesHeader = "id,recording,t,score_m,points,weight\n";

/// One row by the names of its columns.
class Row {
 public:
  Row(const std::vector<std::string>& names, std::vector<std::string> fields, std::string place)
      : names_(names), fields_(std::move(fields)), place_(std::move(place)) {
    if (fields_.size() != names_.size())
      throw data::InputError(place_ + ": found " + std::to_string(fields_.size()) + " fields, expected " +
                             std::to_string(names_.size()));
  }

  const std::string& text(const std::string& name) const {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end()) throw data::InputError(place_ + ": " + name + ": the column is missing");
    return fields_[static_cast<std::size_t>(found - names_.begin())];
  }
  double number(const std::string& name) const {
    const std::optional<double> value = data::parse_number(text(name));
    if (!value) throw error(name, "a number");
    return *value;
  }
  double finite(const std::string& name) const {
    const double value = number(name);
    if (!std::isfinite(value)) throw error(name, "a finite number");
    return value;
  }
  /// Infinite where there is none.
  double not_negative(const std::string& name) const {
    const double value = number(name);
    if (!(value >= 0)) throw error(name, "a number of 0 or above");
    return value;
  }
  /// A distance of points [m]; infinite where there is none.
  double score(const std::string& name) const {
    constexpr double kFarthest = 1e3;
    const double value = not_negative(name);
    if (value > kFarthest && std::isfinite(value)) throw error(name, "0 to 1000 m");
    return value;
  }
  bool boolean(const std::string& name) const {
    if (text(name) != "true" && text(name) != "false") throw error(name, "true or false");
    return text(name) == "true";
  }
  int index(const std::string& name) const {
    const int value = data::to_index(number(name));
    if (value < 0) throw error(name, "a whole number from 0");
    return value;
  }
  data::InputError error(const std::string& name, const std::string& expected) const {
    return data::InputError(place_ + ": " + name + ": found \"" + text(name) + "\", expected " + expected);
  }

 private:
  const std::vector<std::string>& names_;
  std::vector<std::string> fields_;
  std::string place_;
};

/// What becomes of a last line without its end, which a search that was killed leaves.
enum class CutLine { refuse, leave_out };

/// Calls `use` for each whole line after the header.
template <class Use>
void for_each_row(const std::string& path, CutLine cut, const Use& use) {
  const std::string text = data::read_file(path);
  const std::string whole = text.substr(0, text.rfind('\n') + 1);
  if (cut == CutLine::refuse && whole.size() < text.size())
    throw data::InputError(path + ": the last line is cut off; grid --resume finds its candidate again");
  data::LineReader lines(whole);
  std::string_view line;
  if (!lines.next(line))
    throw data::input_error(path, "header", "missing, expected the names of the columns");
  const std::vector<std::string> names = fields_of(line);
  while (lines.next(line)) {
    if (!line.empty()) use(Row(names, fields_of(line), path + ":" + std::to_string(lines.number())));
  }
}

/// At the end of the file, and on the disk when it returns.
void append_text(const std::string& path, std::string_view text) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  bool done = descriptor >= 0;
  while (done && !text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    done = written >= 0;
    if (done) text.remove_prefix(static_cast<std::size_t>(written));
  }
  done = done && ::fdatasync(descriptor) == 0;
  const int reason = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!done) throw std::runtime_error(path + ": cannot be written: " + std::strerror(reason));
}

/// Leaves of a file the header and the whole lines whose id is one of `ids`.
void keep_lines_of(const std::string& path, const std::set<int>& ids) {
  const std::string text = data::read_file(path);
  std::string kept;
  data::LineReader lines(std::string_view(text).substr(0, text.rfind('\n') + 1));
  std::string_view line;
  while (lines.next(line)) {
    const std::optional<long> id = data::parse_integer(line.substr(0, line.find(',')));
    const bool header = lines.number() == 1;
    if (header || (id && ids.count(data::to_index(static_cast<double>(*id))) > 0))
      kept += std::string(line) + '\n';
  }
  if (kept != text) data::write_atomically(path, kept);
}

std::string results_line(const CandidateResult& result) {
  const RecordingScore first = result.recordings.empty() ? RecordingScore{} : result.recordings.front();
  std::string line = std::to_string(result.id);
  for (const double value : result.values) line += "," + data::format_number(value);
  for (const std::string& text :
       {data::format_number(result.score), std::string(result.converged ? "true" : "false"),
        data::format_number(result.residual_max), data::format_number(result.penetration_max),
        data::format_number(first.offset.x()), data::format_number(first.offset.y()),
        data::format_number(first.offset.z()), data::format_number(first.time_offset),
        std::string(to_string(result.status)), data::format_number(first.yaw), joined(first.bounds_hit)}) {
    line += "," + text;
  }
  return line + "\n";
}

CandidateStatus status_of(const Row& row) {
  const std::string& text = row.text("status");
  for (const auto status : {CandidateStatus::ok, CandidateStatus::unconverged, CandidateStatus::diverged}) {
    if (text == to_string(status)) return status;
  }
  throw row.error("status", "ok, unconverged or diverged");
}

/// One line of results.csv. Throws data::InputError unless it is of a candidate of the grid.
CandidateResult read_result(const Row& row, const GridResults& grid) {
  CandidateResult result;
  result.id = row.index("id");
  const double count = count_candidates(grid.axes);
  if (!(result.id < count))
    throw row.error("id", "0 to " + data::format_number(count - 1) + ", a candidate of grid.json");
  result.values = values_of(grid.axes, result.id);
  for (std::size_t k = 0; k < grid.axes.size(); ++k)
    if (row.number(grid.axes[k].name) != result.values[k])
      throw row.error(grid.axes[k].name, data::format_number(result.values[k]) + ", as in grid.json");
  result.score = row.score("score_m");
  result.converged = row.boolean("converged");
  result.residual_max = row.not_negative("residual_max");
  result.penetration_max = row.not_negative("penetration_max_m");
  for (const char* name : {"offset_x", "offset_y", "offset_z", "time_offset_s", "yaw_rad"}) row.finite(name);
  result.status = status_of(row);
  const std::string as_status = std::string(", as the status is ") + to_string(result.status);
  if (result.converged != (result.status == CandidateStatus::ok))
    throw row.error("converged", (result.converged ? "false" : "true") + as_status);
  if (result.status != CandidateStatus::diverged && !std::isfinite(result.score))
    throw row.error("score_m", "a finite number" + as_status);
  result.recordings.resize(grid.recordings.size());
  return result;
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

void remove_results(const std::string& folder) {
  for (const char* file :
       {"grid.json", "results.csv", "registrations.csv", "keyframes.csv", "summary.json", "report.html"})
    fs::remove(fs::path(folder) / file);
  fs::remove_all(fs::path(folder) / "best");
}

nlohmann::json load_grid(const std::string& folder) {
  const std::string path = path_of(folder, "grid.json");
  const nlohmann::json grid = data::load_json(path);
  if (!grid.is_object() || grid.value("schema", "") != kSchema || !grid.contains("axes") ||
      !grid.contains("recordings")) {
    throw data::InputError(path + ": schema: expected \"" + kSchema + "\" with axes and recordings");
  }
  return grid;
}

GridResults read_results(const std::string& folder, CutLine cut) {
  GridResults results;
  const nlohmann::json grid = load_grid(folder);
  try {
    for (const nlohmann::json& axis : grid.at("axes")) {
      results.axes.push_back({axis.at("name"), axis.at("values").get<std::vector<double>>(), axis.at("log")});
      if (results.axes.back().values.empty())
        throw data::input_error(path_of(folder, "grid.json"), "axes.values",
                                "found none, expected at least one");
    }
    results.recordings = grid.at("recordings").get<std::vector<std::string>>();
  } catch (const nlohmann::json::exception& error) {
    throw data::InputError(path_of(folder, "grid.json") + ": " + error.what());
  }

  std::map<int, CandidateResult> found;
  check_plain_text(path_of(folder, "results.csv"));
  for_each_row(path_of(folder, "results.csv"), cut, [&](const Row& row) {
    CandidateResult result = read_result(row, results);
    const int id = result.id;
    if (!found.emplace(id, std::move(result)).second) throw row.error("id", "each id once");
  });
  const auto recording_of = [&](const Row& row) -> RecordingScore* {
    const auto candidate = found.find(row.index("id"));
    const auto name = std::find(results.recordings.begin(), results.recordings.end(), row.text("recording"));
    if (name == results.recordings.end()) throw row.error("recording", "a recording of grid.json");
    if (candidate == found.end()) return nullptr;
    return &candidate->second.recordings[name - results.recordings.begin()];
  };
  for_each_row(path_of(folder, "registrations.csv"), cut, [&](const Row& row) {
    RecordingScore* recording = recording_of(row);
    if (recording == nullptr) return;
    recording->score = row.score("score_m");
    recording->offset = {row.finite("offset_x"), row.finite("offset_y"), row.finite("offset_z")};
    recording->yaw = row.finite("yaw_rad");
    recording->time_offset = row.finite("time_offset_s");
    recording->bounds_hit = words_of(row.text("bounds_hit"));
    recording->keyframes.clear();
  });
  for_each_row(path_of(folder, "keyframes.csv"), cut, [&](const Row& row) {
    RecordingScore* recording = recording_of(row);
    if (recording == nullptr) return;
    const KeyframeScore score{row.finite("t"), row.score("score_m"), row.index("points"),
                              row.not_negative("weight")};
    // A candidate interrupted between its keyframes and its result is computed again: the later line counts.
    const auto same = std::find_if(recording->keyframes.begin(), recording->keyframes.end(),
                                   [&](const KeyframeScore& k) { return k.t == score.t; });
    if (same != recording->keyframes.end()) {
      *same = score;
    } else {
      recording->keyframes.push_back(score);
    }
  });
  for (auto& [id, result] : found) results.candidates.push_back(std::move(result));
  return results;
}
// Weighted mean of the keyframes that carry points; empty where none does.
std::optional<double> mean_score(const std::vector<KeyframeScore>& keyframes) {
  double sum = 0, weight = 0;
  for (const KeyframeScore& keyframe : keyframes) {
    if (keyframe.points == 0) continue;
    sum += keyframe.weight * keyframe.score;
    weight += keyframe.weight;
  }
  if (weight > 0) return sum / weight;
  return std::nullopt;
}

}  // namespace

const char* to_string(CandidateStatus status) {
  switch (status) {
    case CandidateStatus::ok:
      return "ok";
    case CandidateStatus::unconverged:
      return "unconverged";
    case CandidateStatus::diverged:
      return "diverged";
  }
  return "";
}

GridResults load_grid_results(const std::string& folder) { return read_results(folder, CutLine::refuse); }

ResultsStore::ResultsStore(const std::string& folder, const std::vector<Axis>& axes,
                           const std::vector<std::string>& recordings, const Fingerprint& fingerprint,
                           Existing existing)
    : folder_(folder) {
  fs::create_directories(folder);
  lock_ = ::open(path_of(folder, ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0) throw std::runtime_error(folder + ": cannot be written: " + std::strerror(errno));
  try {
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0)
      throw data::InputError(folder + ": another run is writing to it; wait for it, or name another folder");
    data::remove_leftovers(folder);
    if (existing == Existing::replace) remove_results(folder);
    if (!fs::exists(path_of(folder, "grid.json")))
      begin(axes, recordings, fingerprint);
    else if (existing == Existing::resume)
      go_on(fingerprint);
    else
      throw data::InputError(folder + ": holds results already; go on with --resume, or name another folder");
  } catch (...) {
    ::close(lock_);
    throw;
  }
}

ResultsStore::~ResultsStore() { ::close(lock_); }

void ResultsStore::begin(const std::vector<Axis>& axes, const std::vector<std::string>& recordings,
                         const Fingerprint& fingerprint) {
  results_.axes = axes;
  results_.recordings = recordings;
  nlohmann::json grid = {{"schema", kSchema}, {"fingerprint", fingerprint}, {"recordings", recordings}};
  grid["axes"] = nlohmann::json::array();
  for (const Axis& axis : axes) {
    grid["axes"].push_back({{"name", axis.name}, {"values", axis.values}, {"log", axis.logarithmic}});
  }
  data::write_atomically(path_of(folder_, "registrations.csv"), kRegistrationsHeader);
  data::write_atomically(path_of(folder_, "keyframes.csv"), kKeyframesHeader);
  data::write_atomically(path_of(folder_, "results.csv"), results_header(axes));
  data::write_atomically(path_of(folder_, "grid.json"), grid.dump(1) + "\n");  // last: all is there
}

void ResultsStore::go_on(const Fingerprint& fingerprint) {
  const nlohmann::json grid = load_grid(folder_);
  const auto was = grid.find("fingerprint");
  const std::string changed = was == grid.end() || !was->is_object()
                                  ? "they come from another version of the program"
                                  : difference(was->get<Fingerprint>(), fingerprint);
  if (!changed.empty()) {
    throw data::InputError(folder_ + ": --resume: these are not the inputs and settings of its results: " +
                           changed + "; name another folder, or repeat the first command");
  }
  results_ = read_results(folder_, CutLine::leave_out);
  std::set<int> ids;
  for (const CandidateResult& result : results_.candidates) ids.insert(result.id);
  for (const char* file : {"results.csv", "registrations.csv", "keyframes.csv"}) {
    keep_lines_of(path_of(folder_, file), ids);
  }
}

void ResultsStore::append(const std::vector<CandidateResult>& batch) {
  std::string registrations, keyframes, lines;
  for (const CandidateResult& result : batch) {
    lines += results_line(result);
    for (std::size_t r = 0; r < result.recordings.size(); ++r) {
      const RecordingScore& recording = result.recordings[r];
      const std::string head = std::to_string(result.id) + "," + field(results_.recordings[r]);
      registrations += head;
      for (const double value : {recording.score, recording.offset.x(), recording.offset.y(),
                                 recording.offset.z(), recording.yaw, recording.time_offset}) {
        registrations += "," + data::format_number(value);
      }
      registrations += "," + joined(recording.bounds_hit) + "\n";
      for (const KeyframeScore& keyframe : recording.keyframes) {
        keyframes += head + "," + data::format_number(keyframe.t) + "," +
                     data::format_number(keyframe.score) + "," + std::to_string(keyframe.points) + "," +
                     data::format_number(keyframe.weight) + "\n";
      }
    }
  }
  append_text(path_of(folder_, "keyframes.csv"), keyframes);
  append_text(path_of(folder_, "registrations.csv"), registrations);
  append_text(path_of(folder_, "results.csv"), lines);
  for (const CandidateResult& result : batch) {
    const auto place = std::lower_bound(results_.candidates.begin(), results_.candidates.end(), result,
                                        [](const auto& a, const auto& b) { return a.id < b.id; });
    results_.candidates.insert(place, result);
  }
}

bool ResultsStore::contains(int id) const {
  return std::any_of(results_.candidates.begin(), results_.candidates.end(),
                     [&](const CandidateResult& result) { return result.id == id; });
}

void drop_beyond_horizons(const std::vector<std::optional<double>>& horizons, GridResults& results) {
  for (CandidateResult& candidate : results.candidates) {
    if (candidate.status == CandidateStatus::diverged) continue;
    candidate.score = 0;
    for (std::size_t r = 0; r < candidate.recordings.size(); ++r) {
      RecordingScore& recording = candidate.recordings[r];
      std::vector<KeyframeScore> kept = recording.keyframes;
      for (KeyframeScore& keyframe : kept)
        if (horizons[r] && keyframe.t >= *horizons[r]) keyframe.weight = 0;
      if (const auto score = mean_score(kept)) {
        recording.keyframes = std::move(kept);
        recording.score = *score;
      }
      candidate.score += recording.score / static_cast<double>(candidate.recordings.size());
    }
  }
}

}  // namespace flash::sysid
