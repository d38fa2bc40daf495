#include "calib/dataset/picture_names.h"

#include <cmath>
#include <map>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/motion/pose_file.h"
#include "data/motion/pose_numbers.h"

namespace flash::calib {
namespace {

/// A file's name before the number that data::number_in_name takes.
std::string stem_of(const std::filesystem::path& path) {
  if (time_in_name(path)) return "";
  const std::string name = path.stem().string();
  const std::size_t end = name.find_last_of("0123456789");
  if (end == std::string::npos) return name;
  const std::size_t before = name.find_last_not_of("0123456789", end);
  return before == std::string::npos ? "" : name.substr(0, before + 1);
}

using Counts = std::map<std::string, std::size_t>;

Counts counts_of(const std::vector<std::filesystem::path>& pictures) {
  Counts counts;
  for (const std::filesystem::path& picture : pictures) ++counts[stem_of(picture)];
  return counts;
}

std::string counted(const std::string& stem, const Counts& counts) {
  return std::to_string(counts.at(stem)) + ' ' + stem + 'N';
}

}  // namespace

std::optional<double> time_in_name(const std::filesystem::path& path) {
  std::optional<double> time = data::parse_number(path.stem().string());
  if (!time || !std::isfinite(*time)) return std::nullopt;
  return data::seconds_of(*time);
}

void expect_one_clock(double time, double of_poses, const std::string& picture, const std::string& poses) {
  constexpr double kWall = 5e8, kSimulated = 1e8;  // [s], of 1985 and of three years
  const auto mixed = [](double wall, double simulated) { return wall > kWall && simulated < kSimulated; };
  if (!mixed(time, of_poses) && !mixed(of_poses, time)) return;
  throw data::InputError(
      picture + ": found the time " + data::format_number(time) + " s, and in " + poses + " " +
      data::format_number(of_poses) +
      " s: one is simulated time and the other that of a wall clock, expected both of one clock (in ROS the "
      "parameter use_sim_time of all nodes)");
}

std::string kinds_of_names(const std::vector<std::filesystem::path>& pictures) {
  constexpr std::size_t kMost = 4;
  const Counts counts = counts_of(pictures);
  if (counts.size() < 2 || counts.size() > kMost) return {};
  std::string text;
  for (const auto& [stem, count] : counts) text += (text.empty() ? " (" : ", ") + counted(stem, counts);
  return text + ')';
}

void expect_one_picture_a_number(const std::vector<std::filesystem::path>& pictures) {
  const Counts counts = counts_of(pictures);
  if (counts.size() < 2) return;
  std::map<long, std::string> stems;
  for (const std::filesystem::path& picture : pictures) {
    const std::optional<long> number = data::number_in_name(picture.string());
    if (!number) continue;
    const std::string stem = stem_of(picture);
    const auto [first, fresh] = stems.emplace(*number, stem);
    if (fresh || first->second == stem) continue;
    throw data::InputError(picture.parent_path().string() + ": found pictures of two names, " +
                           counted(first->second, counts) + " and " + counted(stem, counts) +
                           ", with the same numbers, expected one picture a number: which of them are of the "
                           "camera? Put the others elsewhere");
  }
}

}  // namespace flash::calib
