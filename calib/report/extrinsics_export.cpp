#include "calib/report/extrinsics_export.h"

#include <cctype>
#include <cstdio>

#include "calib/geometry/pose.h"
#include "data/motion/trajectory.h"

namespace flash::calib {
namespace {

template <class... Values>
std::string formatted(const char* format, const Values&... values) {
  std::string text(static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...)), '\0');
  std::snprintf(text.data(), text.size() + 1, format, values...);
  return text;
}

/// The line of a comment between two marks; empty without a lens.
std::string remark(const char* begin, const Lens& lens, const char* end = "") {
  return lens ? std::string(begin) + data::lens_remark(*lens) + end + '\n' : std::string();
}

/// Of a camera that looks along -z with y up, as those of renderers do, in place of one that looks along z
/// with y down.
Eigen::Isometry3d looking_backwards(const Eigen::Isometry3d& T) {
  return T * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX());
}

/// Of the principal point from the middle of the picture, right and down [px].
Eigen::Vector2d off_centre(const data::CameraIntrinsics& lens) {
  return {lens.cx - 0.5 * (lens.width - 1), lens.cy - 0.5 * (lens.height - 1)};
}

/// A name as prims of USD may have it.
std::string prim_name(const std::string& frame) {
  std::string name = frame;
  for (char& letter : name)
    if (!std::isalnum(static_cast<unsigned char>(letter))) letter = '_';
  return name.empty() || std::isdigit(static_cast<unsigned char>(name.front())) ? "_" + name : name;
}

}  // namespace

std::string ros_static_transform(const data::NamedTransform& transform, const Lens& lens) {
  const Eigen::Matrix<double, 7, 1> v = data::to_vector(transform.T);
  return remark("# ", lens) + formatted(
                                  "ros2 run tf2_ros static_transform_publisher --x %.9g --y %.9g --z %.9g "
                                  "--qx %.9g --qy %.9g --qz %.9g "
                                  "--qw "
                                  "%.9g --frame-id %s --child-frame-id %s\n",
                                  v[0], v[1], v[2], v[3], v[4], v[5], v[6], transform.parent.c_str(),
                                  transform.child.c_str());
}

std::string urdf_joint(const data::NamedTransform& transform, const Lens& lens) {
  const Eigen::Vector3d t = transform.T.translation(), rpy = roll_pitch_yaw(transform.T.linear());
  return remark("<!-- ", lens, " -->") +
         formatted(
             "<joint name=\"%s_to_%s\" type=\"fixed\">\n  <parent link=\"%s\"/>\n  <child link=\"%s\"/>\n"
             "  <origin xyz=\"%.9g %.9g %.9g\" rpy=\"%.9g %.9g %.9g\"/>\n</joint>\n",
             transform.parent.c_str(), transform.child.c_str(), transform.parent.c_str(),
             transform.child.c_str(), t.x(), t.y(), t.z(), rpy.x(), rpy.y(), rpy.z());
}

std::string easy_handeye2(const data::NamedTransform& transform, Setup setup, const Lens& lens,
                          const std::string& other) {
  const Eigen::Matrix<double, 7, 1> v = data::to_vector(transform.T);
  const bool in_hand = setup == Setup::eye_in_hand;
  const std::string other_frame = !other.empty() ? other : in_hand ? "base" : "gripper";
  return remark("# ", lens) +
         formatted(
             "parameters:\n  name: flash_calib\n  calibration_type: %s\n  robot_base_frame: %s\n"
             "  robot_effector_frame: %s\n  tracking_base_frame: %s\n  tracking_marker_frame: target\n"
             "  freehand_robot_movement: true\n"
             "transform:\n  translation: {x: %.9g, y: %.9g, z: %.9g}\n"
             "  rotation: {x: %.9g, y: %.9g, z: %.9g, w: %.9g}\n",
             in_hand ? "eye_in_hand" : "eye_on_base",
             in_hand ? other_frame.c_str() : transform.parent.c_str(),
             in_hand ? transform.parent.c_str() : other_frame.c_str(), transform.child.c_str(), v[0], v[1],
             v[2], v[3], v[4], v[5], v[6]);
}

