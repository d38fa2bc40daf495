#pragma once
#include <string>
#include <vector>

#include "calib/dataset/observation.h"

namespace flash::calib {

/// A view as one refiner places its corners: "image_model" (ours), or a library's own: "corner_sub_pix",
/// "sectors", "apriltag", "blobs".
struct CornerReading {
  std::string refiner;
  Observation observation;
};

struct Detection {
  std::string image;                    ///< file name
  std::string reason;                   ///< why the view cannot be used; empty where it can
  std::vector<CornerReading> readings;  ///< least pose_rms first; empty where it cannot
};

struct RefinerScore {
  std::string refiner;
  double rms = 0;  ///< reprojection over the views that every refiner has read, 2-D rms per point [px]
  int views = 0;   ///< that this one has read
};

/// Refiners of a set, least rms first. Those within 5 % of the first are as good by their corners: let the
/// hand-eye residual decide.
std::vector<RefinerScore> rank_refiners(const std::vector<Detection>& detections);

/// The set as one refiner reads it; a view it has not read as the next best one does.
std::vector<Observation> observations_of(const std::vector<Detection>& detections,
                                         const std::string& refiner);

}  // namespace flash::calib
