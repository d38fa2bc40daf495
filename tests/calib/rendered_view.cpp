#include "tests/calib/rendered_view.h"

#include <apriltag.h>
#include <tag36h11.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/aruco.hpp>
#include <stdexcept>

namespace flash::calib {
namespace {

constexpr double kDotShare = 0.25;  // radius of a dot over the spacing
constexpr double kBigDotShare = 0.42;

std::vector<int> aruco_modules(const std::string& name, int id, int& side) {
  static const std::map<std::string, int> known = {{"DICT_4X4_50", cv::aruco::DICT_4X4_50},
                                                   {"DICT_5X5_100", cv::aruco::DICT_5X5_100},
                                                   {"DICT_6X6_250", cv::aruco::DICT_6X6_250}};
  const cv::Ptr<cv::aruco::Dictionary> dictionary = cv::aruco::getPredefinedDictionary(known.at(name));
  side = dictionary->markerSize + 2;
  cv::Mat picture;
  cv::aruco::drawMarker(dictionary, id, side, picture, 1);
  std::vector<int> modules;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) modules.push_back(picture.at<unsigned char>(y, x) > 127);
  return modules;
}

std::vector<int> tag_modules(int id, bool double_border, int& side) {
  apriltag_family_t* family = tag36h11_create();
  image_u8_t* picture = apriltag_to_image(family, id);
  const int border = (family->total_width - family->width_at_border) / 2, extra = double_border ? 1 : 0;
  side = family->width_at_border + 2 * extra;
  std::vector<int> modules(static_cast<std::size_t>(side * side), 0);
  for (int y = 0; y < family->width_at_border; ++y)
    for (int x = 0; x < family->width_at_border; ++x)
      modules[static_cast<std::size_t>((y + extra) * side + x + extra)] =
          picture->buf[(y + border) * picture->stride + x + border] > 127;
  image_u8_destroy(picture);
  tag36h11_destroy(family);
  return modules;
}

/// Where the white of the print ends.
Eigen::AlignedBox2d print_of(const Target& t) {
  const double pitch = t.marker_size + t.marker_gap;
  switch (t.kind) {
    case TargetKind::chessboard:
      return {Eigen::Vector2d(-1.6, -1.6) * t.spacing,
              Eigen::Vector2d(t.columns + 0.6, t.rows + 0.6) * t.spacing};
    case TargetKind::charuco:
      return {Eigen::Vector2d(-0.5, -0.5) * t.spacing,
              Eigen::Vector2d(t.columns + 0.5, t.rows + 0.5) * t.spacing};
    case TargetKind::aruco:
    case TargetKind::apriltag:
      return {Eigen::Vector2d(-0.75, -0.75) * t.marker_size, Eigen::Vector2d(0.75, 0.75) * t.marker_size};
    case TargetKind::aruco_grid:
      return {Eigen::Vector2d(-pitch / 2, -pitch / 2),
              Eigen::Vector2d(t.columns + 0.5, t.rows + 0.5) * pitch};
    case TargetKind::aprilgrid:
      return {Eigen::Vector2d(-pitch / 2, -(t.rows + 0.5) * pitch),
              Eigen::Vector2d((t.columns + 0.5) * pitch, pitch / 2)};
    case TargetKind::circle_grid:
      break;
  }
  const double far = (t.rows - 1) * t.spacing;
  return {Eigen::Vector2d(-t.spacing, t.has_origin ? -far - t.spacing : -t.spacing),
          Eigen::Vector2d(t.columns * t.spacing, t.has_origin ? t.spacing : far + t.spacing)};
}

/// A dot in every square of 6 px, at random in it, as depth cameras throw them: light over other light, of
/// every pixel.
std::vector<double> dot_pattern(int width, int height, double brightness) {
  constexpr int kSquare = 6;       // [px]
  constexpr double kRadius = 0.9;  // of a dot, sigma [px]
  std::vector<double> light(static_cast<std::size_t>(width * height), 1);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(0, kSquare);
  for (int top = 0; top < height; top += kSquare)
    for (int left = 0; left < width; left += kSquare) {
      const double cx = left + place(random), cy = top + place(random);
      for (int y = std::max(0, top - 4); y < std::min(height, top + kSquare + 4); ++y)
        for (int x = std::max(0, left - 4); x < std::min(width, left + kSquare + 4); ++x)
          light[static_cast<std::size_t>(y * width + x)] +=
              brightness * std::exp(-0.5 * ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (kRadius * kRadius));
    }
  return light;
}

}  // namespace

