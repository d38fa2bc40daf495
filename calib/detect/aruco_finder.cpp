#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/aruco.hpp>

#include "calib/detect/corner_shapes.h"
#include "calib/detect/finder.h"
#include "calib/detect/opencv_image.h"

namespace flash::calib {
namespace {

using Markers = std::map<int, Quad>;  // upper left, upper right, lower right, lower left [px]

constexpr double kLargestDisc = 9;   // of a crossing [px]
constexpr double kSmallestDisc = 2;  // [px]

cv::Ptr<cv::aruco::Dictionary> dictionary_of(const std::string& name) {
  static const std::map<std::string, int> known = {{"DICT_4X4_50", cv::aruco::DICT_4X4_50},
                                                   {"DICT_4X4_100", cv::aruco::DICT_4X4_100},
                                                   {"DICT_4X4_250", cv::aruco::DICT_4X4_250},
                                                   {"DICT_4X4_1000", cv::aruco::DICT_4X4_1000},
                                                   {"DICT_5X5_50", cv::aruco::DICT_5X5_50},
                                                   {"DICT_5X5_100", cv::aruco::DICT_5X5_100},
                                                   {"DICT_5X5_250", cv::aruco::DICT_5X5_250},
                                                   {"DICT_5X5_1000", cv::aruco::DICT_5X5_1000},
                                                   {"DICT_6X6_50", cv::aruco::DICT_6X6_50},
                                                   {"DICT_6X6_100", cv::aruco::DICT_6X6_100},
                                                   {"DICT_6X6_250", cv::aruco::DICT_6X6_250},
                                                   {"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
                                                   {"DICT_7X7_50", cv::aruco::DICT_7X7_50},
                                                   {"DICT_7X7_100", cv::aruco::DICT_7X7_100},
                                                   {"DICT_7X7_250", cv::aruco::DICT_7X7_250},
                                                   {"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
                                                   {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL}};
  return cv::aruco::getPredefinedDictionary(known.at(name));
}

/// How well the corners of markers are placed: to a pixel, or by the gradients within 5 px. In these the
/// corners of a small ChArUco board's squares pull at its markers, by more than the board's fit allows.
enum class Corners { rough, refined };

/// Markers by id; those whose id is seen more than once are in `repeated` instead.
Markers find_markers(const GreyImage& image, const cv::Ptr<cv::aruco::Dictionary>& dictionary, Corners placed,
                     std::vector<int>& repeated) {
  const cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod =
      placed == Corners::refined ? cv::aruco::CORNER_REFINE_SUBPIX : cv::aruco::CORNER_REFINE_NONE;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(as_mat(image), dictionary, corners, ids, parameters);
  Markers markers;
  for (std::size_t k = 0; k < ids.size(); ++k) {
    Quad quad;
    for (std::size_t i = 0; i < 4; ++i) quad[i] = {corners[k][i].x, corners[k][i].y};
    if (!markers.emplace(ids[k], quad).second) repeated.push_back(ids[k]);
  }
  for (const int id : repeated) markers.erase(id);
  return markers;
}

Quad rectified(const Rectifier& rectifier, const Quad& quad) {
  Quad result;
  std::transform(quad.begin(), quad.end(), result.begin(),
                 [&](const Eigen::Vector2d& pixel) { return rectifier.rectified(pixel); });
  return result;
}

void append(Sighting& sighting, int first_point, const Quad& pixels) {
  for (int i = 0; i < 4; ++i) {
    sighting.points.push_back(first_point + i);
    sighting.pixels.push_back(pixels[static_cast<std::size_t>(i)]);
  }
}

/// Place of each marker on a ChArUco board, ids in order: column and row of its square. OpenCV below 4.7
/// begins a board of even rows with a marker, later ones always with a black square.
std::vector<Eigen::Vector2i> charuco_markers(const Target& target, bool marker_first) {
  std::vector<Eigen::Vector2i> squares;
  for (int r = 0; r < target.rows; ++r)
    for (int c = 0; c < target.columns; ++c)
      if ((c + r) % 2 == (marker_first ? 0 : 1)) squares.emplace_back(c, r);
  return squares;
}

/// What the markers say about where the board lies.
struct BoardFit {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();  ///< board [m] to rectified px
  std::vector<Eigen::Vector2i> squares;         ///< of each id
  int agreeing = 0;                             ///< marker corners within the tolerance
  int corners = 0;                              ///< of markers that the board has
};

BoardFit fit_board(const Target& target, const Markers& markers, const Rectifier& rectifier,
                   bool marker_first) {
  constexpr double kTolerance = 4;  // a lens not yet known bends the board by a few pixels
  BoardFit fit;
  fit.squares = charuco_markers(target, marker_first);
  std::vector<Eigen::Vector2d> plane, pixels;
  const double margin = (target.spacing - target.marker_size) / 2;
  for (const auto& [id, quad] : markers) {
    if (id >= static_cast<int>(fit.squares.size())) continue;
    const Eigen::Vector2d corner = target.spacing * fit.squares[static_cast<std::size_t>(id)].cast<double>() +
                                   Eigen::Vector2d(margin, margin);
    for (int i = 0; i < 4; ++i) {
      plane.push_back(corner + target.marker_size * Eigen::Vector2d(i == 1 || i == 2, i >= 2));
      pixels.push_back(rectifier.rectified(quad[static_cast<std::size_t>(i)]));
    }
  }
  fit.corners = static_cast<int>(plane.size());
  fit.H = homography(plane, pixels, kTolerance);
  for (std::size_t i = 0; i < plane.size(); ++i)
    fit.agreeing += !fit.H.isZero() && (apply(fit.H, plane[i]) - pixels[i]).norm() < kTolerance;
  return fit;
}

/// The corner touches two markers; one of them seen is enough to know it is not hidden.
bool beside_a_marker(const BoardFit& fit, const Markers& markers, int c, int r) {
  return std::any_of(markers.begin(), markers.end(), [&](const auto& marker) {
    if (marker.first >= static_cast<int>(fit.squares.size())) return false;
    const Eigen::Vector2i& square = fit.squares[static_cast<std::size_t>(marker.first)];
    return (square.x() == c || square.x() == c + 1) && (square.y() == r || square.y() == r + 1);
  });
}

Found charuco_corners(const GreyImage& image, const Target& target, const Rectifier& rectifier,
                      const BoardFit& fit, const Markers& markers) {
  Sighting fitted{kImageModel, {}, {}}, refined{"corner_sub_pix", {}, {}};
  const double s = target.spacing;
  // Past the corner of a marker the disc would see more than four squares.
  const double free_share = std::min(0.9, std::sqrt(0.5) * (s - target.marker_size) / s);
  for (int r = 0; r + 1 < target.rows; ++r)
    for (int c = 0; c + 1 < target.columns; ++c) {
      if (!beside_a_marker(fit, markers, c, r)) continue;
      const Eigen::Vector2d place(s * (c + 1), s * (r + 1));
      const Eigen::Vector2d seed = apply(fit.H, place);
      const Eigen::Vector2d x = apply(fit.H, place + Eigen::Vector2d(s, 0)) - seed;
      const Eigen::Vector2d y = apply(fit.H, place + Eigen::Vector2d(0, s)) - seed;
      const double height = std::abs(x.x() * y.y() - x.y() * y.x()) / std::max(x.norm(), y.norm());
      const double radius = std::min(kLargestDisc, free_share * height);
      const Eigen::Vector2d pixel = rectifier.distorted(seed);
      const double room =
          std::min({pixel.x(), pixel.y(), image.width - 1 - pixel.x(), image.height - 1 - pixel.y()});
      if (radius < kSmallestDisc || room < radius + 2) continue;
      const auto crossing = fit_crossing(image, rectifier, seed, x, y, radius);
      if (!crossing) continue;
      const int point = r * (target.columns - 1) + c;
      fitted.points.push_back(point);
      fitted.pixels.push_back(rectifier.distorted(*crossing));
      refined.points.push_back(point);
      refined.pixels.push_back(
          corner_sub_pix(image, {pixel}, std::clamp(static_cast<int>(0.8 * radius), 2, 6)).front());
    }
  Found found;
  if (fitted.points.size() < 4)
    found.reason = "only " + std::to_string(fitted.points.size()) + " corners of the ChArUco board";
  else
    found.sightings = {std::move(fitted), std::move(refined)};
  return found;
}

/// The smallest dictionary of a family that has the ids: OpenCV's larger ones begin with the smaller.
std::string dictionary_of_family(const std::string& family, int largest_id) {
  for (const int count : {50, 100, 250})
    if (largest_id < count) return family + std::to_string(count);
  return family + "1000";
}

/// Whether a board with other counts holds the markers seen; both ways to begin a board.
bool holds(const Target& board, const Markers& markers, const Rectifier& rectifier) {
  for (const bool marker_first : {false, true}) {
    if (marker_first && board.rows % 2 == 1) continue;
    const BoardFit fit = fit_board(board, markers, rectifier, marker_first);
    if (fit.corners == 4 * static_cast<int>(markers.size()) && 10 * fit.agreeing >= 9 * fit.corners)
      return true;
  }
  return false;
}

/// Counts of a ChArUco board by where its markers lie: as stated, exchanged, or others.
bool recount(Target& board, const Markers& markers, const Rectifier& rectifier) {
  constexpr int kMost = 20;
  if (holds(board, markers, rectifier)) return true;
  std::swap(board.columns, board.rows);
  if (holds(board, markers, rectifier)) return true;
  for (int columns = 3; columns <= kMost; ++columns) {
    board.columns = columns;
    board.rows = std::max(3, (2 * (markers.rbegin()->first + 1) + columns - 1) / columns);
    if (holds(board, markers, rectifier)) return true;
  }
  return false;
}

/// Whether a grid with these counts holds all markers seen.
bool holds_grid(const Target& grid, const Markers& markers, const Rectifier& rectifier) {
  constexpr double kTolerance = 4;  // as of a ChArUco board
  const Eigen::Matrix3Xd points = target_points(grid);
  std::vector<Eigen::Vector2d> plane, pixels;
  for (const auto& [id, quad] : markers)
    for (int i = 0; i < 4; ++i) {
      const Eigen::Index point = 4 * (id - grid.first_id) + i;
      if (point < 0 || point >= points.cols()) return false;
      plane.emplace_back(points.col(point).head<2>());
      pixels.push_back(rectifier.rectified(quad[static_cast<std::size_t>(i)]));
    }
  const Eigen::Matrix3d H = homography(plane, pixels, kTolerance);
  int agreeing = 0;
  for (std::size_t i = 0; i < plane.size(); ++i)
    agreeing += !H.isZero() && (apply(H, plane[i]) - pixels[i]).norm() < kTolerance;
  return 10 * agreeing >= 9 * static_cast<int>(plane.size());
}

/// Counts of a grid by where its markers lie: as stated, exchanged, or others.
bool recount_grid(Target& grid, const Markers& markers, const Rectifier& rectifier) {
  constexpr int kMost = 20;
  const int first = markers.begin()->first, last = markers.rbegin()->first;
  if (first < grid.first_id || last >= grid.first_id + grid.columns * grid.rows) grid.first_id = first;
  if (holds_grid(grid, markers, rectifier)) return true;
  std::swap(grid.columns, grid.rows);
  if (holds_grid(grid, markers, rectifier)) return true;
  for (int columns = 1; columns <= kMost; ++columns) {
    grid.columns = columns;
    grid.rows = (last - grid.first_id + columns) / columns;
    if (holds_grid(grid, markers, rectifier)) return true;
  }
  return false;
}

}  // namespace

std::optional<Target> shown_markers(const GreyImage& image, const Target& stated,
                                    const Rectifier& rectifier) {
  constexpr std::size_t kOfABoard = 4;  // markers, fewer may be chance
  const bool single = stated.kind == TargetKind::aruco;
  const std::size_t least = single ? 1 : kOfABoard;
  Target best = stated;
  std::vector<int> repeated;
  Markers most = find_markers(image, dictionary_of(stated.dictionary), Corners::rough, repeated);
  if (most.size() < least)
    for (const std::string family : {"DICT_4X4_", "DICT_5X5_", "DICT_6X6_", "DICT_7X7_", "DICT_ARUCO_"}) {
      const bool original = family == "DICT_ARUCO_";
      Markers markers = find_markers(image, dictionary_of(family + (original ? "ORIGINAL" : "1000")),
                                     Corners::rough, repeated);
      if (markers.size() <= most.size()) continue;
      most = std::move(markers);
      best.dictionary = original ? family + "ORIGINAL" : dictionary_of_family(family, most.rbegin()->first);
    }
  if (most.size() < least) return std::nullopt;
  if (single && most.size() > 1) return std::nullopt;
  if (single && stated.first_id >= 0) best.first_id = most.begin()->first;
  if (stated.kind == TargetKind::charuco && !recount(best, most, rectifier)) return std::nullopt;
  if (stated.kind == TargetKind::aruco_grid && !recount_grid(best, most, rectifier)) return std::nullopt;
  return to_words(best) == to_words(stated) ? std::nullopt : std::optional(best);
}

Finder aruco_finder(const Target& target, const Rectifier& rectifier) {
  return [target, &rectifier, dictionary = dictionary_of(target.dictionary)](const GreyImage& image) {
    Found found;
    std::vector<int> repeated;
    Markers markers = find_markers(image, dictionary, Corners::refined, repeated);
    const bool grid = target.kind == TargetKind::aruco_grid;
    const int count = grid ? target.columns * target.rows : 1;
    if (target.first_id >= 0)
      std::erase_if(markers, [&](const auto& marker) {
        return marker.first < target.first_id || marker.first >= target.first_id + count;
      });
    const std::string name = target.first_id < 0 ? "any id" : "id " + std::to_string(target.first_id);
    if (markers.empty()) {
      found.reason = repeated.empty()
                         ? "no marker of " + target.dictionary + " with " + name
                         : "marker " + std::to_string(repeated.front()) + " is seen more than once";
      return found;
    }
    if (!grid && markers.size() > 1) {
      found.reason = "markers " + std::to_string(markers.begin()->first) + " and " +
                     std::to_string(markers.rbegin()->first) + " are seen: name one instead of any";
      return found;
    }
    const double band = 1.0 / (dictionary->markerSize + 2);
    const double outside = grid ? std::min(band, target.marker_gap / target.marker_size) : band;
    Sighting fitted{kImageModel, {}, {}}, refined{"corner_sub_pix", {}, {}};
    for (const auto& [id, quad] : markers) {
      const int first = grid ? 4 * (id - target.first_id) : 0;
      append(refined, first, quad);
      const std::optional<Quad> sides = fit_quad(image, rectifier, rectified(rectifier, quad), band, outside);
      if (!sides) continue;
      Quad pixels;
      std::transform(sides->begin(), sides->end(), pixels.begin(),
                     [&](const Eigen::Vector2d& corner) { return rectifier.distorted(corner); });
      append(fitted, first, pixels);
    }
    if (!fitted.points.empty()) found.sightings.push_back(std::move(fitted));
    found.sightings.push_back(std::move(refined));
    return found;
  };
}

Finder charuco_finder(const Target& target, const Rectifier& rectifier) {
  return [target, &rectifier, dictionary = dictionary_of(target.dictionary)](const GreyImage& image) {
    Found found;
    std::vector<int> repeated;
    const Markers markers = find_markers(image, dictionary, Corners::rough, repeated);
    BoardFit fit = fit_board(target, markers, rectifier, false);
    if (target.rows % 2 == 0) {
      const BoardFit other = fit_board(target, markers, rectifier, true);
      if (other.agreeing > fit.agreeing) fit = other;
    }
    // Of markers that lie otherwise the corners of one agree, whichever it is.
    if (fit.agreeing < 4 || 2 * fit.agreeing < fit.corners) {
      found.reason = markers.empty()
                         ? "no marker of the ChArUco board"
                         : "the markers seen do not agree with a ChArUco board of " +
                               std::to_string(target.columns) + " x " + std::to_string(target.rows);
      return found;
    }
    return charuco_corners(image, target, rectifier, fit, markers);
  };
}

}  // namespace flash::calib
