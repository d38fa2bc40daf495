#include "calib/report/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string_view>

#include "calib/dataset/told_shape.h"
#include "calib/detect/grey_image.h"
#include "calib/geometry/chain.h"
#include "calib/report/extrinsics_export.h"
#include "calib/report/extrinsics_json.h"
#include "calib/report/jpeg.h"
#include "calib/report/json_list.h"
#include "data/motion/trajectory.h"
#include "data/picture/html_page.h"

namespace flash::embedded {
std::string_view calibration_report_template();
}  // namespace flash::embedded

namespace flash::calib {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / M_PI;

Json pose(const Eigen::Isometry3d& T) { return list(data::to_vector(T)); }

/// x y by turns, in thousandths of a pixel: a third of the size of all digits.
Json pixels(const Eigen::Matrix2Xd& places) {
  Json values = Json::array();
  for (Eigen::Index i = 0; i < places.size(); ++i) values.push_back(std::round(1e3 * places.data()[i]) / 1e3);
  return values;
}

/// What was seen in a view, and where the calibration puts it. Views without corners are empty.
struct SeenView {
  Eigen::Matrix2Xd detected;   ///< [px]
  Eigen::Matrix2Xd projected;  ///< through the robot's pose as reported
  Eigen::Matrix2Xd corrected;  ///< through the corrected pose; empty of a view that was not used
  double rms = 0;              ///< of projected, 2-D rms per corner
};

double rms(const Eigen::Matrix2Xd& differences) {
  return differences.cols() == 0
             ? 0
             : std::sqrt(differences.squaredNorm() / static_cast<double>(differences.cols()));
}

/// Empty for a set of pose pairs.
data::CameraIntrinsics camera_of(const Calibration& calibration) {
  const std::vector<data::CameraIntrinsics>& all = calibration.refined.bundle.intrinsics;
  return all.empty() ? data::CameraIntrinsics{} : all.front();
}

/// A view that took no part, through the chain as it was found. Empty where a corner would lie behind.
Eigen::Matrix2Xd projected_by_chain(const Calibration& calibration, const Observation& view,
                                    const Eigen::Matrix3Xd& points) {
  const auto I = Eigen::Isometry3d::Identity();
  const Chain chain(calibration.setup, calibration.poses.X, I, view.T_base_gripper, I, calibration.poses.Z);
  Eigen::Matrix2Xd projected(2, view.pixels.cols());
  for (Eigen::Index k = 0; k < projected.cols(); ++k) {
    const std::optional<Eigen::Vector2d> pixel =
        data::project(camera_of(calibration),
                      chain.target_in_camera() * points.col(view.points[static_cast<std::size_t>(k)]));
    if (!pixel) return {};
    projected.col(k) = *pixel;
  }
  return projected;
}

std::vector<SeenView> seen_views(const Calibration& calibration, const Eigen::Matrix3Xd& points) {
  std::vector<SeenView> seen(calibration.views.size());
  const Bundle& bundle = calibration.refined.bundle;
  for (const BundleView& view : bundle.views) {
    SeenView& entry = seen[static_cast<std::size_t>(calibration.used[static_cast<std::size_t>(view.pose)])];
    if (view.pixels.cols() == 0) continue;
    entry.detected = view.pixels;
    entry.projected = view.pixels - residuals(bundle, view, false);
    entry.corrected = view.pixels - residuals(bundle, view, true);
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Observation& observation = calibration.selection.observations[i];
    if (!calibration.views[i].used && observation.pixels.cols() > 0) {
      seen[i].detected = observation.pixels;
      seen[i].projected = projected_by_chain(calibration, observation, points);
    }
    if (seen[i].projected.cols() > 0) seen[i].rms = rms(seen[i].detected - seen[i].projected);
  }
  return seen;
}

/// Views with a picture, worst first.
std::vector<std::size_t> pictured(const std::vector<SeenView>& seen, const std::vector<std::string>& images,
                                  int at_most) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < std::min(seen.size(), images.size()); ++i)
    if (!images[i].empty() && seen[i].detected.cols() > 0) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return seen[a].rms > seen[b].rms; });
  order.resize(std::min(order.size(), static_cast<std::size_t>(at_most)));
  return order;
}

Json pictures(const std::vector<SeenView>& seen, const ReportInputs& inputs, const ReportSettings& settings) {
  Json all = Json::array();
  for (const std::size_t i : pictured(seen, inputs.images, settings.max_pictures)) {
    const data::Picture picture = corner_picture(load_grey_image(inputs.images[i]), seen[i].detected,
                                                 seen[i].projected, settings.picture);
    all.push_back({{"view", i},
                   {"jpeg", data::base64(encode_jpeg(picture))},
                   {"width", picture.width},
                   {"height", picture.height}});
  }
  return all;
}

Json views(const Calibration& calibration, const std::vector<SeenView>& seen) {
  Json all = Json::array();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const ViewResult& view = calibration.views[i];
    const Vector6d& xi = view.correction;
    all.push_back({{"image", calibration.selection.observations[i].image},
                   {"used", view.used},
                   {"reason", view.reason},
                   {"renumbered", view.used && calibration.selection.views[i].symmetry != 0},
                   {"px", view.px},
                   {"chain_px", seen[i].rms},
                   {"correction_mm", list(Eigen::Vector3d(1e3 * xi.head<3>()))},
                   {"correction_deg", list(Eigen::Vector3d(kDegrees * xi.tail<3>()))},
                   {"gripper", pose(calibration.selection.observations[i].T_base_gripper)},
                   {"detected", pixels(seen[i].detected)},
                   {"projected", pixels(seen[i].projected)},
                   {"corrected", pixels(seen[i].corrected)}});
  }
  return all;
}