std::string mjcf_camera(const data::NamedTransform& transform, const Lens& lens) {
  const Eigen::Isometry3d T = looking_backwards(transform.T);
  const Eigen::Vector3d t = T.translation();
  const Eigen::Quaterniond q(T.linear());
  std::string text = remark("<!-- ", lens, " -->") +
                     formatted("<camera name=\"%s\" pos=\"%.9g %.9g %.9g\" quat=\"%.9g %.9g %.9g %.9g\"",
                               transform.child.c_str(), t.x(), t.y(), t.z(), q.w(), q.x(), q.y(), q.z());
  if (lens) {
    constexpr double kPixel = 1e-5;                  // of a sensor of any size [m]
    const Eigen::Vector2d off = -off_centre(*lens);  // of the picture from the principal point
    text += formatted(
        " resolution=\"%d %d\" sensorsize=\"%.9g %.9g\" focalpixel=\"%.9g %.9g\" principalpixel=\"%.9g "
        "%.9g\"",
        lens->width, lens->height, kPixel * lens->width, kPixel * lens->height, lens->fx, lens->fy, off.x(),
        off.y());
  }
  return text + "/>\n";
}

std::string usd_stage(const data::NamedTransform& transform, const Lens& lens) {
  const Eigen::Matrix4d T = looking_backwards(transform.T).matrix();
  std::string matrix;  // of row vectors
  for (int column = 0; column < 4; ++column)
    matrix += formatted("%s(%.17g, %.17g, %.17g, %.17g)", column > 0 ? ", " : "", T(0, column), T(1, column),
                        T(2, column), T(3, column));
  std::string camera;
  if (lens) {
    constexpr double kFocal = 24;  // tenths of a unit, of which the ratios alone count
    const Eigen::Vector2d off = off_centre(*lens);
    camera = formatted(
        "        float focalLength = %.9g\n        float horizontalAperture = %.9g\n"
        "        float verticalAperture = %.9g\n        float horizontalApertureOffset = %.9g\n"
        "        float verticalApertureOffset = %.9g\n",
        kFocal, kFocal * lens->width / lens->fx, kFocal * lens->height / lens->fy,
        -kFocal * off.x() / lens->fx, kFocal * off.y() / lens->fy);
  }
  const std::string parent = prim_name(transform.parent);
  return "#usda 1.0\n" + remark("# ", lens) + "(\n    defaultPrim = \"" + parent +
         "\"\n    metersPerUnit = 1\n    upAxis = \"Z\"\n)\n\ndef Xform \"" + parent +
         "\"\n{\n    def Camera \"" + prim_name(transform.child) + "\"\n    {\n" + camera +
         "        float2 clippingRange = (0.01, 100)\n        matrix4d xformOp:transform = (" + matrix +
         ")\n        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n    }\n}\n";
}

std::string opencv_yaml(const data::NamedTransform& transform, const Lens& lens) {
  const auto matrix = [](const char* name, const Eigen::MatrixXd& values) {
    std::string text = formatted("%s: !!opencv-matrix\n   rows: %d\n   cols: %d\n   dt: d\n   data: [ ", name,
                                 static_cast<int>(values.rows()), static_cast<int>(values.cols()));
    for (Eigen::Index i = 0; i < values.rows(); ++i)
      for (Eigen::Index j = 0; j < values.cols(); ++j)
        text += formatted("%s%.17g", i + j > 0 ? ", " : "", values(i, j));
    return text + " ]\n";
  };
  std::string text = "%YAML:1.0\n---\n# T_parent_camera maps points of " + transform.child + " into " +
                     transform.parent + " [m]\n";
  if (lens) {
    Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
    K(0, 0) = lens->fx;
    K(1, 1) = lens->fy;
    K(0, 2) = lens->cx;
    K(1, 2) = lens->cy;
    const Eigen::RowVectorXd distortion =
        Eigen::RowVectorXd::Map(lens->distortion.data(), static_cast<Eigen::Index>(lens->distortion.size()));
    text += formatted("image_width: %d\nimage_height: %d\n", lens->width, lens->height) +
            matrix("camera_matrix", K) +
            matrix("distortion_coefficients",
                   distortion.size() > 0 ? Eigen::MatrixXd(distortion) : Eigen::MatrixXd::Zero(1, 5));
  }
  return text + matrix("T_parent_camera", transform.T.matrix());
}

}  // namespace flash::calib
