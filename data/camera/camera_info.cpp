#include "data/camera/camera_info.h"

#include <vector>

#include "data/files/text.h"

namespace flash::data {

std::string camera_info_text(const CameraIntrinsics& camera, const std::string& name) {
  const auto list = [](const std::vector<double>& values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : ", ") + format_number(value);
    return "[" + text + "]";
  };
  std::vector<double> distortion = camera.distortion;
  const bool rational = camera.model == DistortionModel::rational_polynomial;
  distortion.resize(rational ? 8 : 5, 0.0);
  const auto matrix = [&](const char* key, int rows, int columns, const std::vector<double>& values) {
    return std::string(key) + ":\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(columns) +
           "\n  data: " + list(values) + '\n';
  };
  std::string text = "image_width: " + std::to_string(camera.width) +
                     "\nimage_height: " + std::to_string(camera.height) + "\ncamera_name: " + name + '\n';
  text += matrix("camera_matrix", 3, 3, {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1});
  text += std::string("distortion_model: ") + (rational ? "rational_polynomial" : "plumb_bob") + '\n';
  text += matrix("distortion_coefficients", 1, static_cast<int>(distortion.size()), distortion);
  text += matrix("rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  text +=
      matrix("projection_matrix", 3, 4, {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0});
  return text;
}

}  // namespace flash::data
