#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace flash::data {

/// How three numbers are a rotation. About fixed axes, "xyz" (roll, pitch, yaw; Fanuc's W P R) and the other
/// eleven orders: R = R_c(angles[2]) R_b(angles[1]) R_a(angles[0]) for "abc". About axes that turn along, in
/// capitals: R = R_a(angles[0]) R_b(angles[1]) R_c(angles[2]) for "ABC", as "ZYX" (KUKA's A B C), "XYZ"
/// (Staubli) and "ZYZ" (Kawasaki's O A T). And "rotvec": axis times angle (Universal Robots).
constexpr const char* kRotationVector = "rotvec";
Eigen::Matrix3d rotation_from_angles(const Eigen::Vector3d& angles, const std::string& order = "xyz");
const std::vector<std::string>& angle_orders();

/// Of axis times angle.
Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& vector);

}  // namespace flash::data
