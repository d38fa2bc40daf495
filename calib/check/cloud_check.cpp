#include "calib/check/cloud_check.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "calib/detect/board_depth.h"
#include "data/files/error.h"

namespace flash::calib {
namespace {

constexpr int kLeastPoints = 50;
constexpr double kTrim = 4;  // flying pixels lie beyond that many times the rms
constexpr int kPictureWidth = 640;

struct Plane {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes =
      Eigen::Matrix3d::Identity();  ///< columns: two along the plane, the longer first, the normal
  double rms = 0;

  double distance(const Eigen::Vector3d& point) const { return axes.col(2).dot(point - middle); }
};

Plane fit_plane(const Eigen::Matrix3Xd& points) {
  Plane plane;
  plane.middle = points.rowwise().mean();
  const Eigen::Matrix3Xd centred = points.colwise() - plane.middle;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(centred * centred.transpose());
  plane.axes = solver.eigenvectors().rowwise().reverse();
  plane.axes.col(2) = plane.axes.col(0).cross(plane.axes.col(1));
  plane.rms = std::sqrt(std::max(0.0, solver.eigenvalues()[0]) / static_cast<double>(points.cols()));
  return plane;
}

/// Columns that lie within kTrim rms of their plane, twice over.
std::vector<Eigen::Index> near_plane(const Eigen::Matrix3Xd& points) {
  std::vector<Eigen::Index> kept(static_cast<std::size_t>(points.cols()));
  for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = static_cast<Eigen::Index>(i);
  for (int round = 0; round < 2 && kept.size() > 3; ++round) {
    const Plane plane = fit_plane(points(Eigen::all, kept));
    std::erase_if(
        kept, [&](Eigen::Index i) { return std::abs(plane.distance(points.col(i))) > kTrim * plane.rms; });
  }
  return kept;
}

/// A view in the frame in which the target rests.
struct Resting {
  Eigen::Matrix3Xd points, corners;
  std::vector<std::uint8_t> colour;
};

double shift_along(const Plane& plane, const Eigen::Vector3d& difference) {
  return (plane.axes.leftCols<2>().transpose() * difference).norm();
}

data::Picture draw_pattern(const Plane& plane, const std::vector<Resting>& views) {
  Eigen::AlignedBox2d bounds;
  for (const Resting& view : views)
    for (Eigen::Index i = 0; i < view.points.cols(); ++i)
      bounds.extend((plane.axes.leftCols<2>().transpose() * (view.points.col(i) - plane.middle)).eval());
  const double scale = kPictureWidth / bounds.sizes().x();
  const int height = std::clamp(static_cast<int>(scale * bounds.sizes().y()) + 1, 1, 2 * kPictureWidth);
  std::vector<double> sum(static_cast<std::size_t>(kPictureWidth * height)), count(sum.size());
  for (const Resting& view : views)
    for (Eigen::Index i = 0; i < view.points.cols(); ++i) {
      const Eigen::Vector2d place =
          scale * (plane.axes.leftCols<2>().transpose() * (view.points.col(i) - plane.middle) - bounds.min());
      const int x = std::clamp(static_cast<int>(place.x()), 0, kPictureWidth - 1);
      const int y = std::clamp(static_cast<int>(place.y()), 0, height - 1);
      const std::size_t k = static_cast<std::size_t>(y * kPictureWidth + x);
      sum[k] += view.colour[static_cast<std::size_t>(i)];
      ++count[k];
    }
  data::Picture picture(kPictureWidth, height, {90, 110, 160});
  for (std::size_t k = 0; k < sum.size(); ++k)
    if (count[k] > 0) {
      const auto value = static_cast<std::uint8_t>(sum[k] / count[k]);
      picture.pixels[k] = {value, value, value};
    }
  return picture;
}

data::Picture draw_profile(const Plane& plane, const std::vector<Resting>& views, double thickness) {
  constexpr int kHeight = 240;
  static const std::array<data::Colour, 8> colours = {{{31, 119, 180},
                                                       {255, 127, 14},
                                                       {44, 160, 44},
                                                       {214, 39, 40},
                                                       {148, 103, 189},
                                                       {140, 86, 75},
                                                       {227, 119, 194},
                                                       {23, 190, 207}}};
  data::Picture picture(kPictureWidth, kHeight, {255, 255, 255});
  double half = 1e-9;
  for (const Resting& view : views)
    for (Eigen::Index i = 0; i < view.points.cols(); ++i)
      half = std::max(half, std::abs(plane.axes.col(0).dot(view.points.col(i) - plane.middle)));
  const double reach = std::max(1e-6, 5 * thickness);  // from the middle to the upper edge
  for (std::size_t v = 0; v < views.size(); ++v)
    for (Eigen::Index i = 0; i < views[v].points.cols(); ++i) {
      const Eigen::Vector3d offset = views[v].points.col(i) - plane.middle;
      const int x = static_cast<int>((plane.axes.col(0).dot(offset) / half + 1) / 2 * (kPictureWidth - 1));
      const int y = static_cast<int>((1 - plane.axes.col(2).dot(offset) / reach) / 2 * (kHeight - 1));
      if (y >= 0 && y < kHeight)
        picture.at(std::clamp(x, 0, kPictureWidth - 1), y) = colours[v % colours.size()];
    }
  for (int x = 0; x < kPictureWidth; ++x) picture.at(x, kHeight / 2) = {0, 0, 0};
  return picture;
}

}  // namespace

TargetCloud target_cloud(const data::DepthMap& depth, const GreyImage& image,
                         const data::CameraIntrinsics& camera, const Observation& view) {
  expect_registered(depth, camera, view.image);
  TargetCloud cloud;
  cloud.image = view.image;
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector2i& pixel : pixels_within(view.pixels, depth.width, depth.height)) {
    const double z = depth.at(pixel.x(), pixel.y());
    if (!(z > 0)) continue;
    points.push_back(data::unproject(camera, pixel.cast<double>(), z));
    cloud.colour.push_back(image.at(pixel.x(), pixel.y()));
  }
  if (static_cast<int>(points.size()) < kLeastPoints) {
    cloud.colour.clear();
    return cloud;
  }
  cloud.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) cloud.points.col(static_cast<Eigen::Index>(i)) = points[i];
  // Corners at the depth of the whole plane: a single pixel there is as noisy as any.
  const Plane plane = fit_plane(cloud.points(Eigen::all, near_plane(cloud.points)));
  cloud.corners.resize(3, view.pixels.cols());
  for (Eigen::Index i = 0; i < view.pixels.cols(); ++i) {
    const Eigen::Vector3d ray = data::unproject(camera, view.pixels.col(i), 1);
    cloud.corners.col(i) = ray * (plane.axes.col(2).dot(plane.middle) / plane.axes.col(2).dot(ray));
  }
  cloud.corner_ids = view.points;
  return cloud;
}

