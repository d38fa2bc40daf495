#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/features2d.hpp>

#include "calib/detect/corner_shapes.h"
#include "calib/detect/dot_lattice.h"
#include "calib/detect/finder.h"
#include "calib/detect/opencv_image.h"

namespace flash::calib {
namespace {

using Places = std::vector<Eigen::Vector2d>;

constexpr double kLeastShare = 0.8;       // of the dots must show an ellipse
constexpr double kBigger = 1.5;           // area of the dot at the origin over that of the others
constexpr std::size_t kMostOthers = 250;  // blobs of a picture beside those of the grid

/// The largest first, where there are more than `most`: joining dots to a grid takes time with their cube,
/// 12 s for 800, half an hour for the 4,000 of a rough texture.
std::vector<cv::Point2f> largest_blobs(const cv::Mat& picture, cv::FeatureDetector& detector,
                                       std::size_t most) {
  std::vector<cv::KeyPoint> blobs;
  detector.detect(picture, blobs);
  if (blobs.size() > most) {
    std::stable_sort(blobs.begin(), blobs.end(),
                     [](const cv::KeyPoint& a, const cv::KeyPoint& b) { return a.size > b.size; });
    blobs.resize(most);
  }
  std::vector<cv::Point2f> places;
  cv::KeyPoint::convert(blobs, places);
  return places;
}

/// By OpenCV; none where it orders dots as no grid lies.
Places grid_of(const std::vector<cv::Point2f>& dots, int columns, int rows) {
  std::vector<cv::Point2f> centres;
  for (const int flags :
       {static_cast<int>(cv::CALIB_CB_SYMMETRIC_GRID), cv::CALIB_CB_SYMMETRIC_GRID | cv::CALIB_CB_CLUSTERING})
    if (cv::findCirclesGrid(dots, {columns, rows}, centres, flags, nullptr))
      if (Places places = to_eigen(centres); is_lattice(places, columns, rows)) return places;
  return {};
}

/// Dots of the grid, row by row from one of the corners.
Places find_grid(const GreyImage& image, int columns, int rows) {
  cv::SimpleBlobDetector::Params blobs;
  blobs.filterByArea = true;
  blobs.minArea = 9;
  blobs.maxArea = static_cast<float>(image.width) * static_cast<float>(image.height) / 50;
  blobs.minDistBetweenBlobs = 4;
  blobs.minThreshold = 20;
  blobs.maxThreshold = 230;
  blobs.thresholdStep = 10;
  blobs.filterByInertia = true;
  blobs.minInertiaRatio = 0.1f;  // a circle seen at 70 deg has 0.12
  blobs.filterByConvexity = true;
  blobs.minConvexity = 0.8f;
  const cv::Ptr<cv::FeatureDetector> detector = cv::SimpleBlobDetector::create(blobs);
  // Small dots are lost on thresholds of a few pixels: look again at twice the size.
  for (const double scale : {1.0, 2.0}) {
    cv::Mat picture = as_mat(image);
    if (scale != 1) cv::resize(picture, picture, {}, scale, scale, cv::INTER_CUBIC);
    const auto count = static_cast<std::size_t>(columns * rows), most = count + kMostOthers,
               few = count + count / 4;
    const std::vector<cv::Point2f> dots = largest_blobs(picture, *detector, most);
    Places centres = grid_of(dots, columns, rows);
    if (centres.empty() && dots.size() == most)  // specks are smaller than dots
      centres =
          grid_of({dots.begin(), dots.begin() + static_cast<std::ptrdiff_t>(std::min(few, dots.size()))},
                  columns, rows);
    if (centres.empty()) centres = find_dot_lattice(to_eigen(dots), columns, rows).value_or(Places());
    if (centres.empty()) continue;
    Places places;
    for (const Eigen::Vector2d& centre : centres) places.emplace_back((centre.array() + 0.5) / scale - 0.5);
    return places;
  }
  return {};
}

struct FittedGrid {
  Places centres;             ///< of the ellipses, rectified px
  std::vector<double> areas;  ///< [px^2]; zero where none was found
  std::vector<double> dark;   ///< pixels darker than half way around each [px^2]; known of cut dots too
};

/// Pixels of a disc nearer in brightness to its darkest than to its brightest.
double dark_pixels(const GreyImage& image, const Eigen::Vector2d& pixel, double radius) {
  std::vector<int> values;
  for (int y = static_cast<int>(pixel.y() - radius); y <= static_cast<int>(pixel.y() + radius); ++y)
    for (int x = static_cast<int>(pixel.x() - radius); x <= static_cast<int>(pixel.x() + radius); ++x)
      if (x >= 0 && y >= 0 && x < image.width && y < image.height &&
          (Eigen::Vector2d(x, y) - pixel).norm() < radius)
        values.push_back(image.at(x, y));
  if (values.empty()) return 0;
  const auto [dark, bright] = std::minmax_element(values.begin(), values.end());
  const int middle = (*dark + *bright) / 2;
  return static_cast<double>(std::count_if(values.begin(), values.end(), [&](int v) { return v < middle; }));
}

FittedGrid fit_grid(const GreyImage& image, const Rectifier& rectifier, const Places& seeds, int columns,
                    int rows) {
  FittedGrid grid;
  Places places;
  for (const Eigen::Vector2d& seed : seeds) places.push_back(rectifier.rectified(seed));
  for (int i = 0; i < columns * rows; ++i) {
    const int c = i % columns;
    const int beside = c + 1 < columns ? i + 1 : i - 1,
              below = i + columns < columns * rows ? i + columns : i - columns;
    const Eigen::Vector2d& place = places[static_cast<std::size_t>(i)];
    const double spacing = std::min((places[static_cast<std::size_t>(beside)] - place).norm(),
                                    (places[static_cast<std::size_t>(below)] - place).norm());
    std::optional<Dot> dot = fit_dot(image, rectifier, place, 0.6 * spacing);
    if (!dot) dot = fit_dot(image, rectifier, place, 0.75 * spacing);  // the big one reaches farther
    grid.centres.push_back(dot ? dot->centre : place);
    grid.areas.push_back(dot ? dot->area : 0);
    grid.dark.push_back(dark_pixels(image, seeds[static_cast<std::size_t>(i)], 0.6 * spacing));
  }
  return grid;
}

/// The grid read from another of its corners: by quarter turns, and mirrored or not. Which dot then comes
/// i-th.
std::vector<std::size_t> turned(int columns, int rows, int turn, bool mirrored) {
  std::vector<std::size_t> order(static_cast<std::size_t>(columns * rows));
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      int x = mirrored ? columns - 1 - c : c, y = r;
      if (turn >= 2) {
        x = columns - 1 - x;
        y = rows - 1 - y;
      }
      if (turn % 2 == 1) {
        const int t = x;  // of a square grid
        x = columns - 1 - y;
        y = t;
      }
      order[static_cast<std::size_t>(r * columns + c)] = static_cast<std::size_t>(y * columns + x);
    }
  return order;
}

/// Above zero where x turns to y clockwise in the picture, as x right and y down do.
double handedness(const Places& places, const std::vector<std::size_t>& order, int columns, int rows) {
  const Eigen::Vector2d& origin = places[order[0]];
  const Eigen::Vector2d x = places[order[static_cast<std::size_t>(columns - 1)]] - origin;
  const Eigen::Vector2d y = places[order[static_cast<std::size_t>((rows - 1) * columns)]] - origin;
  return x.x() * y.y() - x.y() * y.x();
}

/// Rows run down from the first dot, or up from a bigger one. Empty where no corner has a bigger dot from
/// where they do.
std::vector<std::size_t> right_order(const Target& target, const FittedGrid& grid) {
  const int columns = target.columns, rows = target.rows;
  std::vector<std::size_t> best;
  double biggest = target.has_origin ? kBigger : 0;
  for (const bool mirrored : {false, true})
    for (int turn = 0; turn < 4; ++turn) {
      if (turn % 2 == 1 && columns != rows) continue;
      std::vector<std::size_t> order = turned(columns, rows, turn, mirrored);
      const bool down = handedness(grid.centres, order, columns, rows) > 0;
      if (down == target.has_origin) continue;
      // Against its neighbours: perspective makes a whole side of the grid bigger.
      const double beside = grid.dark[order[1]], below = grid.dark[order[static_cast<std::size_t>(columns)]];
      const double size = target.has_origin ? grid.dark[order[0]] / std::max(1.0, (beside + below) / 2) : 1;
      if (size <= biggest) continue;
      biggest = size;
      best = std::move(order);
    }
  return best;
}

double local_scale(const Eigen::Matrix3d& H, const Eigen::Vector2d& place, double step) {
  const Eigen::Vector2d x =
      apply(H, place + Eigen::Vector2d(step, 0)) - apply(H, place - Eigen::Vector2d(step, 0));
  const Eigen::Vector2d y =
      apply(H, place + Eigen::Vector2d(0, step)) - apply(H, place - Eigen::Vector2d(0, step));
  return std::abs(x.x() * y.y() - x.y() * y.x()) / (4 * step * step);
}

/// The centre of an ellipse is not where the centre of the circle is seen: moved by the difference that the
/// grid's own homography and the size of the dot make.
void correct_for_perspective(const Target& target, FittedGrid& grid) {
  const Eigen::Matrix3Xd points = target_points(target);
  Places plane, ellipses;
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < grid.centres.size(); ++i)
    if (grid.areas[i] > 0) {
      seen.push_back(i);
      plane.emplace_back(points.col(static_cast<Eigen::Index>(i)).head<2>());
      ellipses.push_back(grid.centres[i]);
    }
  Places centres = ellipses;
  for (int round = 0; round < 3; ++round) {
    const Eigen::Matrix3d H = homography(plane, centres);
    if (H.isZero()) return;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      const double radius =
          std::sqrt(grid.areas[seen[k]] / (M_PI * local_scale(H, plane[k], 0.01 * target.spacing)));
      centres[k] = ellipses[k] - (circle_image_centre(H, plane[k], radius) - apply(H, plane[k]));
    }
  }
  for (std::size_t k = 0; k < seen.size(); ++k) grid.centres[seen[k]] = centres[k];
}

}  // namespace

