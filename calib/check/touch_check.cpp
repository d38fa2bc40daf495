#include "calib/check/touch_check.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/check/chance.h"
#include "calib/geometry/pose.h"
#include "data/camera/camera.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::calib {
namespace {

constexpr std::string_view kHeader = "x,y,z,u,v";

using Rows23 = Eigen::Matrix<double, 2, 3>;

/// Derivative of the pixel by a place in the camera's frame.
Rows23 pixel_by_place(const data::CameraIntrinsics& lens, const Eigen::Vector3d& place) {
  const double step = 1e-6 * place.norm();
  Rows23 rows;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d d = step * Eigen::Vector3d::Unit(axis);
    rows.col(axis) = (*data::project(lens, place + d) - *data::project(lens, place - d)) / (2 * step);
  }
  return rows;
}

}  // namespace

std::vector<TouchedPoint> load_touched_points(const std::string& path) {
  const std::string text = data::read_file(path);
  data::LineReader lines(text);
  std::string_view line;
  if (!lines.next(line) || line != kHeader)
    throw data::input_error(
        path, "line 1", "expected the header " + std::string(kHeader) + ", metres in the base and pixels");
  std::vector<TouchedPoint> points;
  while (lines.next(line)) {
    if (line.empty()) continue;
    const std::vector<std::string_view> cells = data::split(line, ",");
    Eigen::Matrix<double, 5, 1> values;
    bool sound = cells.size() == 5;
    for (std::size_t k = 0; sound && k < cells.size(); ++k) {
      const std::optional<double> value = data::parse_number(cells[k]);
      sound = value && std::isfinite(*value);
      if (sound) values[static_cast<Eigen::Index>(k)] = *value;
    }
    if (!sound)
      throw data::input_error(
          path, "line " + std::to_string(lines.number()),
          "found \"" + std::string(line) + "\", expected five numbers, " + std::string(kHeader));
    points.push_back({values.head<3>(), values.tail<2>()});
  }
  if (points.empty()) throw data::input_error(path, "line 2", "missing, expected at least one point");
  return points;
}

