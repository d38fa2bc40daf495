#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/extrinsics.h"
#include "calib/report/overlay.h"

namespace flash::calib {

struct ReportSettings {
  CornerPictureSettings picture{.width = 440};
  int max_pictures = 24;  ///< photographs shown, those that fit worst first
};

/// What a calibration was made from, as far as the report shows it.
struct ReportInputs {
  Eigen::Matrix3Xd points;          ///< of the target, in its frame [m]
  std::vector<std::string> images;  ///< path of each view's picture; empty where there is none
};

/// One HTML file that opens offline: warnings, the transform, how sure it
/// is, held-out residuals, what is weak and what to do next; detected over projected corners, residuals of
/// every view, the poses in space, the comparison of methods, the views with the reasons of those left out.
/// extrinsics: with the names of its frames; json: the file that stands beside the report.
std::string render_report(const Calibration& calibration, const Extrinsics& extrinsics,
                          const nlohmann::ordered_json& json, const ReportInputs& inputs,
                          const ReportSettings& settings = {});

}  // namespace flash::calib
