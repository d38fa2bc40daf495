#include "calib/detect/intrinsics.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/dataset/same_picture.h"
#include "calib/dataset/target_shape.h"
#include "calib/detect/lens_fit.h"
#include "calib/geometry/pose.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr int kLeastViews = 3;

struct Solution {
  data::CameraIntrinsics camera;
  std::vector<Eigen::Isometry3d> poses;
  std::vector<double> rms;  ///< of each view
};

/// Places of the model's unknowns in an IntrinsicsVector: fx fy cx cy, then the coefficients in use.
std::vector<int> unknowns(data::DistortionModel model) {
  const int coefficients = model == data::DistortionModel::none        ? 0
                           : model == data::DistortionModel::plumb_bob ? 5
                                                                       : 8;
  std::vector<int> list;
  for (int i = 0; i < 4 + coefficients; ++i) list.push_back(i);
  return list;
}

Solution solve(const Eigen::Matrix3Xd& points, const std::vector<const Observation*>& views, int width,
               int height, data::DistortionModel model) {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> seen;
  for (const Observation* view : views) {
    board.emplace_back();
    seen.emplace_back();
    for (std::size_t i = 0; i < view->points.size(); ++i) {
      const Eigen::Vector3f p = points.col(view->points[i]).cast<float>();
      const Eigen::Vector2f q = view->pixels.col(static_cast<Eigen::Index>(i)).cast<float>();
      board.back().emplace_back(p.x(), p.y(), p.z());
      seen.back().emplace_back(q.x(), q.y());
    }
  }
  int flags = 0;
  if (model == data::DistortionModel::rational_polynomial) flags = cv::CALIB_RATIONAL_MODEL;
  if (model == data::DistortionModel::none)
    flags = cv::CALIB_FIX_K1 | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST;
  cv::Mat matrix = cv::Mat::eye(3, 3, CV_64F), distortion = cv::Mat::zeros(1, 8, CV_64F);
  std::vector<cv::Mat> rotations, translations;
  cv::calibrateCamera(board, seen, {width, height}, matrix, distortion, rotations, translations, flags,
                      {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 1e-12});
  Solution solution;
  data::CameraIntrinsics& camera = solution.camera;
  camera.width = width;
  camera.height = height;
  camera.fx = matrix.at<double>(0, 0);
  camera.fy = matrix.at<double>(1, 1);
  camera.cx = matrix.at<double>(0, 2);
  camera.cy = matrix.at<double>(1, 2);
  camera.model = model;
  for (std::size_t i = 4; i < unknowns(model).size(); ++i)
    camera.distortion.push_back(distortion.at<double>(static_cast<int>(i) - 4));
  const IntrinsicsVector intrinsics = to_vector(camera);
  for (std::size_t v = 0; v < views.size(); ++v) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = rotation_exp(Eigen::Map<const Eigen::Vector3d>(rotations[v].ptr<double>()));
    pose.translation() = Eigen::Map<const Eigen::Vector3d>(translations[v].ptr<double>());
    double squares = 0;
    for (std::size_t i = 0; i < views[v]->points.size(); ++i)
      squares += (project(intrinsics, pose * points.col(views[v]->points[i])) -
                  views[v]->pixels.col(static_cast<Eigen::Index>(i)))
                     .squaredNorm();
    solution.poses.push_back(pose);
    solution.rms.push_back(std::sqrt(squares / static_cast<double>(views[v]->points.size())));
  }
  return solution;
}

/// The same with a target that need not be flat.
LensFit refined(const Solution& solution, const Eigen::Matrix3Xd& points,
                const std::vector<const Observation*>& views) {
  return fit_lens({.lens = to_vector(solution.camera), .poses = solution.poses, .covariance = {}},
                  unknowns(solution.camera.model), points, views);
}

/// Of the projection of the rays that now meet the corners of the picture; the worst, most_corner_sd at most
/// [px].
double corner_deviation(const data::CameraIntrinsics& camera, const Eigen::MatrixXd& covariance) {
  const std::vector<int> used = unknowns(camera.model);
  double worst = 0;
  for (const double x : {0.0, camera.width - 1.0})
    for (const double y : {0.0, camera.height - 1.0}) {
      Eigen::Matrix<double, 2, kIntrinsics> by_all;
      const Eigen::Vector3d ray = data::unproject(camera, {x, y}, 1);
      const Eigen::Vector2d met = project(to_vector(camera), ray, nullptr, &by_all);
      // Coefficients that the corners do not hold may fold the picture before its edge: no ray meets it
      // there.
      if (!((met - Eigen::Vector2d(x, y)).norm() < 1)) return most_corner_sd;
      const Eigen::MatrixXd by_used = by_all(Eigen::all, used);
      worst = std::max(worst, std::sqrt((by_used * covariance * by_used.transpose()).trace()));
    }
  return std::min(worst, most_corner_sd);
}

double coverage(const std::vector<const Observation*>& views, int width, int height) {
  std::vector<cv::Point2f> all, outline;
  for (const Observation* view : views)
    for (Eigen::Index i = 0; i < view->pixels.cols(); ++i)
      all.emplace_back(static_cast<float>(view->pixels(0, i)), static_cast<float>(view->pixels(1, i)));
  cv::convexHull(all, outline);
  return cv::contourArea(outline) / (static_cast<double>(width) * height);
}

