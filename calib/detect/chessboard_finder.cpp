#include <algorithm>
#include <cmath>

#include "calib/detect/corner_shapes.h"
#include "calib/detect/finder.h"
#include "calib/detect/opencv_image.h"

namespace flash::calib {
namespace {

using Corners = std::vector<Eigen::Vector2d>;

constexpr double kLargestDisc = 9;     // of a crossing [px]; beyond it little is gained
constexpr double kSmallestDisc = 2.5;  // [px]
constexpr int kSearchWidth = 800;      // of the picture that is searched for squares [px]
constexpr int kSectorsWidth = 1600;    // and of that searched by sectors [px]
constexpr double kLeastShare = 0.8;    // of the corners must show a crossing
constexpr double kSmoothing = 2;       // of a picture whose crossings show another pattern on top [px]

/// Corners of a board, row by row.
struct Grid {
  int columns = 0, rows = 0;
  Corners corners;

  std::size_t index(int c, int r) const { return static_cast<std::size_t>(r * columns + c); }
  const Eigen::Vector2d& at(int c, int r) const { return corners[index(c, r)]; }
  /// Towards the next corner along x or y, from the neighbours on both sides where there are two.
  Eigen::Vector2d step(int c, int r, bool along_x) const {
    const int last = (along_x ? columns : rows) - 1, k = along_x ? c : r;
    const int before = std::max(0, k - 1), after = std::min(last, k + 1);
    const Eigen::Vector2d difference = along_x ? at(after, r) - at(before, r) : at(c, after) - at(c, before);
    return difference / (after - before);
  }
};

double brightness(const GreyImage& image, const Eigen::Vector2d& place) {
  double sum = 0;
  const int x0 = static_cast<int>(std::lround(place.x())), y0 = static_cast<int>(std::lround(place.y()));
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      sum += image.at(std::clamp(x0 + dx, 0, image.width - 1), std::clamp(y0 + dy, 0, image.height - 1));
  return sum / 9;
}

/// Above zero where the squares that share the colour of the one between the first four corners are the
/// darker.
double darkness_of_first(const GreyImage& image, const Grid& grid) {
  double sum[2] = {0, 0};
  int count[2] = {0, 0};
  for (int r = 0; r + 1 < grid.rows; ++r)
    for (int c = 0; c + 1 < grid.columns; ++c) {
      const Eigen::Vector2d middle =
          (grid.at(c, r) + grid.at(c + 1, r) + grid.at(c, r + 1) + grid.at(c + 1, r + 1)) / 4;
      sum[(c + r) % 2] += brightness(image, middle);
      ++count[(c + r) % 2];
    }
  return sum[1] / std::max(1, count[1]) - sum[0] / std::max(1, count[0]);
}

/// x to the right of y as one faces the board, and a black square between the first four corners where a turn
/// can bring one there: libraries leave both open.
void put_in_order(const GreyImage& image, Grid& grid) {
  const Eigen::Vector2d x = grid.at(grid.columns - 1, 0) - grid.at(0, 0),
                        y = grid.at(0, grid.rows - 1) - grid.at(0, 0);
  if (x.x() * y.y() - x.y() * y.x() < 0)
    for (int r = 0; r < grid.rows; ++r)
      std::reverse(grid.corners.begin() + r * grid.columns, grid.corners.begin() + (r + 1) * grid.columns);
  if (darkness_of_first(image, grid) > 0) return;
  if ((grid.columns + grid.rows) % 2 == 1) {
    std::reverse(grid.corners.begin(), grid.corners.end());
  } else if (grid.columns == grid.rows && grid.columns % 2 == 1) {
    Grid turned = grid;
    for (int r = 0; r < grid.rows; ++r)
      for (int c = 0; c < grid.columns; ++c)
        turned.corners[grid.index(c, r)] = grid.at(r, grid.columns - 1 - c);
    grid = turned;
  }
}

/// A part of a picture, made small where it is wide: corners found in it are only seeds.
struct SmallPicture {
  cv::Mat pixels;
  double scale;
  Eigen::Array2d origin;

  SmallPicture(const GreyImage& image, const cv::Rect& part, int width = kSearchWidth)
      : pixels(as_mat(image)(part)),
        scale(std::min(1.0, static_cast<double>(width) / part.width)),
        origin(part.x, part.y) {
    if (scale < 1) cv::resize(pixels, pixels, {}, scale, scale, cv::INTER_AREA);
  }

  void halve() {
    cv::resize(pixels, pixels, {}, 0.5, 0.5, cv::INTER_AREA);
    scale /= 2;
  }