Renderer::Renderer(const Target& target, const data::CameraIntrinsics& camera, const RenderSettings& settings)
    : target_(target), camera_(camera), settings_(settings), print_(print_of(target)) {
  const bool tags = target.kind == TargetKind::apriltag || target.kind == TargetKind::aprilgrid;
  int count = 0;
  if (target.kind == TargetKind::aruco || target.kind == TargetKind::apriltag) count = 1;
  if (target.kind == TargetKind::aruco_grid || target.kind == TargetKind::aprilgrid)
    count = target.columns * target.rows;
  if (target.kind == TargetKind::charuco) count = target.columns * target.rows / 2;
  for (int i = 0; i < count; ++i) {
    const int id = std::max(0, target.first_id) + i;
    markers_.push_back(tags ? tag_modules(id, settings.double_border, modules_)
                            : aruco_modules(target.dictionary, id, modules_));
  }
  rays_.reserve(static_cast<std::size_t>(camera.width + 1) * static_cast<std::size_t>(camera.height + 1));
  for (int y = 0; y <= camera.height; ++y)
    for (int x = 0; x <= camera.width; ++x)
      rays_.emplace_back(data::unproject(camera, {x - 0.5, y - 0.5}, 1).head<2>());
}

Eigen::Vector2d Renderer::ray(double x, double y) const {
  // Linear between the corners of a pixel: the lens bends by less than 1e-5 px within one.
  const int x0 = std::clamp(static_cast<int>(std::floor(x + 0.5)), 0, camera_.width - 1);
  const int y0 = std::clamp(static_cast<int>(std::floor(y + 0.5)), 0, camera_.height - 1);
  const double u = x + 0.5 - x0, v = y + 0.5 - y0;
  const std::size_t row = static_cast<std::size_t>(camera_.width + 1);
  const std::size_t i = static_cast<std::size_t>(y0) * row + static_cast<std::size_t>(x0);
  return (1 - v) * ((1 - u) * rays_[i] + u * rays_[i + 1]) +
         v * ((1 - u) * rays_[i + row] + u * rays_[i + row + 1]);
}

double Renderer::marker_shade(int index, double u, double v) const {
  const int x = std::clamp(static_cast<int>(u * modules_), 0, modules_ - 1);
  const int y = std::clamp(static_cast<int>(v * modules_), 0, modules_ - 1);
  return markers_[static_cast<std::size_t>(index)][static_cast<std::size_t>(y * modules_ + x)];
}

double Renderer::board_shade(double x, double y) const {
  const Target& t = target_;
  const int column = static_cast<int>(std::floor(x / t.spacing)),
            row = static_cast<int>(std::floor(y / t.spacing));
  if (t.kind == TargetKind::chessboard) {
    // The square between the first four inner corners is black.
    if (column < -1 || row < -1 || column >= t.columns || row >= t.rows) return 1;
    return (column + row) % 2 == 0 ? 0 : 1;
  }
  if (column < 0 || row < 0 || column >= t.columns || row >= t.rows) return 1;
  if ((column + row) % 2 == 0) return 0;
  const double margin = (t.spacing - t.marker_size) / 2;
  const double u = (x - column * t.spacing - margin) / t.marker_size;
  const double v = (y - row * t.spacing - margin) / t.marker_size;
  if (u < 0 || v < 0 || u >= 1 || v >= 1) return 1;
  int index = 0;  // of white squares before this one, row by row
  for (int r = 0; r <= row; ++r)
    for (int c = 0; c < (r == row ? column : t.columns); ++c) index += (c + r) % 2;
  return marker_shade(index, u, v);
}

