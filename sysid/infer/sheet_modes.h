#pragma once
#include <Eigen/Core>

namespace flash::sysid {

/// Cosines of least wave number on the box of a sheet, in which what is smooth along it is expanded (Solin
/// and Sarkka 2020).
struct SheetModes {
  Eigen::MatrixXd values;        ///< of each place (row) and mode, of mean square one over the box
  Eigen::VectorXd wave_numbers;  ///< [1/m]
  double length = 0;             ///< longest side of the box [m]
};

/// `places`: on the sheet at rest, a row each [m].
SheetModes sheet_modes(const Eigen::MatrixX2d& places);

/// Variances of the modes, of sum one, as for Matern's kernel of 3/2 over `reach` [m].
Eigen::VectorXd variances_along(const SheetModes& modes, double reach);

/// Correlation over a distance in reaches: Matern's of 5/2.
double correlation_in_time(double distance);

}  // namespace flash::sysid
