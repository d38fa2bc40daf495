#include "calib/dataset/target.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "calib/dataset/kalibr.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"

namespace flash::calib {
namespace {

using data::InputError;

/// The parts of "kind:a:b:c" with messages that name the part.
class Parts {
 public:
  explicit Parts(const std::string& text) : text_(text) {
    for (const std::string_view word : data::split(text_, ":")) words_.emplace_back(word);
  }
  const std::vector<std::string>& words() const { return words_; }

  InputError error(const std::string& field, const std::string& expected) const {
    return InputError("target \"" + text_ + "\": " + field + ": expected " + expected);
  }
  void expect_count(std::size_t least, std::size_t most, const std::string& form) const {
    if (words_.size() < least || words_.size() > most) throw error("parts", form);
  }
  double metres(std::size_t k, const std::string& field) const {
    const std::optional<double> value = data::parse_number(words_[k]);
    if (!value || !(*value > 0) || !std::isfinite(*value))
      throw error(field, "metres above 0, found \"" + words_[k] + '"');
    constexpr double kLeast = 1e-5;  // finer than any print
    if (*value < kLeast) throw error(field, "metres, found " + words_[k]);
    if (*value > 5) throw error(field, "metres, found " + words_[k] + " (millimetres?)");
    return *value;
  }
  void size(std::size_t k, Target& target, int least) const {
    const std::vector<std::string_view> sides = data::split(words_[k], "x");
    const auto side = [&](std::size_t i) -> long {
      return i < sides.size() ? data::parse_integer(sides[i]).value_or(0) : 0;
    };
    if (sides.size() != 2 || side(0) < least || side(1) < least || side(0) > 1000 || side(1) > 1000)
      throw error("size",
                  "COLUMNSxROWS of " + std::to_string(least) + " to 1000, found \"" + words_[k] + '"');
    target.columns = static_cast<int>(side(0));
    target.rows = static_cast<int>(side(1));
  }
  int id(std::size_t k, bool may_be_any) const {
    if (may_be_any && words_[k] == "any") return -1;
    const std::optional<long> value = data::parse_integer(words_[k]);
    if (!value || *value < 0 || *value > 100000)
      throw error("id", std::string(may_be_any ? "a number from 0 or any" : "a number from 0") +
                            ", found \"" + words_[k] + '"');
    return static_cast<int>(*value);
  }
  std::string dictionary(std::size_t k, const std::vector<std::string>& known) const {
    if (std::find(known.begin(), known.end(), words_[k]) != known.end()) return words_[k];
    const std::string nearest = data::nearest_name(words_[k], known);
    throw error("dictionary", (nearest.empty() ? "one as " + known.front() : '"' + nearest + '"') +
                                  ", found \"" + words_[k] + '"');
  }