double Renderer::shade(double x, double y) const {
  if (!print_.contains(Eigen::Vector2d(x, y))) return -1;
  const Target& t = target_;
  const double side = t.marker_size, pitch = t.marker_size + t.marker_gap;
  if (t.kind == TargetKind::chessboard || t.kind == TargetKind::charuco) return board_shade(x, y);
  if (t.kind == TargetKind::aruco || t.kind == TargetKind::apriltag) {
    const double u = x / side + 0.5, v = y / side + 0.5;
    return u < 0 || v < 0 || u >= 1 || v >= 1 ? 1 : marker_shade(0, u, v);
  }
  if (t.kind == TargetKind::aruco_grid || t.kind == TargetKind::aprilgrid) {
    const bool upward = t.kind == TargetKind::aprilgrid;
    // In the print's own rows, from above; an aprilgrid begins with the lowest.
    const double down = upward ? y + t.rows * pitch - t.marker_gap : y;
    const int column = static_cast<int>(std::floor(x / pitch)),
              row = static_cast<int>(std::floor(down / pitch));
    const double u = (x - column * pitch) / side, v = (down - row * pitch) / side;
    const bool inside = column >= 0 && row >= 0 && column < t.columns && row < t.rows;
    if (inside && u < 1 && v < 1)
      return marker_shade((upward ? t.rows - 1 - row : row) * t.columns + column, u, v);
    // Kalibr fills the crossings of the gaps.
    if (upward && u >= 1 && v >= 1 && column >= -1 && row >= -1 && column < t.columns && row < t.rows)
      return 0;
    return 1;
  }
  const double down = t.has_origin ? -y : y;
  const int column = static_cast<int>(std::lround(x / t.spacing)),
            row = static_cast<int>(std::lround(down / t.spacing));
  if (column < 0 || row < 0 || column >= t.columns || row >= t.rows) return 1;
  const double share = t.has_origin && column == 0 && row == 0 ? kBigDotShare : kDotShare;
  return std::hypot(x - column * t.spacing, down - row * t.spacing) < share * t.spacing ? 0 : 1;
}

std::vector<double> Renderer::light(const Eigen::Isometry3d& T_camera_target) const {
  // From a ray to the plane z = 0 of the target.
  const Eigen::Isometry3d inverse = T_camera_target.inverse();
  const auto brightness = [&](double x, double y) {
    const Eigen::Vector3d direction = inverse.linear() * ray(x, y).homogeneous();
    const double reach = -inverse.translation().z() / direction.z();
    const Eigen::Vector3d place = inverse.translation() + reach * direction;
    const double found = reach > 0 ? shade(place.x(), place.y()) : -1;
    return found < 0 ? settings_.background : settings_.black + found * (settings_.white - settings_.black);
  };
  const int w = camera_.width, h = camera_.height, n = settings_.samples;
  std::vector<double> picture(static_cast<std::size_t>(w * h));
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      // Squares and modules are larger than a pixel: where nine places agree, all do.
      double sum = brightness(x, y);
      bool same = true;
      for (int k = 0; k < 9 && same; ++k)
        same = brightness(x + 0.5 * (k % 3 - 1), y + 0.5 * (k / 3 - 1)) == sum;
      if (!same) {
        sum = 0;
        for (int j = 0; j < n; ++j)
          for (int i = 0; i < n; ++i) sum += brightness(x + (i + 0.5) / n - 0.5, y + (j + 0.5) / n - 0.5);
        sum /= n * n;
      }
      picture[static_cast<std::size_t>(y * w + x)] = sum;
    }
  return picture;
}

GreyImage Renderer::draw(const Eigen::Isometry3d& T_camera_target, std::mt19937& random) const {
  return draw(std::vector{T_camera_target}, random);
}

