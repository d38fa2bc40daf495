#include "calib/detect/read_depth.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/detect/board_depth.h"
#include "data/files/error.h"

namespace flash::calib {
namespace {

/// Of an even number the middle of two: the ratio is printed to be typed as --depth-scale (data::median takes
/// one).
double median_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

template <class... Values>
std::string formatted(const char* format, const Values&... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace

std::optional<DepthViews> read_depth(const Dataset& dataset, const std::vector<Detection>& detections) {
  const bool none = std::all_of(dataset.frames.begin(), dataset.frames.end(),
                                [](const Frame& frame) { return frame.depth.empty(); });
  if (none) return std::nullopt;
  DepthViews views;
  views.points.resize(dataset.frames.size());
  DepthUse& use = views.use;
  use.scale = dataset.depth_scale;
  std::vector<double> ratios;
  double squares = 0, pixels = 0;
  for (std::size_t i = 0; i < dataset.frames.size(); ++i) {
    const Frame& frame = dataset.frames[i];
    if (frame.depth.empty() || detections[i].readings.empty()) continue;
    const Observation& view = detections[i].readings.front().observation;
    data::DepthMap picture;
    try {
      picture = data::load_depth(frame.depth, dataset.depth_scale);
    } catch (const data::InputError& error) {
      use.unreadable.emplace_back(error.what());
      continue;
    }
    const BoardDepth depth = board_depth(picture, *dataset.camera, view);
    if (depth.points.cols() == 0) continue;
    views.points[i] = depth.points;
    ratios.push_back(depth_over_pose(depth.points, view.T_camera_target.front()));
    squares += depth.pixels * depth.noise * depth.noise;
    pixels += depth.pixels;
    ++use.views;
  }
  if (use.views == 0) {
    use.reason = "no depth picture has depth on the target";
    return views;
  }
  use.used = true;
  use.pixel_noise = std::sqrt(squares / pixels);
  use.over_corners = median_of(ratios);
  if (std::abs(use.over_corners - 1) > 0.1)
    throw data::InputError(formatted(
        "%s: depth puts the target at %.4g times the distance that its corners say: expected --depth-scale "
        "%.3g instead of %.3g, or another size of the target (--no-depth leaves depth out)",
        dataset.source.c_str(), use.over_corners, dataset.depth_scale / use.over_corners,
        dataset.depth_scale));
  return views;
}

}  // namespace flash::calib