  Corners in_image(const std::vector<cv::Point2f>& corners) const {
    Corners places;
    for (const Eigen::Vector2d& corner : to_eigen(corners))
      places.emplace_back((corner.array() + 0.5) / scale - 0.5 + origin);
    return places;
  }
};

/// Whether more than a quarter of a picture's pixels are on the other side of the brightness about them than
/// the pixel to their right: half of them in noise, one in ten where squares are ten pixels wide.
bool is_busy(const cv::Mat& picture) {
  constexpr double kMostEdges = 0.25;
  cv::Mat levels, above, edges;
  cv::equalizeHist(picture, levels);  // noise of a dark picture is noise
  const int block = std::max(3, std::min(picture.cols, picture.rows) / 5) | 1;
  cv::adaptiveThreshold(levels, above, 1, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY, block, 0);
  cv::absdiff(above.colRange(1, above.cols), above.colRange(0, above.cols - 1), edges);
  return cv::sum(edges)[0] > kMostEdges * static_cast<double>(edges.total());
}

/// The time goes with the square of what might be a square: 8 s for a picture of noise, 0.1 s for its
/// quarter.
Corners find_classic(const GreyImage& image, const Target& target, const cv::Rect& part) {
  constexpr int kLeastSide = 100;  // [px]
  SmallPicture small(image, part);
  while (std::min(small.pixels.cols, small.pixels.rows) > kLeastSide && is_busy(small.pixels)) small.halve();
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(small.pixels, {target.columns, target.rows}, corners,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
    return {};
  return small.in_image(corners);
}

cv::Rect whole_of(const GreyImage& image) { return {0, 0, image.width, image.height}; }

/// Where a board stands, with two of its squares about it.
cv::Rect surroundings(const GreyImage& image, const Grid& board) {
  Eigen::AlignedBox2d box;
  double square = 0;
  for (int r = 0; r < board.rows; ++r)
    for (int c = 0; c < board.columns; ++c) {
      box.extend(board.at(c, r));
      square = std::max({square, board.step(c, r, true).norm(), board.step(c, r, false).norm()});
    }
  const Eigen::Vector2i low = (box.min().array() - 2 * square).cast<int>(),
                        size = (box.sizes().array() + 4 * square).cast<int>();
  return cv::Rect(low.x(), low.y(), size.x(), size.y()) & whole_of(image);
}

/// By OpenCV's sectors, in a picture of that width: the time goes with its pixels. Where they are fewer than
/// the picture's own, its corners are seeds.
Corners find_sectors(const GreyImage& image, const Target& target, int width, int flags = 0) {
  const SmallPicture small(image, whole_of(image), width);
  std::vector<cv::Point2f> corners;
  const bool found = cv::findChessboardCornersSB(small.pixels, {target.columns, target.rows}, corners,
                                                 cv::CALIB_CB_NORMALIZE_IMAGE | flags);
  if (!found) return {};
  return small.scale < 1 ? small.in_image(corners) : to_eigen(corners);
}

GreyImage smoothed(const GreyImage& image) {
  GreyImage result = image;
  cv::Mat picture = as_mat(result);
  cv::GaussianBlur(as_mat(image), picture, {}, kSmoothing);
  return result;
}

Sighting all_points(const char* refiner, const Corners& corners) {
  Sighting sighting{refiner, {}, corners};
  for (std::size_t i = 0; i < corners.size(); ++i) sighting.points.push_back(static_cast<int>(i));
  return sighting;
}

int half_window(const Grid& grid) {
  double least = 1e9;
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c)
      least = std::min({least, grid.step(c, r, true).norm(), grid.step(c, r, false).norm()});
  return std::clamp(static_cast<int>(0.4 * least), 2, 8);
}

Sighting fit_crossings(const GreyImage& image, const Rectifier& rectifier, const Grid& seed) {
  Grid grid = seed;
  for (Eigen::Vector2d& corner : grid.corners) corner = rectifier.rectified(corner);
  Sighting sighting{kImageModel, {}, {}};
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c) {
      const Eigen::Vector2d x = grid.step(c, r, true), y = grid.step(c, r, false);
      // The next lines of the board pass at the height of the parallelogram between them.
      const double height = std::abs(x.x() * y.y() - x.y() * y.x()) / std::max(x.norm(), y.norm());
      const double radius = std::min(kLargestDisc, 0.9 * height - 0.5);
      if (radius < kSmallestDisc) continue;
      if (const auto crossing = fit_crossing(image, rectifier, grid.at(c, r), x, y, radius)) {
        sighting.points.push_back(static_cast<int>(grid.index(c, r)));
        sighting.pixels.push_back(rectifier.distorted(*crossing));
      }
    }
  return sighting;
}

/// A board with a row or a column less than stated shows an outer one that has no crossings.
bool lacks_a_side(const Sighting& sighting, const Target& target) {
  int first_row = 0, last_row = 0, first_column = 0, last_column = 0;
  for (const int point : sighting.points) {
    const int c = point % target.columns, r = point / target.columns;
    first_row += r == 0;
    last_row += r == target.rows - 1;
    first_column += c == 0;
    last_column += c == target.columns - 1;
  }
  return 2 * std::min(first_row, last_row) < target.columns ||
         2 * std::min(first_column, last_column) < target.rows;
}

/// What the library has found, with the fine model where the picture shows its crossings.
struct Board {
  std::vector<Grid> grids;  ///< by way of finding, those that were successful
  bool by_sectors = false;  ///< the last of them is OpenCV's sectors
  bool exhausted = false;   ///< there is no other way to find it
  Sighting fitted{kImageModel, {}, {}};
  std::size_t seed = 0;  ///< the grid that the fit started from
};

void fit(const GreyImage& image, const Rectifier& rectifier, Board& board) {
  for (std::size_t i = 0; i < board.grids.size(); ++i) {
    if (board.fitted.points.size() == board.grids[i].corners.size()) return;
    Sighting candidate = fit_crossings(image, rectifier, board.grids[i]);
    if (candidate.points.size() <= board.fitted.points.size()) continue;
    board.fitted = std::move(candidate);
    board.seed = i;
  }
}

Grid grid_of(const GreyImage& image, const Target& target, Corners corners) {
  Grid grid{target.columns, target.rows, std::move(corners)};
  put_in_order(image, grid);
  return grid;
}

/// The classic search takes seconds where it fails, as it does on boards that a wide lens bends: the whole
/// picture is searched only where sectors find nothing.
Board find_board(const GreyImage& image, const Target& target, Search search) {
  const int width = search == Search::glance ? kSearchWidth : kSectorsWidth;
  Corners sectors = find_sectors(image, target, width), classic;
  const bool exhausted = search == Search::glance || sectors.empty();
  if (search == Search::thorough && sectors.empty()) {
    classic = find_classic(image, target, whole_of(image));
    if (classic.empty()) sectors = find_sectors(image, target, kSectorsWidth, cv::CALIB_CB_EXHAUSTIVE);
    // Squares of a few pixels are lost in a smaller picture.
    if (classic.empty() && sectors.empty() && image.width > kSectorsWidth)
      sectors = find_sectors(image, target, image.width);
  }
  Board board{.grids = {}, .by_sectors = !sectors.empty(), .exhausted = exhausted};
  for (Corners* corners : {&classic, &sectors})
    if (!corners->empty()) board.grids.push_back(grid_of(image, target, std::move(*corners)));
  return board;
}

/// The classic search's corners before those of the sectors, looked for where these are.
void add_classic(const GreyImage& image, const Target& target, Board& board) {
  Corners classic = find_classic(image, target, surroundings(image, board.grids.back()));
  if (classic.empty()) return;
  board.grids.insert(board.grids.begin(), grid_of(image, target, std::move(classic)));
  ++board.seed;
}

}  // namespace

