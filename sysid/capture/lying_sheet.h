#pragma once
#include <Eigen/Core>
#include <vector>

namespace flash::sysid {

/// A rectangle that lies flat with one corner at `corner`: seen from above and looking along its diagonal
/// from there, `right` is the length of the edge on the right hand, `left` that of the other.
struct LyingSheet {
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  ///< [m]
  double right = 0, left = 0;                        ///< [m]
  double heading = 0;                                ///< of the diagonal, about z from x [rad]
};

/// Distance from the rectangle to a point [m]; 0 in it.
double distance_beside(const LyingSheet& sheet, const Eigen::Vector2d& point);

/// Mean distance from the rectangle to the points and from the points to the rectangle, both counted [m].
/// Infinite without points.
double distance_to(const LyingSheet& sheet, const std::vector<Eigen::Vector2d>& points);

/// The same rectangle turned about its corner, by at most 25 degrees, to where it fits the points best.
LyingSheet turned_to(LyingSheet sheet, const std::vector<Eigen::Vector2d>& points);

}  // namespace flash::sysid