CloudCheck check_clouds(Setup setup, const Eigen::Isometry3d& X, const std::vector<TargetCloud>& clouds,
                        const std::vector<Eigen::Isometry3d>& T_base_gripper) {
  CloudCheck result;
  std::vector<Resting> resting;
  std::vector<Plane> planes;
  std::map<int, std::pair<Eigen::Vector3d, int>> corner_sums;
  std::vector<const TargetCloud*> used;
  double before = 0, noise = 0;
  Eigen::Index count = 0;
  for (std::size_t v = 0; v < clouds.size(); ++v) {
    const TargetCloud& cloud = clouds[v];
    if (cloud.points.cols() < kLeastPoints) continue;
    const Eigen::Isometry3d T =
        setup == Setup::eye_in_hand ? T_base_gripper[v] * X : T_base_gripper[v].inverse() * X;
    const std::vector<Eigen::Index> kept = near_plane(cloud.points);
    Resting view;
    view.points = T * cloud.points(Eigen::all, kept);
    view.corners = T * cloud.corners;
    for (const Eigen::Index i : kept) view.colour.push_back(cloud.colour[static_cast<std::size_t>(i)]);
    planes.push_back(fit_plane(view.points));
    before += static_cast<double>(cloud.points.cols());
    count += view.points.cols();
    noise += static_cast<double>(view.points.cols()) * planes.back().rms * planes.back().rms;
    for (std::size_t i = 0; i < cloud.corner_ids.size(); ++i) {
      auto& [sum, number] =
          corner_sums.try_emplace(cloud.corner_ids[i], Eigen::Vector3d::Zero(), 0).first->second;
      sum += view.corners.col(static_cast<Eigen::Index>(i));
      ++number;
    }
    resting.push_back(std::move(view));
    used.push_back(&cloud);
  }
  if (used.size() < 2)
    throw data::InputError("fewer than two views have depth on the target: nothing to lay on each other");

  Eigen::Matrix3Xd all(3, count);
  Eigen::Index at = 0;
  for (const Resting& view : resting) {
    all.middleCols(at, view.points.cols()) = view.points;
    at += view.points.cols();
  }
  const Plane common = fit_plane(all);
  double offsets = 0, shifts = 0, corners = 0;
  for (std::size_t v = 0; v < used.size(); ++v) {
    CloudView view;
    view.image = used[v]->image;
    view.offset_mm = 1e3 * common.distance(planes[v].middle);
    view.tilt_deg =
        std::acos(std::min(1.0, std::abs(common.axes.col(2).dot(planes[v].axes.col(2))))) * 180 / M_PI;
    view.noise_mm = 1e3 * planes[v].rms;
    view.points = static_cast<int>(resting[v].points.cols());
    double squares = 0;
    for (std::size_t i = 0; i < used[v]->corner_ids.size(); ++i) {
      const auto& [sum, number] = corner_sums.at(used[v]->corner_ids[i]);
      const Eigen::Vector3d difference = resting[v].corners.col(static_cast<Eigen::Index>(i)) - sum / number;
      squares += std::pow(shift_along(common, difference), 2);
    }
    view.shift_mm =
        1e3 * std::sqrt(squares / std::max<double>(1, static_cast<double>(used[v]->corner_ids.size())));
    offsets += view.offset_mm * view.offset_mm;
    shifts += squares;
    corners += static_cast<double>(used[v]->corner_ids.size());
    result.views.push_back(view);
  }
  result.thickness_mm = 1e3 * common.rms;
  result.noise_mm = 1e3 * std::sqrt(noise / static_cast<double>(count));
  result.offset_mm = std::sqrt(offsets / static_cast<double>(used.size()));
  result.shift_mm = 1e3 * std::sqrt(shifts / std::max(1.0, corners));
  result.trimmed = 1 - static_cast<double>(count) / before;
  result.pattern = draw_pattern(common, resting);
  result.profile = draw_profile(common, resting, common.rms);
  return result;
}

}  // namespace flash::calib