 private:
  std::string text_;
  std::vector<std::string> words_;
};

std::vector<std::string> aruco_dictionaries() {
  std::vector<std::string> names;
  for (const char* bits : {"4X4", "5X5", "6X6", "7X7"})
    for (const char* count : {"50", "100", "250", "1000"})
      names.push_back(std::string("DICT_") + bits + '_' + count);
  names.emplace_back("DICT_ARUCO_ORIGINAL");
  return names;
}

const std::vector<std::string>& apriltag_families() {
  static const std::vector<std::string> names = {"36h11", "36h10",         "25h9",
                                                 "16h5",  "Standard41h12", "Standard52h13"};
  return names;
}

Target from_parts(const Parts& parts) {
  Target target;
  const std::vector<std::string>& words = parts.words();
  const std::vector<std::string> kinds = {"chessboard", "charuco",   "aruco",  "aruco_grid",
                                          "apriltag",   "aprilgrid", "circles"};
  const auto kind = std::find(kinds.begin(), kinds.end(), words.empty() ? std::string() : words[0]);
  if (kind == kinds.end()) {
    std::string list;
    for (const std::string& name : kinds) list += (list.empty() ? "" : ", ") + name;
    throw parts.error("kind", "one of " + list);
  }
  if (*kind == "chessboard") {
    parts.expect_count(3, 3, "chessboard:COLUMNSxROWS:SQUARE, as chessboard:9x6:0.025 (inner corners)");
    target.kind = TargetKind::chessboard;
    parts.size(1, target, 3);
    target.spacing = parts.metres(2, "square");
  } else if (*kind == "charuco") {
    parts.expect_count(
        5, 5, "charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY, as charuco:5x7:0.036:0.018:DICT_6X6_250");
    target.kind = TargetKind::charuco;
    parts.size(1, target, 3);
    target.spacing = parts.metres(2, "square");
    target.marker_size = parts.metres(3, "marker");
    if (target.marker_size >= target.spacing) throw parts.error("marker", "a side smaller than the square");
    target.dictionary = parts.dictionary(4, aruco_dictionaries());
  } else if (*kind == "aruco") {
    parts.expect_count(4, 4, "aruco:DICTIONARY:ID:SIDE, as aruco:DICT_4X4_50:0:0.09");
    target.kind = TargetKind::aruco;
    target.dictionary = parts.dictionary(1, aruco_dictionaries());
    target.first_id = parts.id(2, true);
    target.marker_size = parts.metres(3, "side");
  } else if (*kind == "aruco_grid") {
    parts.expect_count(
        5, 6, "aruco_grid:COLUMNSxROWS:SIDE:GAP:DICTIONARY[:FIRST], as aruco_grid:5x7:0.04:0.01:DICT_4X4_50");
    target.kind = TargetKind::aruco_grid;
    parts.size(1, target, 1);
    target.marker_size = parts.metres(2, "side");
    target.marker_gap = parts.metres(3, "gap");
    target.dictionary = parts.dictionary(4, aruco_dictionaries());
    if (words.size() > 5) target.first_id = parts.id(5, false);
  } else if (*kind == "apriltag") {
    parts.expect_count(4, 4, "apriltag:FAMILY:ID:SIDE, as apriltag:36h11:0:0.048");
    target.kind = TargetKind::apriltag;
    target.dictionary = parts.dictionary(1, apriltag_families());
    target.first_id = parts.id(2, true);
    target.marker_size = parts.metres(3, "side");
  } else if (*kind == "aprilgrid") {
    parts.expect_count(
        4, 5,
        "aprilgrid:COLUMNSxROWS:SIDE:GAP[:FAMILY], as aprilgrid:6x6:0.088:0.3 (gap as a share of the side)");
    target.kind = TargetKind::aprilgrid;
    parts.size(1, target, 1);
    target.marker_size = parts.metres(2, "side");
    target.marker_gap = parts.metres(3, "gap") * target.marker_size;
    target.dictionary =
        words.size() > 4 ? parts.dictionary(4, apriltag_families()) : apriltag_families().front();
  } else {
    parts.expect_count(3, 4, "circles:COLUMNSxROWS:SPACING[:origin-dot], as circles:10x10:0.0254:origin-dot");
    target.kind = TargetKind::circle_grid;
    parts.size(1, target, 3);
    target.spacing = parts.metres(2, "spacing");
    if (words.size() > 3 && words[3] != "origin-dot")
      throw parts.error("mark", "origin-dot, found \"" + words[3] + '"');
    target.has_origin = words.size() > 3;
  }
  return target;
}

/// The corners of a square marker as it is printed: upper left, upper right, lower right, lower left.
void append_marker(std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& upper_left, double side) {
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)})
    points.push_back(upper_left + side * Eigen::Vector2d(x, y));
}

}  // namespace

Target parse_target(const std::string& text) { return from_parts(Parts(text)); }

