#pragma once
#include <Eigen/Core>
#include <string>

namespace flash::calib {

/// A target as it was printed: of another size than stated, and not quite flat.
struct TargetShape {
  double scale = 1;                                ///< true size over stated size
  Eigen::Vector3d warp = Eigen::Vector3d::Zero();  ///< see target_bows() [m]
};

/// How a flat print bends: z = warp_x (1 - u^2) + warp_y (1 - v^2) + warp_xy u v, u and v from -1 to 1 over
/// the points along x and y. The warp [m] is by how much the middle stands behind the ends along either, and
/// two opposite corners, those of the smallest and the largest x and y, behind the plane. These are all
/// quadratic shapes: a curvature along any direction is a sum of them. Returns the factors of the three, 3 x
/// N.
Eigen::Matrix3Xd target_bows(const Eigen::Matrix3Xd& target_points);

/// How well printers keep to a size, as a share.
constexpr double kPrintSd = 0.003;

/// How well the size of a print is known where nothing better is stated, as a share: a printer's, and a ruler
/// across its longer side, read to a millimetre.
double usual_size_sd(const Eigen::Matrix3Xd& target_points);

/// By how much prints usually bend: 0.3 % of the longer side [m].
double usual_warp_sd(const Eigen::Matrix3Xd& target_points);

/// Where points with these bows are, in the target frame.
Eigen::Matrix3Xd shaped(Eigen::Matrix3Xd points, const Eigen::Matrix3Xd& bows, const TargetShape& shape);

/// Bend along x, along y, and twist of a target (target_bows).
struct WarpEstimate {
  Eigen::Vector3d estimate = Eigen::Vector3d::Zero(), sd = estimate;  ///< [m]
  double prior_sd = 0;                                                ///< of each [m]

  /// More than prints usually bend, by three deviations of both together.
  bool far_off() const;
};
/// "bent by 0.12 +- 0.05 and 0.31 +- 0.04 mm along x and y, twisted by 0.51 +- 0.03 mm".
std::string describe(const WarpEstimate& warp);
std::string warp_sentence(const WarpEstimate& warp);

}  // namespace flash::calib
