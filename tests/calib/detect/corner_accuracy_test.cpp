#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "calib/detect/detect.h"
#include "calib/detect/finder.h"
#include "calib/geometry/pose_from_pixels.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

struct Errors {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0;
  double residuals = 0;  ///< squares that are left by the pose that fits best: six of its numbers are fitted
  int points = 0, views = 0;
  Eigen::Vector2d bias() const { return sum / points; }
  double rms() const { return std::sqrt(squares / (2 * points)); }  ///< per axis
  double told() const {
    return std::sqrt(residuals / (2 * points - 6 * views));
  }  ///< noise, without the truth
  void add(const Errors& other) {
    sum += other.sum;
    squares += other.squares;
    residuals += other.residuals;
    points += other.points;
    views += other.views;
  }
};

/// Of one view, numbered as fits best among the numberings that the picture cannot tell apart.
Errors errors_of(const Sighting& sighting, const Target& target, const data::CameraIntrinsics& camera,
                 const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3Xd points = target_points(target);
  Errors best;
  for (const std::vector<int>& symmetry : target_symmetries(target)) {
    Errors errors;
    errors.views = 1;
    Eigen::Matrix3Xd seen(3, sighting.points.size());
    Eigen::Matrix2Xd pixels(2, sighting.points.size());
    for (std::size_t i = 0; i < sighting.points.size(); ++i) {
      const int point = symmetry[static_cast<std::size_t>(sighting.points[i])];
      const Eigen::Vector2d error = sighting.pixels[i] - *data::project(camera, pose * points.col(point));
      errors.sum += error;
      errors.squares += error.squaredNorm();
      seen.col(errors.points) = points.col(point);
      pixels.col(errors.points) = sighting.pixels[i];
      ++errors.points;
    }
    const Eigen::Isometry3d fitted = fitted_pose(camera, seen, pixels, pose);
    for (int i = 0; i < errors.points; ++i)
      errors.residuals += (pixels.col(i) - *data::project(camera, fitted * seen.col(i))).squaredNorm();
    if (best.points == 0 || errors.squares < best.squares) best = errors;
  }
  return best;
}

struct Series {
  const char* target;
  double least_distance, most_distance;  ///< [m]
  double tilt;                           ///< [rad]
};

std::ostream& operator<<(std::ostream& stream, const Series& series) { return stream << series.target; }

int view_count() {
  const char* const text = std::getenv("FLASH_RENDERED_VIEWS");  // more for the table in the documentation
  return text ? std::atoi(text) : 6;
}

/// Errors of each refiner over random views, against where the camera model projects the target's points.
std::map<std::string, Errors> measure(const Series& series, const data::CameraIntrinsics& camera,
                                      const RenderSettings& settings = {}, int views = view_count()) {
  const Target target = parse_target(series.target);
  const Renderer renderer(target, camera, settings);
  const Rectifier rectifier(camera);
  const Finder finder = make_finder(target, rectifier);
  std::mt19937 random(7);
  std::map<std::string, Errors> errors;
  for (int view = 0; view < views; ++view) {
    const Eigen::Isometry3d pose =
        random_view(target, camera, series.least_distance, series.most_distance, series.tilt, random);
    const Found found = finder(renderer.draw(pose, random));
    EXPECT_FALSE(found.sightings.empty()) << series.target << " view " << view << ": " << found.reason;
    for (const Sighting& sighting : found.sightings) {
      errors[sighting.refiner].add(errors_of(sighting, target, camera, pose));
    }
  }
  for (const auto& [refiner, sums] : errors)
    std::printf("%-40s %-15s %3d views %5d points  bias %+.4f %+.4f px  rms an axis %.4f px\n", series.target,
                refiner.c_str(), sums.views, sums.points, sums.bias().x(), sums.bias().y(), sums.rms());
  return errors;
}

class CornerAccuracy : public testing::TestWithParam<Series> {};

TEST_P(CornerAccuracy, HasNoBiasOnRenderedTruth) {
  const std::map<std::string, Errors> errors = measure(GetParam(), small_camera());
  const auto found = errors.find(kImageModel);
  ASSERT_NE(found, errors.end());
  EXPECT_EQ(found->second.views, view_count());
  EXPECT_LT(found->second.bias().cwiseAbs().maxCoeff(), 0.02);  // what the project promises
  EXPECT_LT(found->second.rms(), 0.03);  // noise of 2 grey levels leaves 0.004 to 0.012
}

// Larger pictures are searched at a smaller size. Where corners are is found at their own: the same noise of
// 2 grey levels leaves the same share of a pixel.
TEST(CornersOfLargePictures, AreAsExactAsThoseOfSmallOnes) {
  data::CameraIntrinsics camera = small_camera();
  constexpr int kLarger = 5;
  camera.width *= kLarger;
  camera.height *= kLarger;
  for (double* length : {&camera.fx, &camera.fy}) *length *= kLarger;
  for (double* place : {&camera.cx, &camera.cy}) *place = kLarger * (*place + 0.5) - 0.5;
  const std::map<std::string, Errors> errors =
      measure({"chessboard:9x6:0.025", 0.35, 0.7, 0.8}, camera, {}, 2);
  const auto found = errors.find(kImageModel);
  ASSERT_NE(found, errors.end());
  EXPECT_EQ(found->second.points, 2 * 54);
  EXPECT_LT(found->second.bias().cwiseAbs().maxCoeff(), 0.02);
  EXPECT_LT(found->second.rms(), 0.03);
  // Squares of ten pixels are five in the smaller picture: too few.
  EXPECT_FALSE(measure({"chessboard:9x6:0.025", 7, 8, 0.3}, camera, {}, 1).empty());
}