TouchCheck check_touched(const Extrinsics& extrinsics, const std::vector<TouchedPoint>& points,
                         const TouchSettings& settings, const std::string& path) {
  if (extrinsics.setup != Setup::eye_to_hand)
    throw data::InputError("--extrinsics: found a camera on the gripper, expected one beside the robot");
  if (!extrinsics.lens)
    throw data::InputError("--extrinsics: found a calibration of pairs of poses, expected one with a lens");
  constexpr std::size_t kMost = 1000;  // whose covariance is a dense matrix
  if (points.size() > kMost)
    throw data::InputError(path + ": found " + data::format_count(points.size()) +
                           " points, expected at most " + data::format_count(kMost));
  const data::CameraIntrinsics& lens = *extrinsics.lens;
  const Eigen::Isometry3d camera_from_base = extrinsics.transform.T.inverse();
  const auto count = static_cast<Eigen::Index>(points.size());
  TouchCheck check;
  Eigen::VectorXd errors(2 * count);
  Eigen::MatrixXd by_pose(2 * count, 6), by_shift(2 * count, 3),
      noise = Eigen::MatrixXd::Zero(2 * count, 2 * count);
  double depths = 0, likely = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const TouchedPoint& point = points[static_cast<std::size_t>(i)];
    const Eigen::Vector3d place = camera_from_base * point.place;
    constexpr double kNearest = 0.01;  // before the camera [m]
    if (!(place.z() > kNearest))
      throw data::input_error(path, "point " + std::to_string(i + 1),
                              "lies behind the camera or in it: are the places in metres, in the base?");
    const auto inside = [](double value, int size) { return value >= -0.5 && value <= size - 0.5; };
    if (!inside(point.pixel.x(), lens.width) || !inside(point.pixel.y(), lens.height))
      throw data::input_error(path, "point " + std::to_string(i + 1),
                              "found pixel " + data::format_short(point.pixel.x()) + ", " +
                                  data::format_short(point.pixel.y()) + ", expected one of the picture, " +
                                  std::to_string(lens.width) + " x " + std::to_string(lens.height));
    const Eigen::Vector2d pixel = data::project(lens, place).value();
    const Rows23 by_place = pixel_by_place(lens, place);
    Eigen::Matrix<double, 3, 6> moves;  // of the place in the camera, by the camera's right perturbation
    moves << -Eigen::Matrix3d::Identity(), skew(place);
    errors.segment<2>(2 * i) = point.pixel - pixel;
    by_pose.middleRows<2>(2 * i) = by_place * moves;
    by_shift.middleRows<2>(2 * i) = -by_place * camera_from_base.linear();
    noise.block<2, 2>(2 * i, 2 * i) =
        settings.touch_sd * settings.touch_sd * by_place * by_place.transpose() +
        settings.pixel_sd * settings.pixel_sd * Eigen::Matrix2d::Identity();
    const Eigen::Vector3d ray = data::unproject(lens, point.pixel, 1).normalized();
    const double across = (place - ray * ray.dot(place)).norm();
    check.points.push_back({errors.segment<2>(2 * i), across});
    check.rms_px += errors.segment<2>(2 * i).squaredNorm() / static_cast<double>(count);
    check.rms_across += across * across / static_cast<double>(count);
    const double metres = place.z() / std::sqrt(lens.fx * lens.fy);  // a pixel
    const Eigen::Matrix2d own =
        noise.block<2, 2>(2 * i, 2 * i) +
        by_pose.middleRows<2>(2 * i) * extrinsics.covariance * by_pose.middleRows<2>(2 * i).transpose();
    likely += metres * metres * own.trace() / static_cast<double>(count);
    depths += place.z() / static_cast<double>(count);
  }
  check.rms_px = std::sqrt(check.rms_px);
  check.rms_across = std::sqrt(check.rms_across);
  check.expected_across = std::sqrt(likely);
  const Eigen::LDLT<Eigen::MatrixXd> all(noise + by_pose * extrinsics.covariance * by_pose.transpose());
  check.chi_square = errors.dot(all.solve(errors));
  check.chance = chance_beyond(check.chi_square, 2 * static_cast<int>(count));
  const Eigen::Vector3d score = by_shift.transpose() * all.solve(errors);
  const Eigen::Matrix3d scatter = by_shift.transpose() * all.solve(by_shift);
  check.shift_chance = chance_beyond(score.dot(scatter.completeOrthogonalDecomposition().solve(score)), 3);
  constexpr double kContradicts = 0.01;  // shared by both
  check.contradicts = std::min(check.chance, check.shift_chance) < 0.5 * kContradicts;
  // By the points alone: one of them says nothing along its ray, of which the range of depths is the prior.
  const Eigen::LDLT<Eigen::MatrixXd> alone(noise);
  const Eigen::Matrix3d information =
      by_shift.transpose() * alone.solve(by_shift) + Eigen::Matrix3d::Identity() / (depths * depths);
  const Eigen::Matrix3d covariance = information.inverse();
  check.shift = covariance * (by_shift.transpose() * alone.solve(errors));
  check.shift_sd = covariance.diagonal().cwiseSqrt();
  constexpr double kTold = 10;  // touches
  check.judges = check.shift_sd.maxCoeff() < kTold * settings.touch_sd;
  return check;
}

std::string describe(const TouchCheck& check) {
  char text[400];
  std::snprintf(
      text, sizeof text,
      "the touched points are missed by %.2f mm across the line of sight (%.2f px) where about %.2f mm are "
      "expected; a right calibration would miss them by more with a chance of %s; they fit best with the "
      "camera moved by (%.1f, %.1f, %.1f) +- (%.1f, %.1f, %.1f) mm, and by more with a chance of %s",
      1e3 * check.rms_across, check.rms_px, 1e3 * check.expected_across, chance_text(check.chance).c_str(),
      1e3 * check.shift.x(), 1e3 * check.shift.y(), 1e3 * check.shift.z(), 1e3 * check.shift_sd.x(),
      1e3 * check.shift_sd.y(), 1e3 * check.shift_sd.z(), chance_text(check.shift_chance).c_str());
  return text;
}

}  // namespace flash::calib
