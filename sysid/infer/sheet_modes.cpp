#include "sysid/infer/sheet_modes.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace flash::sysid {

namespace {

struct Mode {
  int a, b;  // half waves along both sides
  double wave_number;
};

/// cos(n pi x), a column for each n up to the most that modes have along a side (Chebyshev's recurrence).
Eigen::ArrayXXd cosines(const Eigen::ArrayXd& x, const std::vector<Mode>& modes, int Mode::*waves) {
  int most = 1;
  for (const Mode& mode : modes) most = std::max(most, mode.*waves);
  Eigen::ArrayXXd columns(x.size(), most + 1);
  columns.col(0).setOnes();
  columns.col(1) = (M_PI * x).cos();
  for (int n = 2; n <= most; ++n)
    columns.col(n) = 2 * columns.col(1) * columns.col(n - 1) - columns.col(n - 2);
  return columns;
}

}  // namespace

SheetModes sheet_modes(const Eigen::MatrixX2d& places) {
  // Cosines along the sheet, of least wave number. Chosen: about five along each side of a square; not
  // varied.
  constexpr int kModes = 24;
  const Eigen::RowVector2d corner = places.colwise().minCoeff();
  const Eigen::Vector2d sides = (places.colwise().maxCoeff() - corner).transpose().cwiseMax(1e-9);
  std::vector<Mode> all;
  for (int a = 0; a < kModes; ++a)
    for (int b = 0; b < kModes; ++b) all.push_back({a, b, M_PI * std::hypot(a / sides[0], b / sides[1])});
  std::stable_sort(all.begin(), all.end(),
                   [](const Mode& one, const Mode& other) { return one.wave_number < other.wave_number; });
  all.resize(kModes);
  SheetModes modes{{}, Eigen::VectorXd(kModes), sides.maxCoeff()};
  modes.values.resize(places.rows(), kModes);
  const Eigen::ArrayXXd along_x = cosines((places.col(0).array() - corner[0]) / sides[0], all, &Mode::a),
                        along_y = cosines((places.col(1).array() - corner[1]) / sides[1], all, &Mode::b);
  for (int j = 0; j < kModes; ++j) {
    const auto [a, b, wave_number] = all[static_cast<std::size_t>(j)];
    modes.wave_numbers[j] = wave_number;
    const double scale = std::sqrt((a > 0 ? 2.0 : 1.0) * (b > 0 ? 2.0 : 1.0));
    modes.values.col(j) = scale * along_x.col(a) * along_y.col(b);
  }
  return modes;
}

Eigen::VectorXd variances_along(const SheetModes& modes, double reach) {
  const Eigen::VectorXd variances = (1 + (reach * modes.wave_numbers.array()).square() / 3).pow(-2.5);
  return variances / variances.sum();
}

double correlation_in_time(double distance) {
  const double x = std::sqrt(5.0) * distance;
  return (1 + x + x * x / 3) * std::exp(-x);
}

}  // namespace flash::sysid