Finder chessboard_finder(const Target& target, const Rectifier& rectifier, Search search) {
  return [target, &rectifier, search](const GreyImage& image) {
    const auto count = static_cast<std::size_t>(target.columns * target.rows);
    Found found;
    Board board = find_board(image, target, search);
    if (board.grids.empty()) {
      found.reason = "no chessboard of " + std::to_string(target.columns) + " x " +
                     std::to_string(target.rows) + " inner corners";
      found.is_open = search != Search::thorough;
      return found;
    }
    const auto enough = [&] {
      return static_cast<double>(board.fitted.points.size()) >= kLeastShare * static_cast<double>(count);
    };
    fit(image, rectifier, board);
    if (board.fitted.points.size() < count && !board.exhausted) {
      add_classic(image, target, board);
      fit(image, rectifier, board);
    }
    // A pattern that is thrown on the board, as infrared cameras do, is finer than its squares.
    if (!enough()) fit(smoothed(image), rectifier, board);
    const bool half = 2 * board.fitted.points.size() >= count;
    if (half && lacks_a_side(board.fitted, target)) {
      found.reason = "a chessboard was found, but only " + std::to_string(board.fitted.points.size()) +
                     " of its " + std::to_string(count) + " corners show a crossing";
      return found;
    }
    if (board.by_sectors) found.sightings.push_back(all_points("sectors", board.grids.back().corners));
    // Without the fine model the library's corners stay.
    const Grid& seed = board.grids[enough() ? board.seed : 0];
    const Sighting start = enough() ? board.fitted : all_points(kImageModel, seed.corners);
    found.sightings.push_back(
        {"corner_sub_pix", start.points, corner_sub_pix(image, start.pixels, half_window(seed))});
    if (enough()) found.sightings.push_back(std::move(board.fitted));
    return found;
  };
}

}  // namespace flash::calib