std::string to_words(const Target& target) {
  const std::string size = std::to_string(target.columns) + "x" + std::to_string(target.rows);
  const std::string id = target.first_id < 0 ? "any" : std::to_string(target.first_id);
  const auto number = [](double value) { return ":" + data::format_short(value); };
  const std::string side = number(target.marker_size);
  switch (target.kind) {
    case TargetKind::chessboard:
      return "chessboard:" + size + number(target.spacing);
    case TargetKind::charuco:
      return "charuco:" + size + number(target.spacing) + side + ":" + target.dictionary;
    case TargetKind::aruco:
      return "aruco:" + target.dictionary + ":" + id + side;
    case TargetKind::aruco_grid:
      return "aruco_grid:" + size + side + number(target.marker_gap) + ":" + target.dictionary + ":" + id;
    case TargetKind::apriltag:
      return "apriltag:" + target.dictionary + ":" + id + side;
    case TargetKind::aprilgrid:
      return "aprilgrid:" + size + side + number(target.marker_gap / target.marker_size) + ":" +
             target.dictionary;
    case TargetKind::circle_grid:
      break;
  }
  return "circles:" + size + number(target.spacing) + (target.has_origin ? ":origin-dot" : "");
}

Target load_target(const std::string& path) {
  const std::string extension = data::lower_extension(path);
  if (extension == ".yaml" || extension == ".yml") return load_kalibr_target(path);
  const nlohmann::json file = data::load_json(path);
  const data::JsonObject object(file, path);
  try {
    return parse_target(object.string("target"));
  } catch (const InputError& error) {
    throw InputError(path + ": " + error.what());
  }
}

Eigen::Matrix3Xd target_points(const Target& target) {
  std::vector<Eigen::Vector2d> points;
  const double side = target.marker_size, pitch = target.marker_size + target.marker_gap;
  switch (target.kind) {
    case TargetKind::chessboard:
    case TargetKind::charuco: {
      const bool charuco = target.kind == TargetKind::charuco;
      for (int r = 0; r < target.rows - charuco; ++r)
        for (int c = 0; c < target.columns - charuco; ++c)
          points.emplace_back(target.spacing * (c + charuco), target.spacing * (r + charuco));
      break;
    }
    case TargetKind::aruco:
    case TargetKind::apriltag:
      append_marker(points, {-side / 2, -side / 2}, side);
      break;
    case TargetKind::aruco_grid:
      for (int r = 0; r < target.rows; ++r)
        for (int c = 0; c < target.columns; ++c) append_marker(points, {c * pitch, r * pitch}, side);
      break;
    case TargetKind::aprilgrid:
      for (int r = 0; r < target.rows; ++r)
        for (int c = 0; c < target.columns; ++c) append_marker(points, {c * pitch, -r * pitch - side}, side);
      break;
    case TargetKind::circle_grid:
      for (int r = 0; r < target.rows; ++r)
        for (int c = 0; c < target.columns; ++c)
          points.emplace_back(target.spacing * c, (target.has_origin ? -1 : 1) * target.spacing * r);
      break;
  }
  Eigen::Matrix3Xd matrix = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    matrix.col(static_cast<Eigen::Index>(i)).head<2>() = points[i];
  return matrix;
}

std::vector<std::vector<int>> target_symmetries(const Target& target) {
  const int columns = target.columns, rows = target.rows;
  std::vector<int> turns = {0};
  // A chessboard turned by half maps square (c, r) to (columns - c, rows - r): the colours agree where
  // columns + rows is even. A quarter turn of a square one maps it to (r, columns - c): where columns is
  // even.
  if (target.kind == TargetKind::chessboard && (columns + rows) % 2 == 0) {
    if (columns == rows && columns % 2 == 0)
      turns = {0, 1, 2, 3};
    else
      turns = {0, 2};
  }
  if (target.kind == TargetKind::circle_grid && !target.has_origin) {
    if (columns == rows)
      turns = {0, 1, 2, 3};
    else
      turns = {0, 2};
  }
  std::vector<std::vector<int>> symmetries;
  const int count = static_cast<int>(target_points(target).cols());
  for (const int turn : turns) {
    std::vector<int> permutation(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) permutation[static_cast<std::size_t>(i)] = i;
    if (turn > 0)
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
          const int turned = turn == 1   ? c * columns + (columns - 1 - r)
                             : turn == 2 ? (rows - 1 - r) * columns + (columns - 1 - c)
                                         : (rows - 1 - c) * columns + r;
          permutation[static_cast<std::size_t>(r * columns + c)] = turned;
        }
    symmetries.push_back(std::move(permutation));
  }
  return symmetries;
}

}  // namespace flash::calib
