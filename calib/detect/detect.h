#pragma once
#include <functional>
#include <string>
#include <vector>

#include "calib/dataset/dataset.h"
#include "calib/dataset/detection.h"
#include "calib/dataset/posed_detection.h"
#include "calib/dataset/target.h"

namespace flash::calib {

struct DetectSettings {
  int threads = 0;    ///< 0: as many as there are processors
  std::string cache;  ///< folder that keeps what was found, by content; empty: none
  std::function<void(const std::string&)> tell = {};  ///< of the cache: a full disk, once; edited files
  FitSettings fit = {};
};

/// Looks for the target in every picture of a set; a detection for each frame, in their order. Without
/// intrinsics observations carry no poses. `progress` is called after each picture (done, of how many), one
/// at a time. Throws InputError where no picture shows the target, with the reason of the first.
std::vector<Detection> detect(const Dataset& dataset, const Target& target,
                              const DetectSettings& settings = {},
                              const std::function<void(int, int)>& progress = {});

/// The same for one picture, whatever the others show; `dataset` without regard to its frames. What is wrong
/// with the picture is the reason.
Detection detect_one(const Frame& frame, const Dataset& dataset, const Target& target,
                     const DetectSettings& settings = {});

/// Where the intrinsics say nothing of the size of the pictures, that of the first one that can be read; said
/// among the guesses.
void take_picture_size(Dataset& dataset);

}  // namespace flash::calib
