#pragma once
#include <optional>
#include <string>

#include "data/camera/camera.h"
#include "data/camera/extrinsics.h"

namespace flash::data {

/// Which lens pictures are read with where a calibration says where their camera is. Its answer holds with
/// the lens of that answer alone: with another one it is millimetres off.
enum class LensChoice {
  agreeing,  ///< the answer's; a lens beside the pictures has to be it, or the one the calibration began with
  solved,    ///< the answer's, whatever stands beside the pictures
  stated     ///< that beside the pictures, whatever the answer is for
};

/// "solved" or "stated"; anything else is a file of one's own, which `own` becomes the path of.
LensChoice parse_lens_choice(const std::string& word, std::string& own);

/// A lens, and the file that it is from.
struct LensOfFile {
  CameraIntrinsics lens;
  std::string path;
};

/// The lens to read pictures with, and what people should know of the choice; empty where nothing.
struct PosedLens {
  CameraIntrinsics lens;
  std::string notice = {};
};

/// The lens for pictures of the camera at `pose`, which was read from `pose_path`. own: what stands beside
/// the pictures, if anything. Throws InputError naming both files and their numbers where they differ and
/// `choice` is none of either, where pictures differ in size, and where there is no lens.
PosedLens posed_lens(const CameraPose& pose, const std::string& pose_path,
                     const std::optional<LensOfFile>& own, LensChoice choice = LensChoice::agreeing);

/// "fx 611.2, fy 611.0, cx 320.4, cy 238.9" [px].
std::string describe_lens(const CameraIntrinsics& lens);

/// The farthest that one direction lies apart in pictures through two lenses, over the first's picture [px].
double pixels_apart(const CameraIntrinsics& a, const CameraIntrinsics& b);

/// Whether no picture tells the lenses apart: by less than a hundredth of a pixel, which no corner is found
/// to. False where their pictures differ in size.
bool same_lens(const CameraIntrinsics& a, const CameraIntrinsics& b);

}  // namespace flash::data
