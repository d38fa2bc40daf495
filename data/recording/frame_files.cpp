#include "data/recording/frame_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/motion/pose_numbers.h"
#include "data/motion/pose_table.h"

namespace flash::data {
namespace {

namespace fs = std::filesystem;

}  // namespace

bool natural_less(const std::string& a, const std::string& b) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const auto digits = [&](const std::string& text, std::size_t& at) {
      std::size_t begin = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      while (begin + 1 < at && text[begin] == '0') ++begin;
      return text.substr(begin, at - begin);
    };
    const std::string m = digits(a, i), n = digits(b, j);
    if (m.size() != n.size()) return m.size() < n.size();
    if (m != n) return m < n;
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;  // they differ in leading zeros
}

std::vector<std::string> files_in_order(const std::string& folder,
                                        const std::vector<std::string>& extensions) {
  if (!fs::is_directory(folder)) throw InputError(folder + ": is no folder, expected one with files");
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string path = entry.path().string();
    if (std::find(extensions.begin(), extensions.end(), lower_extension(path)) == extensions.end()) continue;
    std::error_code unknown;
    if (!entry.is_regular_file(unknown))
      throw InputError(path + ": is no regular file, expected one: frames are numbered in order of name");
    files.push_back(path);
  }
  std::sort(files.begin(), files.end(), natural_less);
  return files;
}

namespace {

/// The last run of digits of a name, with decimals where it has them.
std::string_view number_in(std::string_view name) {
  const auto is_digit = [&](std::size_t at) { return name[at] >= '0' && name[at] <= '9'; };
  std::size_t end = name.size();
  while (end > 0 && !is_digit(end - 1)) --end;
  std::size_t begin = end;
  const auto take_digits = [&] {
    while (begin > 0 && is_digit(begin - 1)) --begin;
  };
  take_digits();
  if (begin > 1 && name[begin - 1] == '.' && is_digit(begin - 2)) {  // 1764000000.25
    --begin;
    take_digits();
  }
  return name.substr(begin, end - begin);
}

/// Seconds of the day, where digits are those of a clock: HHMMSS, after YYYYMMDD or before milliseconds too.
std::optional<double> clock_of(std::string_view digits) {
  constexpr std::size_t kDate = 8, kClock = 6, kMilliseconds = 3;
  if (digits.size() >= kDate + kClock) digits.remove_prefix(kDate);
  if (digits.size() != kClock && digits.size() != kClock + kMilliseconds) return std::nullopt;
  const std::optional<long> all = parse_integer(digits.substr(0, kClock));
  if (!all) return std::nullopt;
  const long hours = *all / 10'000, minutes = *all / 100 % 100, seconds = *all % 100;
  if (hours > 23 || minutes > 59 || seconds > 59) return std::nullopt;
  const std::optional<long> thousandths = parse_integer("0" + std::string(digits.substr(kClock)));
  return static_cast<double>(3600 * hours + 60 * minutes + seconds) +
         1e-3 * static_cast<double>(thousandths.value_or(0));
}

/// Index of the step that is more than one and a half times the median one, the longest; empty where none is.
std::optional<std::size_t> leap_in(const std::vector<double>& numbers) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < numbers.size(); ++i) steps.push_back(numbers[i] - numbers[i - 1]);
  if (steps.size() < 2) return std::nullopt;
  const auto widest = std::max_element(steps.begin(), steps.end()) - steps.begin();
  const double longest = steps[static_cast<std::size_t>(widest)];
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>((steps.size() - 1) / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  if (!(longest > 1.5 * *middle)) return std::nullopt;
  return static_cast<std::size_t>(widest);
}

}  // namespace

std::string gap_in_names(const std::vector<std::string>& files) {
  std::vector<double> counts, clocks;
  for (const std::string& file : files) {
    const std::string name = fs::path(file).stem().string();
    const std::string_view digits = number_in(name);
    const std::optional<double> count = parse_number(digits), clock = clock_of(digits);
    if (!count) return "";
    counts.push_back(*count);
    if (clock) clocks.push_back(*clock);
  }
  const std::optional<std::size_t> leap = leap_in(counts);
  // Digits of a clock leap at the minute, where its seconds do not.
  if (!leap || (clocks.size() == counts.size() && !leap_in(clocks))) return "";
  return "no frame between " + fs::path(files[*leap]).filename().string() + " and " +
         fs::path(files[*leap + 1]).filename().string();
}

std::vector<double> load_frame_times(const std::string& path, std::size_t frames) {
  const std::string text = read_file(path);
  LineReader lines(text);
  std::string_view line;
  lines.next(line);
  const char* const separator = line.find(';') == std::string_view::npos ? "," : ";";
  const std::vector<std::string_view> names = split(line, separator);
  const auto column = std::find_if(names.begin(), names.end(), [](std::string_view name) {
    return name == "t_s" || column_name(trimmed(name)) == "t";
  });
  if (column == names.end())
    throw input_error(path, "header", "found \"" + std::string(line) + "\", expected a column t or t_s");
  const std::size_t index = static_cast<std::size_t>(column - names.begin());
  std::vector<double> result;
  while (lines.next(line)) {
    if (line.empty()) continue;
    const std::vector<std::string_view> cells = split(line, separator);
    std::optional<double> time = cells.size() == names.size() ? parse_number(cells[index]) : std::nullopt;
    if (time) time = seconds_of(*time);
    if (!time || !std::isfinite(*time) || (!result.empty() && *time <= result.back()))
      throw input_error(path, "line " + std::to_string(lines.number()),
                        "found \"" + std::string(line) + "\", expected strictly increasing times");
    result.push_back(*time);
  }
  if (result.size() != frames)
    throw InputError(path + ": found " + std::to_string(result.size()) + " times, expected " +
                     std::to_string(frames) + ", one a frame");
  return result;
}

std::vector<std::string> find_jumps(const Trajectory& trajectory, const std::string& path) {
  constexpr double fastest = 5;      // no arm moves cloth faster [m/s]
  constexpr double shortest = 0.02;  // shorter ones are rounding of close stamps [m]
  constexpr double longest = 20;     // no arm reaches farther [m]
  std::size_t count = 0, first = 0, in_millimetres = 0;
  double farthest = 0, reach = 0;
  for (std::size_t i = 1; i < trajectory.poses.size(); ++i) {
    const double distance =
        (trajectory.poses[i].translation() - trajectory.poses[i - 1].translation()).norm();
    reach = std::max(reach, trajectory.poses[i].translation().norm());
    const double duration = trajectory.times[i] - trajectory.times[i - 1];
    in_millimetres += 1e-3 * distance >= shortest && 1e-3 * distance >= fastest * duration;
    if (distance < shortest || distance < fastest * duration) continue;
    if (count++ == 0) first = i;
    farthest = std::max(farthest, distance);
  }
  if (count == 0) return {};
  return {path + ": " + (count == 1 ? "a jump" : std::to_string(count) + " jumps") + " of up to " +
          format_short(farthest) + " m from one pose to the next, faster than " + format_short(fastest) +
          " m/s; first after pose " + std::to_string(first) +
          (in_millimetres == 0 && reach > longest ? ": are the poses in millimetres? Expected metres"
                                                  : ": is the trajectory of one piece?")};
}

}  // namespace flash::data
