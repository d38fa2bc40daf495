#include "data/camera/depth_map.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/camera/intrinsics_file.h"
#include "data/files/error.h"
#include "data/files/npz.h"
#include "data/files/text.h"
#include "data/files/tiff_reader.h"
#include "data/numbers/median.h"

namespace flash::data {
namespace {

constexpr double kFarthest = 100;  // no depth camera of a cell sees farther [m]

std::vector<double> above_zero(const std::vector<double>& values) {
  std::vector<double> seen;
  for (const double value : values)
    if (value > 0) seen.push_back(value);
  return seen;
}

/// Real numbers as metres.
DepthMap metres(int width, int height, std::vector<double> values, const std::string& path) {
  for (double& value : values)
    if (!(value > 0) || !std::isfinite(value)) value = 0;
  const std::vector<double> seen = above_zero(values);
  if (!seen.empty() && median(seen) > kFarthest)
    throw InputError(path + ": found depths of " + format_short(median(seen)) +
                     " as real numbers, expected metres: are these millimetres?");
  return {width, height, std::move(values)};
}

DepthMap counted(int width, int height, std::vector<double> counts, double scale) {
  for (double& value : counts) value = value > 0 ? scale * value : 0;
  return {width, height, std::move(counts)};
}

DepthMap counted(int width, int height, std::vector<double> counts, double scale, const std::string& path) {
  const std::vector<double> seen = above_zero(counts);
  if (!seen.empty() && scale * median(seen) > kFarthest)
    throw InputError(
        path + ": found depths of " + format_short(scale * median(seen)) + " m at " + format_short(scale) +
        " m a count, expected a depth scale of 0.001 where counts are millimetres, which makes " +
        format_short(0.001 * median(seen)) + " m of them");
  return counted(width, height, std::move(counts), scale);
}

DepthMap load_numpy(const std::string& path, double scale) {
  NumpyArray array = load_npy(path);
  if (array.shape.size() != 2 || std::max(array.shape[0], array.shape[1]) > 100'000)
    throw InputError(path + ": found " + std::to_string(array.shape.size()) +
                     " dimensions, expected two, height and width");
  const int height = static_cast<int>(array.shape[0]), width = static_cast<int>(array.shape[1]);
  return array.whole ? counted(width, height, std::move(array.values), scale, path)
                     : metres(width, height, std::move(array.values), path);
}

DepthMap load_tiff(const std::string& path, double scale) {
  GreyTiff tiff = read_tiff(path);
  return tiff.whole ? counted(tiff.width, tiff.height, std::move(tiff.values), scale, path)
                    : metres(tiff.width, tiff.height, std::move(tiff.values), path);
}

}  // namespace

const std::vector<std::string>& depth_endings() {
  static const std::vector<std::string> endings = {".png", ".npy", ".tif", ".tiff"};
  return endings;
}

DepthMap load_depth(const std::string& path, double scale) {
  const std::string extension = lower_extension(path);
  if (extension == ".npy") return load_numpy(path, scale);
  if (extension == ".tif" || extension == ".tiff") return load_tiff(path, scale);
  const DepthImage counts = load_depth_image(path);
  return counted(counts.width, counts.height, {counts.pixels.begin(), counts.pixels.end()}, scale, path);
}

CameraIntrinsics load_depth_lens(const std::string& path, const std::string& depth) {
  CameraIntrinsics lens = load_intrinsics(path);
  if (lens.width > 0 && lens.height > 0) return lens;
  const DepthMap picture = load_depth(depth, 0.0);  // of which the size alone is asked
  lens.width = picture.width;
  lens.height = picture.height;
  return lens;
}

std::string mask_of(const std::string& masks, const std::string& depth) {
  std::filesystem::path name = std::filesystem::path(depth).filename();
  if (lower_extension(depth) != ".png") name.replace_extension(".png");
  return (std::filesystem::path(masks) / name).string();
}

DepthMap in_metres(const DepthImage& counts, double scale) {
  return counted(counts.width, counts.height, {counts.pixels.begin(), counts.pixels.end()}, scale);
}

Points points_from_depth(const DepthMap& depth, const MaskImage& mask, const CameraIntrinsics& camera,
                         const std::string& source) {
  const auto size = [](int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
  };
  if (depth.width != camera.width || depth.height != camera.height)
    throw InputError(source + ": found " + size(depth.width, depth.height) +
                     " pixels, expected the camera's " + size(camera.width, camera.height));
  if (!mask.pixels.empty() && (mask.width != depth.width || mask.height != depth.height))
    throw InputError(source + ": its mask has " + size(mask.width, mask.height) + " pixels, expected " +
                     size(depth.width, depth.height));
  constexpr double farthest = 1e5;  // nothing that a depth camera sees [m]
  std::size_t lost = 0;
  std::vector<double> coordinates;
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      if (!(depth.at(x, y) > 0) || (!mask.pixels.empty() && mask.at(x, y) == 0)) continue;
      const Eigen::Vector3d point = unproject(camera, {x, y}, depth.at(x, y));
      if (point.cwiseAbs().maxCoeff() < farthest)
        coordinates.insert(coordinates.end(), point.data(), point.data() + 3);
      else
        ++lost;
    }
  const std::size_t measured = lost + coordinates.size() / 3;
  if (100 * lost > measured)
    throw InputError(source + ": " + format_count(lost) + " of " + format_count(measured) +
                     " pixels become points more than 100 km away, or none: check the camera's matrix and "
                     "distortion, and the depth scale");
  return Eigen::Map<Points>(coordinates.data(), static_cast<Eigen::Index>(coordinates.size() / 3), 3);
}

}  // namespace flash::data
