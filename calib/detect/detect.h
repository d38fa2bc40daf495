#pragma once
#include <functional>
#include <string>
#include <vector>

#include "calib/dataset/dataset.h"
#include "calib/dataset/observation.h"
#include "calib/dataset/target.h"

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

struct DetectSettings {
  int threads = 0;           ///< 0: as many as there are processors
  std::string cache;         ///< folder that keeps what was found, by content; empty: none
  double largest_rms = 10;   ///< a view whose pose fits no better shows no target [px]
  double largest_ratio = 6;  ///< nor one worse than that many times the usual view of the set, above 2 px
};

/// Looks for the target in every picture of a set; a detection for each frame, in their order. Without
/// intrinsics observations carry no poses. `progress` is called after each picture (done, of how many), one
/// at a time. Throws InputError where no picture shows the target, with the reason of the first.
std::vector<Detection> detect(const Dataset& dataset, const Target& target,
                              const DetectSettings& settings = {},
                              const std::function<void(int, int)>& progress = {});

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
