#include "sysid/emulate/candidate_lines.h"

#include "data/files/sha256.h"
#include "data/files/text.h"
#include "sysid/emulate/results_table.h"

namespace flash::sysid {
namespace {

constexpr std::size_t kDigits = 16;  // Hexadecimal digits of a sum. Work.

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
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
  return line;
}

}  // namespace

std::vector<std::string> results_columns(const std::vector<Axis>& axes) {
  std::vector<std::string> names = {"id"};
  for (const Axis& axis : axes) names.push_back(axis.name);
  names.insert(names.end(),
               {"score_m", "converged", "residual_max", "penetration_max_m", "offset_x", "offset_y",
                "offset_z", "time_offset_s", "status", "yaw_rad", "bounds_hit", "digest"});
  return names;
}

std::vector<std::string> registrations_columns() {
  return {"id",       "recording", "score_m",       "offset_x",  "offset_y",
          "offset_z", "yaw_rad",   "time_offset_s", "bounds_hit"};
}

std::vector<std::string> keyframes_columns() {
  return {"id", "recording", "t", "score_m", "points", "weight"};
}

CandidateLines lines_of(const CandidateResult& result, const std::vector<std::string>& recordings) {
  CandidateLines lines;
  lines.result = results_line(result);
  for (std::size_t r = 0; r < result.recordings.size(); ++r) {
    const RecordingScore& recording = result.recordings[r];
    const std::string head = std::to_string(result.id) + "," + quoted_field(recordings[r]);
    lines.registrations += head;
    for (const double value : {recording.score, recording.offset.x(), recording.offset.y(),
                               recording.offset.z(), recording.yaw, recording.time_offset}) {
      lines.registrations += "," + data::format_number(value);
    }
    lines.registrations += "," + joined(recording.bounds_hit) + "\n";
    for (const KeyframeScore& keyframe : recording.keyframes) {
      lines.keyframes += head + "," + data::format_number(keyframe.t) + "," +
                         data::format_number(keyframe.score) + "," + std::to_string(keyframe.points) + "," +
                         data::format_number(keyframe.weight) + "\n";
    }
  }
  return lines;
}

std::string digest_of(const CandidateLines& lines, const std::string& search) {
  return data::sha256(search + '\n' + lines.result + '\n' + lines.registrations + lines.keyframes)
      .substr(0, kDigits);
}

std::string digest_of(const GridResults& results) {
  std::string digests;
  for (const CandidateResult& candidate : results.candidates) digests += candidate.digest + '\n';
  return data::sha256(digests).substr(0, kDigits);
}

}  // namespace flash::sysid
