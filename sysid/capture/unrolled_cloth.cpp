#include "sysid/capture/unrolled_cloth.h"

#include <Eigen/QR>
#include <cmath>

namespace flash::sysid {

std::vector<Eigen::Vector2d> unrolled(const data::Points& cloud, const Eigen::Vector3d& tool) {
  constexpr Eigen::Index fewest = 100, most = 500;
  constexpr double flattest = 0.3;
  if (cloud.rows() < fewest) return {};
  const data::Points from_tool = cloud.rowwise() - tool.transpose();
  Eigen::MatrixX3d plane(cloud.rows(), 3);
  plane << Eigen::VectorXd::Ones(cloud.rows()), from_tool.leftCols<2>();
  const Eigen::Vector3d fit = plane.colPivHouseholderQr().solve(from_tool.col(2));
  if (!(fit.tail<2>().norm() >= flattest)) return {};
  const Eigen::Vector2d down = -fit.tail<2>().normalized(), level(-down.y(), down.x());
  std::vector<Eigen::Vector2d> points;
  for (Eigen::Index i = 0; i < cloud.rows(); i += 1 + cloud.rows() / most) {
    const Eigen::Vector2d place = from_tool.row(i).head<2>().transpose();
    points.push_back(std::hypot(place.dot(down), from_tool(i, 2)) * down + place.dot(level) * level);
  }
  return points;
}

}  // namespace flash::sysid
