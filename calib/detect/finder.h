#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calib/dataset/target.h"
#include "calib/detect/grey_image.h"
#include "calib/detect/rectifier.h"

namespace flash::calib {

/// Points of the target as one refiner places them.
struct Sighting {
  std::string refiner;
  std::vector<int> points;              ///< columns of target_points
  std::vector<Eigen::Vector2d> pixels;  ///< distorted; pixel centres are whole numbers
};

/// What a picture shows of the target: a sighting for each refiner, or why there is none.
struct Found {
  std::vector<Sighting> sightings;
  std::string reason;
  bool is_open = false;  ///< nothing was found, but a thorough search might
};

/// Looks for one target in pictures of one camera; not to be shared between threads. The rectifier must
/// outlive it.
using Finder = std::function<Found(const GreyImage&)>;

/// Name of the refiner that fits the brightness of shapes to the pixels (calib/corner_shapes.h). The others
/// are those of the libraries: corner_sub_pix and sectors (OpenCV), apriltag, blobs.
inline const char* const kImageModel = "image_model";

/// How long a chessboard is looked for.
enum class Search {
  glance,   ///< by sectors, in a small picture
  nearby,   ///< by sectors; and by other ways where these see it
  thorough  ///< by other ways in the whole picture as well: seconds where it shows none
};

/// The search is that of chessboards; other targets are looked for in one way.
Finder make_finder(const Target& target, const Rectifier& rectifier, Search search = Search::thorough);

/// The kinds behind make_finder.
Finder chessboard_finder(const Target& target, const Rectifier& rectifier, Search search = Search::thorough);
Finder aruco_finder(const Target& target, const Rectifier& rectifier);  ///< aruco and aruco_grid
Finder charuco_finder(const Target& target, const Rectifier& rectifier);
Finder apriltag_finder(const Target& target, const Rectifier& rectifier);  ///< apriltag and aprilgrid
/// The stated target with the counts, dictionary or ids of the markers that a picture shows; empty where it
/// shows none, or those stated.
std::optional<Target> shown_markers(const GreyImage& image, const Target& stated, const Rectifier& rectifier);
std::optional<Target> shown_tags(const GreyImage& image, const Target& stated, const Rectifier& rectifier);
Finder circle_finder(const Target& target, const Rectifier& rectifier);

}  // namespace flash::calib