Finder circle_finder(const Target& target, const Rectifier& rectifier) {
  return [target, &rectifier](const GreyImage& image) {
    Found found;
    const Places places = find_grid(image, target.columns, target.rows);
    if (places.empty()) {
      found.reason =
          "no grid of " + std::to_string(target.columns) + " x " + std::to_string(target.rows) + " dots";
      return found;
    }
    FittedGrid unordered = fit_grid(image, rectifier, places, target.columns, target.rows);
    const std::vector<std::size_t> order = right_order(target, unordered);
    if (order.empty()) {
      found.reason = "no big dot in the corner where a grid of " + std::to_string(target.columns) + " x " +
                     std::to_string(target.rows) + " has its origin";
      return found;
    }
    FittedGrid grid;
    Places seeds;
    for (const std::size_t i : order) {
      seeds.push_back(places[i]);
      grid.centres.push_back(unordered.centres[i]);
      grid.areas.push_back(unordered.areas[i]);
    }
    correct_for_perspective(target, grid);
    Sighting fitted{kImageModel, {}, {}}, blobs{"blobs", {}, {}};
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!(grid.areas[i] > 0)) continue;
      blobs.points.push_back(static_cast<int>(i));
      blobs.pixels.push_back(seeds[i]);
      fitted.points.push_back(static_cast<int>(i));
      fitted.pixels.push_back(rectifier.distorted(grid.centres[i]));
    }
    if (static_cast<double>(fitted.points.size()) < kLeastShare * static_cast<double>(places.size()))
      found.reason = "only " + std::to_string(fitted.points.size()) + " of " + std::to_string(places.size()) +
                     " dots show an ellipse";
    else
      found.sightings = {std::move(fitted), std::move(blobs)};
    return found;
  };
}

Finder make_finder(const Target& target, const Rectifier& rectifier, Search search) {
  switch (target.kind) {
    case TargetKind::chessboard:
      return chessboard_finder(target, rectifier, search);
    case TargetKind::charuco:
      return charuco_finder(target, rectifier);
    case TargetKind::aruco:
    case TargetKind::aruco_grid:
      return aruco_finder(target, rectifier);
    case TargetKind::apriltag:
    case TargetKind::aprilgrid:
      return apriltag_finder(target, rectifier);
    case TargetKind::circle_grid:
      break;
  }
  return circle_finder(target, rectifier);
}

}  // namespace flash::calib