std::vector<std::string> warnings_of(const IntrinsicsEstimate& estimate, std::size_t views) {
  std::vector<std::string> warnings;
  const auto percent = [](double share) { return data::format_short(100 * share) + " %"; };
  const data::CameraIntrinsics& camera = estimate.camera;
  if (estimate.tilt < 0.35)
    warnings.push_back(
        "the target is never tilted by more than " + data::format_short(estimate.tilt * 180 / M_PI) +
        " deg between views: focal length and distance cannot be told apart; add views tilted by 30 deg");
  if (const double share = std::max(estimate.sd[0] / camera.fx, estimate.sd[1] / camera.fy);
      share > most_focal_sd)
    warnings.push_back("the focal length is known to " + percent(share) +
                       " only, which is no answer: add views that are closer and tilted");
  else if (estimate.sd[0] > 0.005 * camera.fx)
    warnings.push_back("the focal length is known to " + percent(estimate.sd[0] / camera.fx) +
                       " only: add views that are closer and tilted");
  if (estimate.corner_sd > 1)
    warnings.push_back(
        "places at the corners of the picture are uncertain by " + data::format_short(estimate.corner_sd) +
        (estimate.corner_sd < most_corner_sd ? " px" : " px or more") + ": let the target reach there");
  if (estimate.coverage < 0.5)
    warnings.push_back("corners cover " + percent(estimate.coverage) +
                       " of the picture: distortion beyond is a guess");
  if (estimate.warp.far_off()) warnings.push_back(warp_sentence(estimate.warp));
  if (estimate.edges && estimate.edges->far_off()) warnings.push_back(edge_sentence(*estimate.edges));
  constexpr double kDisagree = 4;  // a factor of 2 of the deviations
  if (estimate.view_factor > kDisagree)
    warnings.push_back(
        "views disagree by more than their corners scatter, as where a print bends, light differs or "
        "the lens is of another model: the stated deviations were raised by a factor of " +
        data::format_short(std::sqrt(estimate.view_factor)));
  if (views < 8) warnings.push_back("only " + std::to_string(views) + " views; 15 or more are usual");
  return warnings;
}

}  // namespace

IntrinsicsEstimate calibrate_intrinsics(const Target& target, const std::vector<Observation>& observations,
                                        int width, int height, const IntrinsicsSettings& settings) {
  const Eigen::Matrix3Xd points = target_points(target);
  std::vector<const Observation*> views;
  IntrinsicsEstimate estimate;
  std::vector<std::size_t> place;  // of each used view in estimate.views
  for (const Observation& observation : observations) {
    estimate.views.push_back({observation.image, 0, ""});
    // Four points fix the pose and leave nothing for the camera; fewer than six hardly more.
    if (observation.points.size() < 6 && target.kind != TargetKind::aruco &&
        target.kind != TargetKind::apriltag) {
      estimate.views.back().reason = "shows only " + std::to_string(observation.points.size()) + " points";
      continue;
    }
    const auto copied = std::find_if(views.begin(), views.end(), [&](const Observation* view) {
      return of_same_picture(*view, observation);
    });
    if (copied != views.end()) {
      estimate.views.back().reason = "a copy of " + (*copied)->image;
      continue;
    }
    place.push_back(estimate.views.size() - 1);
    views.push_back(&observation);
  }
  const auto expect_views = [&] {
    if (static_cast<int>(views.size()) < kLeastViews)
      throw data::InputError("intrinsics need three views of the target, found " +
                             std::to_string(views.size()));
  };
  expect_views();
  Solution solution = solve(points, views, width, height, settings.model);
  for (int round = 0; round < 3; ++round) {
    const double limit = std::max(1.0, settings.largest_ratio * data::median(solution.rms));
    std::vector<const Observation*> kept;
    std::vector<std::size_t> kept_place;
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (solution.rms[v] > limit) {
        estimate.views[place[v]].reason = "fits to " + data::format_short(solution.rms[v]) +
                                          " px, the usual view to " +
                                          data::format_short(data::median(solution.rms)) + " px";
        continue;
      }
      kept.push_back(views[v]);
      kept_place.push_back(place[v]);
    }
    if (kept.size() == views.size()) break;
    views = std::move(kept);
    place = std::move(kept_place);
    expect_views();
    solution = solve(points, views, width, height, settings.model);
  }

  const LensFit fit = refined(solution, points, views);
  estimate.camera = with_vector(solution.camera, fit.lens);
  double squares = 0, corners = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const double count = static_cast<double>(views[v]->points.size());
    const double own = residuals(fit, v, points, *views[v]).squaredNorm();
    estimate.views[place[v]].rms = std::sqrt(own / count);
    squares += own;
    corners += count;
    for (std::size_t w = 0; w < v; ++w)
      estimate.tilt = std::max(
          estimate.tilt,
          std::acos(std::clamp(fit.poses[v].linear().col(2).dot(fit.poses[w].linear().col(2)), -1.0, 1.0)));
  }
  estimate.rms = std::sqrt(squares / corners);
  estimate.view_factor = fit.view_factor;
  const std::vector<int> used = unknowns(settings.model);
  const auto count = static_cast<Eigen::Index>(used.size());
  const Eigen::MatrixXd variances = fit.covariance.topLeftCorner(count, count);
  estimate.warp = {.estimate = fit.warp,
                   .sd = fit.covariance.diagonal().segment<kWarp>(count).cwiseSqrt(),
                   .prior_sd = usual_warp_sd(points)};
  if (views.front()->outward.cols() > 0)
    estimate.edges =
        EdgeOffset{.estimate = fit.edge_offset, .sd = std::sqrt(fit.covariance.diagonal()[count + kWarp])};
  estimate.covariance(used, used) = variances;
  for (std::size_t i = 0; i < used.size(); ++i)
    estimate.sd[used[i]] =
        std::sqrt(std::max(0.0, variances(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i))));
  estimate.corner_sd = corner_deviation(estimate.camera, variances);
  estimate.coverage = coverage(views, width, height);
  estimate.warnings = warnings_of(estimate, views.size());
  return estimate;
}

}  // namespace flash::calib
