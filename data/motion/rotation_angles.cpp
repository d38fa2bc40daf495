#include "data/motion/rotation_angles.h"

#include <Eigen/Geometry>

namespace flash::data {

Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  if (!(angle > 0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Eigen::Matrix3d rotation_from_angles(const Eigen::Vector3d& angles, const std::string& order) {
  if (order == kRotationVector) return rotation_from_vector(angles);
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  for (int k = 0; k < 3; ++k) {
    const char axis = order[static_cast<std::size_t>(k)];
    const bool turning = axis < 'a';
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(angles[k], Eigen::Vector3d::Unit(axis - (turning ? 'X' : 'x'))).toRotationMatrix();
    rotation = turning ? Eigen::Matrix3d(rotation * turn) : Eigen::Matrix3d(turn * rotation);
  }
  return rotation;
}

const std::vector<std::string>& angle_orders() {
  static const std::vector<std::string> orders = [] {
    std::vector<std::string> list;
    for (const char* order :
         {"xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "xyx", "xzx", "yxy", "yzy", "zxz", "zyz"}) {
      list.emplace_back(order);
      std::string turning = order;
      for (char& axis : turning) axis = static_cast<char>(axis - 'x' + 'X');
      list.push_back(turning);
    }
    list.emplace_back(kRotationVector);
    return list;
  }();
  return orders;
}

}  // namespace flash::data
