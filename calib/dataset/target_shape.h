#pragma once
#include <Eigen/Core>
#include <string>

namespace flash::calib {

/// A target as it was printed: of another size than stated, and not quite flat.
struct TargetShape {
  double scale = 1;                                ///< true size over stated size
  Eigen::Vector2d warp = Eigen::Vector2d::Zero();  ///< see target_bows() [m]
};

/// How a flat print bends: z = warp_x (1 - u^2) + warp_y (1 - v^2), u and v from -1 to 1 over the points
/// along x and y. The warp [m] is by how much the middle stands behind the ends. Returns the factors of both.
Eigen::Matrix2Xd target_bows(const Eigen::Matrix3Xd& target_points);

/// How well printers keep to a size, as a share.
constexpr double kPrintSd = 0.003;

/// How well the size of a print is known where nothing better is stated, as a share: a printer's, and a ruler
/// across its longer side, read to a millimetre.
double usual_size_sd(const Eigen::Matrix3Xd& target_points);

/// By how much prints usually bend: 0.3 % of the longer side [m].
double usual_warp_sd(const Eigen::Matrix3Xd& target_points);

/// Where points with these bows are, in the target frame.
Eigen::Matrix3Xd shaped(Eigen::Matrix3Xd points, const Eigen::Matrix2Xd& bows, const TargetShape& shape);

/// By how much the middle of a target stands behind its ends, along x and y (target_bows).
struct WarpEstimate {
  Eigen::Vector2d estimate = Eigen::Vector2d::Zero(), sd = estimate;  ///< [m]
  double prior_sd = 0;                                                ///< an axis [m]

  /// More than prints usually bend, by three deviations of both together.
  bool far_off() const;
};
std::string warp_sentence(const WarpEstimate& warp);

}  // namespace flash::calib