/// Four corners of the rectangle around the target, in its frame.
Json outline(const Eigen::Matrix3Xd& points) {
  if (points.cols() == 0) return Json::array();
  const Eigen::Vector3d low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  return {list(low), list(Eigen::Vector3d(high.x(), low.y(), 0)), list(high),
          list(Eigen::Vector3d(low.x(), high.y(), 0))};
}

/// The standard deviations along and about the axes of the parent frame, in which the translation is written.
Json sd_in_parent(const Calibration& calibration) {
  const ToldDeviations sd = told_deviations(calibration, calibration.covariance, Axes::parent),
                       here = told_deviations(calibration, calibration.repeatable, Axes::parent);
  return {{"mm", to_json(sd, false)},
          {"deg", to_json(sd, true)},
          {"repeatable_mm", to_json(here, false)},
          {"repeatable_deg", to_json(here, true)}};
}

std::string sentence(const char* format, double value, double other = 0) {
  char text[240];
  std::snprintf(text, sizeof text, format, value, other);
  return text;
}

/// What would make the answer better, most telling first.
std::vector<std::string> next_steps(const Calibration& c) {
  constexpr double kWideTurn = 10, kSharpCorners = 0.3;  // [deg], [px]
  constexpr std::size_t kEnough = 15;
  std::vector<std::string> steps;
  if (c.size && c.size->far_off()) {
    const double larger = 100 * (c.size->wanted->estimate - 1);
    steps.push_back(sentence(
        larger > 0 ? "Measure the printed target: its estimated size is %.2f %% larger than stated."
                   : "Measure the printed target: its estimated size is %.2f %% smaller than stated.",
        std::abs(larger)));
  }
  if (c.focal_length && c.focal_length->far_off())
    steps.push_back(
        sentence("Calibrate the lens and make the target's poses anew: its estimated focal length is %.4f "
                 "times that which they were made with.",
                 c.focal_length->wanted->estimate));
  const double second = kDegrees * c.diversity.spread.y();
  if (c.along && !c.along->told)
    steps.emplace_back(
        "Measure where the camera or the target is along the axis that the robot turns about, and calibrate "
        "with "
        "--camera-height or --target-height.");
  else if (second < kWideTurn)
    steps.push_back(sentence("Turn the gripper more about a second axis: so far %.1f deg rms.", second));
  if (c.used.size() < kEnough)
    steps.push_back(sentence("Add views: %.0f are in use, 15 or more make noise and uncertainty known.",
                             static_cast<double>(c.used.size())));
  const double corner = c.refined.noise.corner.empty() ? 0 : c.refined.noise.corner.front();
  if (corner > kSharpCorners)
    steps.push_back(sentence(
        "Corners repeat to %.2f px an axis: calibrate the lens anew, light and focus better, or come closer.",
        corner));
  if (c.chain_rms > 2 * c.corner_rms && c.corner_rms > 0)
    steps.push_back(sentence(
        "The robot's poses limit the answer (%.2f px through them, %.2f px without their errors): more views "
        "help, better pictures do not.",
        c.chain_rms, c.corner_rms));
  steps.emplace_back(std::string("Check it on ") + (has_pixels(c) ? "pictures" : "pairs of poses") +
                     " that took no part: flash-calib validate.");
  return steps;
}

}  // namespace

std::string render_report(const Calibration& calibration, const Extrinsics& extrinsics, const Json& json,
                          const ReportInputs& inputs, const ReportSettings& settings) {
  const std::vector<SeenView> seen = seen_views(calibration, inputs.points);
  const data::CameraIntrinsics camera = camera_of(calibration);
  Json page = {{"extrinsics", json}, {"usable", calibration.usable}};
  page["sd_parent"] = sd_in_parent(calibration);
  page["next_steps"] = next_steps(calibration);
  page["warp"] = describe(calibration.warp);
  page["views"] = views(calibration, seen);
  page["pictures"] = pictures(seen, inputs, settings);
  page["magnified"] = settings.picture.magnified;
  page["outline"] = outline(inputs.points);
  page["camera"] = {{"width", camera.width}, {"height", camera.height}, {"fx", camera.fx},
                    {"fy", camera.fy},       {"cx", camera.cx},         {"cy", camera.cy}};
  page["X"] = pose(calibration.poses.X);
  page["Z"] = pose(calibration.poses.Z);
  const bool whole = !calibration.along || calibration.along->told;
  const std::string missing = whole ? "" : untold_sentence(*calibration.along, calibration.setup);
  page["ros"] = whole ? ros_static_transform(extrinsics.transform, extrinsics.lens) : missing;
  page["urdf"] = whole ? urdf_joint(extrinsics.transform, extrinsics.lens) : missing;
  const std::string text = data::inside_script(page.dump(-1, ' ', false, Json::error_handler_t::replace));
  return data::fill_page(embedded::calibration_report_template(), {{"@DATA@", text}});
}

}  // namespace flash::calib
