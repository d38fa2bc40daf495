#pragma once
#include <Eigen/Core>
#include <string>

namespace flash::calib {

constexpr int kWarp = 3;  ///< numbers that say how a print bends: along x, along y, twist
using Warp = Eigen::Matrix<double, kWarp, 1>;
using Bows = Eigen::Matrix<double, kWarp, Eigen::Dynamic>;

/// A target as it was printed: of another size than stated, and not quite flat.
struct TargetShape {
  double scale = 1;          ///< true size over stated size
  Warp warp = Warp::Zero();  ///< see target_bows() [m]
};

/// How a flat print bends, to second order: z = warp_x (1 - u^2) + warp_y (1 - v^2) + twist u v, u and v from
/// -1 to 1 over the points along x and y. The warp [m] is by how much the middle stands behind the ends, the
/// twist by how much two corners across stand behind the other two, halved. Returns the factors of all three.
Bows target_bows(const Eigen::Matrix3Xd& target_points);

/// How well printers keep to a size, as a share.
constexpr double kPrintSd = 0.003;

/// How well the size of a print is known where nothing better is stated, as a share: a printer's, and a ruler
/// across its longer side, read to a millimetre.
double usual_size_sd(const Eigen::Matrix3Xd& target_points);

/// By how much prints usually bend: 0.3 % of the longer side [m].
double usual_warp_sd(const Eigen::Matrix3Xd& target_points);

/// Where points with these bows are, in the target frame.
Eigen::Matrix3Xd shaped(Eigen::Matrix3Xd points, const Bows& bows, const TargetShape& shape);

/// How a target bends (target_bows).
struct WarpEstimate {
  Warp estimate = Warp::Zero(), sd = estimate;  ///< [m]
  double prior_sd = 0;                          ///< of each number [m]

  /// More than prints usually bend, by three deviations of both together.
  bool far_off() const;
};
std::string warp_sentence(const WarpEstimate& warp);

}  // namespace flash::calib