GreyImage Renderer::draw(const std::vector<Eigen::Isometry3d>& T_camera_target, std::mt19937& random) const {
  const int w = camera_.width, h = camera_.height;
  std::vector<double> picture(static_cast<std::size_t>(w * h));
  for (const Eigen::Isometry3d& pose : T_camera_target) {
    const std::vector<double> each = light(pose);
    for (std::size_t i = 0; i < picture.size(); ++i)
      picture[i] += each[i] / static_cast<double>(T_camera_target.size());
  }
  if (settings_.dots > 0) {
    const std::vector<double> light = dot_pattern(w, h, settings_.dots);
    for (std::size_t i = 0; i < picture.size(); ++i) picture[i] *= light[i];
  }

  std::vector<double> kernel;
  const int reach = static_cast<int>(std::ceil(4 * settings_.blur));
  double total = 0;
  for (int k = -reach; k <= reach; ++k) {
    kernel.push_back(settings_.blur > 0 ? std::exp(-0.5 * k * k / (settings_.blur * settings_.blur)) : 1);
    total += kernel.back();
  }
  for (const bool along_x : {true, false}) {
    const std::vector<double> before = picture;
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        double sum = 0;
        for (int k = -reach; k <= reach; ++k) {
          const int sx = along_x ? std::clamp(x + k, 0, w - 1) : x,
                    sy = along_x ? y : std::clamp(y + k, 0, h - 1);
          sum += kernel[static_cast<std::size_t>(k + reach)] * before[static_cast<std::size_t>(sy * w + sx)];
        }
        picture[static_cast<std::size_t>(y * w + x)] = sum / total;
      }
  }
  GreyImage image;
  image.width = w;
  image.height = h;
  std::normal_distribution<double> noise(0, std::max(settings_.noise, 1e-12));
  for (double& value : picture) value = 255 * std::pow(value / 255, 1 / settings_.gamma);
  for (const double value : picture)
    image.pixels.push_back(
        static_cast<std::uint8_t>(std::clamp(std::lround(value + noise(random)), 0L, 255L)));
  return image;
}

std::vector<double> Renderer::depth(const Eigen::Isometry3d& T_camera_target) const {
  const Eigen::Isometry3d inverse = T_camera_target.inverse();
  std::vector<double> depth;
  for (int y = 0; y < camera_.height; ++y)
    for (int x = 0; x < camera_.width; ++x) {
      const Eigen::Vector3d direction = inverse.linear() * ray(x, y).homogeneous();
      const double reach = -inverse.translation().z() / direction.z();
      const Eigen::Vector3d place = inverse.translation() + reach * direction;
      depth.push_back(reach > 0 && shade(place.x(), place.y()) >= 0 ? reach : 0);
    }
  return depth;
}

Eigen::Isometry3d random_view(const Target& target, const data::CameraIntrinsics& camera,
                              double least_distance, double most_distance, double tilt,
                              std::mt19937& random) {
  const Eigen::Matrix3Xd points = target_points(target);
  const Eigen::Vector3d middle = (points.rowwise().minCoeff() + points.rowwise().maxCoeff()) / 2;
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const double distance = least_distance + (most_distance - least_distance) * (unit(random) + 1) / 2;
    const double towards = M_PI * unit(random);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() =
        (Eigen::AngleAxisd(tilt * unit(random), Eigen::Vector3d(std::cos(towards), std::sin(towards), 0)) *
         Eigen::AngleAxisd(M_PI * unit(random), Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
    pose.translation() =
        Eigen::Vector3d(0.3 * unit(random) * distance * camera.width / (2 * camera.fx),
                        0.3 * unit(random) * distance * camera.height / (2 * camera.fy), distance) -
        pose.linear() * middle;
    bool seen = true;
    for (Eigen::Index i = 0; i < points.cols() && seen; ++i) {
      const auto pixel = data::project(camera, pose * points.col(i));
      seen = pixel && pixel->x() > 25 && pixel->y() > 25 && pixel->x() < camera.width - 26 &&
             pixel->y() < camera.height - 26;
    }
    if (seen) return pose;
  }
  throw std::runtime_error("the target does not fit into the picture");
}

data::CameraIntrinsics small_camera() {
  data::CameraIntrinsics camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 615;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

}  // namespace flash::calib
