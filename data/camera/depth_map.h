#pragma once
#include <string>
#include <vector>

#include "data/camera/depth_image.h"

namespace flash::data {

/// Depth along the optical axis [m]; 0: nothing measured.
using DepthMap = Image<double>;

/// The endings of files that load_depth reads.
const std::vector<std::string>& depth_endings();

/// 16-bit grey PNG; .npy of two dimensions; TIFF of one channel (.tif, .tiff). Whole numbers are counts of
/// `scale` metres; real numbers are metres, and nothing was measured where they are not finite or not above
/// 0. Throws InputError naming the file where it is anything else, and where depths are beyond what any depth
/// camera sees: of real numbers, which are millimetres, and of counts, whose scale is another.
DepthMap load_depth(const std::string& path, double scale);

/// load_intrinsics, with the size of a picture of depth where the file says none.
CameraIntrinsics load_depth_lens(const std::string& path, const std::string& depth);

/// The mask of a picture of depth in a folder of masks: of its name, as .png.
std::string mask_of(const std::string& masks, const std::string& depth);

DepthMap in_metres(const DepthImage& counts, double scale);

/// Points in the camera frame [m] of the pixels with depth and, where the mask is not empty, inside it.
/// Pixels that the lens puts nowhere, or more than 100 km away, are left out. Throws InputError naming
/// `source` where these are more than 1 %, or where sizes differ.
Points points_from_depth(const DepthMap& depth, const MaskImage& mask, const CameraIntrinsics& camera,
                         const std::string& source);

}  // namespace flash::data
