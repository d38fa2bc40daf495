#include "data/camera/posed_lens.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

bool same_size(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.width == b.width && a.height == b.height;
}

std::string size_of(const CameraIntrinsics& lens) {
  return std::to_string(lens.width) + " x " + std::to_string(lens.height) + " pixels";
}

std::string fixed_pixels(double pixels) {
  char text[40];
  std::snprintf(text, sizeof text, "%.2f px", pixels);
  return text;
}

}  // namespace

LensChoice parse_lens_choice(const std::string& word, std::string& own) {
  if (word.empty()) return LensChoice::agreeing;
  if (word == "solved") return LensChoice::solved;
  if (word != "stated") own = word;
  return LensChoice::stated;
}

std::string describe_lens(const CameraIntrinsics& lens) {
  char text[160];
  std::snprintf(text, sizeof text, "fx %.2f, fy %.2f, cx %.2f, cy %.2f", lens.fx, lens.fy, lens.cx, lens.cy);
  return text;
}

double pixels_apart(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  constexpr int kSteps = 16;
  double farthest = 0;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d pixel(a.width * double(i) / kSteps - 0.5, a.height * double(j) / kSteps - 0.5);
      const std::optional<Eigen::Vector2d> seen = project(b, unproject(a, pixel, 1));
      const double apart = seen ? (*seen - pixel).norm() : std::numeric_limits<double>::infinity();
      if (!(apart <= farthest))
        farthest = std::isnan(apart) ? std::numeric_limits<double>::infinity() : apart;
    }
  return farthest;
}

bool same_lens(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  constexpr double kTold = 0.01;  // [px]
  return same_size(a, b) && pixels_apart(a, b) < kTold;
}

PosedLens posed_lens(const CameraPose& pose, const std::string& pose_path,
                     const std::optional<LensOfFile>& own, LensChoice choice) {
  if (choice == LensChoice::solved && !pose.lens)
    throw InputError("--lens: found solved, but " + pose_path + " has no lens, expected stated or a file");
  if (!own) {
    if (pose.lens) return {*pose.lens};
    throw InputError(pose_path + ": has no lens, expected one beside the pictures, as camera_info.yaml");
  }
  if (!pose.lens || same_lens(own->lens, *pose.lens)) return {own->lens};
  const std::string mine = own->path + ": found " + describe_lens(own->lens);
  const std::string holds = pose_path + " holds with " + describe_lens(*pose.lens);
  if (choice != LensChoice::stated && !same_size(own->lens, *pose.lens))
    throw InputError(own->path + ": found " + size_of(own->lens) + ", expected " + size_of(*pose.lens) +
                     ", as " + pose_path + " was calibrated with");
  if (choice == LensChoice::solved) return {*pose.lens};
  const std::string apart = "up to " + fixed_pixels(pixels_apart(*pose.lens, own->lens)) + " from it";
  if (choice == LensChoice::stated)
    return {own->lens,
            mine + "; it was taken, although " + holds + ", " + apart + ": places are off by as much"};
  if (pose.stated && same_lens(own->lens, *pose.stated))
    return {*pose.lens,
            mine + ", with which the calibration began; " + holds + ", " + apart + ", which was taken"};
  throw InputError(mine + ", but " + holds + ", " + apart +
                   ": expected one lens; --lens solved takes that of " + pose_path +
                   ", --lens stated the other");
}

}  // namespace flash::data
