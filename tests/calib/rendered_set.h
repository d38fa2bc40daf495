#pragma once
#include <string>

#include "calib/dataset/observation.h"
#include "calib/geometry/closed_form.h"

namespace flash::calib {

/// How the gripper goes from view to view.
enum class RobotMotion {
  random,    ///< anywhere from where the target is seen
  pan_tilt,  ///< two axes and no other motion, as a camera on a robot's neck
  one_axis,  ///< turns about one axis, and translations
  stream     ///< never at rest: poses over time at 100 Hz, pictures named by their time
};

struct RenderedSetSettings {
  Setup setup = Setup::eye_in_hand;
  std::string target = "chessboard:9x6:0.025";
  int views = 20;
  int width = 1280, height = 720;      ///< [px]
  double robot_deg = 0, robot_mm = 0;  ///< noise of the reported poses per axis
  unsigned seed = 1;
  RobotMotion motion = RobotMotion::random;
  double least_distance = 0, most_distance = 0;  ///< of the target [m]; 0: by its size
  double pixel_noise = 2;                        ///< of 255
  int jpeg_quality = 0;                          ///< 1 to 100: pictures are grey JPEG of that quality; 0: PNG
  double depth_mm = -1;     ///< noise of a depth pixel; negative: no depth pictures. Counts are millimetres
  double depth_factor = 1;  ///< what depth says over what is true
  double exposure =
      0;  ///< during which a moving arm blurs a picture, its middle at the time of the picture [s]
  double time_offset = 0;  ///< pictures are taken that much later than their names say [s]; of a stream
};

/// Draws the pictures and writes what flash-calib reads: images, depth, poses.tum, camera_info.yaml,
/// target.json; and truth/X_and_Z.tum. Returns the truth.
HandEyePoses write_rendered_set(const RenderedSetSettings& settings, const std::string& folder);

/// "random", "pan-tilt", "one-axis" or "stream". Throws data::InputError.
RobotMotion parse_motion(const std::string& text);

}  // namespace flash::calib