INSTANTIATE_TEST_SUITE_P(Targets, CornerAccuracy,
                         testing::Values(Series{"chessboard:9x6:0.025", 0.35, 0.7, 0.8},
                                         Series{"charuco:5x7:0.036:0.018:DICT_6X6_250", 0.45, 0.8, 0.7},
                                         Series{"aruco:DICT_4X4_50:0:0.09", 0.7, 1.2, 0.9},
                                         Series{"aruco_grid:4x3:0.04:0.01:DICT_5X5_100", 0.35, 0.6, 0.7},
                                         Series{"apriltag:36h11:3:0.09", 0.7, 1.2, 0.9},
                                         Series{"aprilgrid:4x3:0.05:0.3", 0.4, 0.6, 0.7},
                                         Series{"circles:7x5:0.03", 0.35, 0.6, 0.8},
                                         Series{"circles:10x10:0.0254:origin-dot", 0.5, 0.8, 0.7}));

TEST(CornerAccuracyOf, TagsOfAKalibrGridAreFoundByTheirDoubleBorder) {
  RenderSettings settings;
  settings.double_border = true;
  const auto errors = measure({"aprilgrid:4x3:0.05:0.3", 0.4, 0.6, 0.7}, small_camera(), settings);
  ASSERT_EQ(errors.count(kImageModel), 1u);
  EXPECT_LT(errors.at(kImageModel).bias().cwiseAbs().maxCoeff(), 0.02);
}

// The lens bends lines by half a pixel within a square here; shapes fitted at rectified places do not notice.
TEST(CornerAccuracyOf, HasNoBiasThroughAWideLens) {
  data::CameraIntrinsics camera = small_camera();
  camera.fx = camera.fy = 420;
  camera.model = data::DistortionModel::plumb_bob;
  camera.distortion = {-0.28, 0.09, 0.001, -0.0007, -0.012};
  for (const Series& series :
       {Series{"chessboard:9x6:0.025", 0.25, 0.5, 0.8}, Series{"apriltag:36h11:3:0.09", 0.4, 0.8, 0.9},
        Series{"circles:10x10:0.0254:origin-dot", 0.35, 0.5, 0.7}}) {
    const auto errors = measure(series, camera);
    ASSERT_EQ(errors.count(kImageModel), 1u);
    EXPECT_LT(errors.at(kImageModel).bias().cwiseAbs().maxCoeff(), 0.02);
    EXPECT_LT(errors.at(kImageModel).rms(), 0.03);
  }
}

// A sharp lens, and one out of focus.
TEST(CornerAccuracyOf, HasNoBiasWhateverTheBlur) {
  for (const double blur : {0.3, 1.8})
    for (const char* target : {"chessboard:9x6:0.025", "aruco:DICT_4X4_50:0:0.09"}) {
      RenderSettings settings;
      settings.blur = blur;
      const bool board = std::string(target).starts_with("chessboard");
      const auto errors =
          measure({target, board ? 0.35 : 0.7, board ? 0.6 : 1.0, 0.7}, small_camera(), settings);
      ASSERT_EQ(errors.count(kImageModel), 1u);
      EXPECT_LT(errors.at(kImageModel).bias().cwiseAbs().maxCoeff(), 0.02);
      EXPECT_LT(errors.at(kImageModel).rms(), 0.03);
    }
}

// The dots of a depth camera's projector hide crossings. No board may be lost for that, and what the corners
// say of their own noise has to be so: with 48 x 2 numbers a view it scatters by 3 % over six views.
TEST(CornerAccuracyOf, BoardsUnderProjectedDotsAreFoundAndTheirNoiseIsTold) {
  for (const double dots : {0.5, 1.5}) {
    const auto errors =
        measure({"chessboard:8x6:0.025", 0.35, 0.6, 0.7}, small_camera(), {.noise = 2, .dots = dots});
    for (const auto& [refiner, sums] : errors) {
      if (refiner == "sectors") continue;  // seeds of the others
      EXPECT_LT(sums.rms(), 0.5) << refiner;
      EXPECT_NEAR(sums.told() / sums.rms(), 1, 0.1) << refiner;
    }
  }
}

TEST(CornerAccuracyOf, RecordedInfraredBoardsAreAllFound) {
  const std::string folder = std::string(FLASH_SHARED_DIR) + "/data/handeye/eih_infrared_chessboard";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no shared data";
  const Dataset dataset = load_dataset(folder, {.needs_camera = false});
  const std::vector<Detection> detections = detect(dataset, parse_target(dataset.target));
  ASSERT_EQ(detections.size(), 6u);
  for (const Detection& detection : detections)
    EXPECT_FALSE(detection.readings.empty()) << detection.image << ": " << detection.reason;
}

}  // namespace
}  // namespace flash::calib
