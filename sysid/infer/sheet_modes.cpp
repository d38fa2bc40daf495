#include "sysid/infer/sheet_modes.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace flash::sysid {

SheetModes sheet_modes(const Eigen::MatrixX2d& places) {
  constexpr int kModes = 24;
  const Eigen::RowVector2d corner = places.colwise().minCoeff();
  const Eigen::Vector2d sides = (places.colwise().maxCoeff() - corner).transpose().cwiseMax(1e-9);
  struct Mode {
    int a, b;
    double wave_number;
  };
  std::vector<Mode> all;
  for (int a = 0; a < kModes; ++a)
    for (int b = 0; b < kModes; ++b) all.push_back({a, b, M_PI * std::hypot(a / sides[0], b / sides[1])});
  std::stable_sort(all.begin(), all.end(),
                   [](const Mode& one, const Mode& other) { return one.wave_number < other.wave_number; });
  SheetModes modes{{}, Eigen::VectorXd(kModes), sides.maxCoeff()};
  modes.values.resize(places.rows(), kModes);
  for (int j = 0; j < kModes; ++j) {
    const auto [a, b, wave_number] = all[static_cast<std::size_t>(j)];
    modes.wave_numbers[j] = wave_number;
    const double scale = std::sqrt((a > 0 ? 2.0 : 1.0) * (b > 0 ? 2.0 : 1.0));
    const auto x = (places.col(0).array() - corner[0]) / sides[0];
    const auto y = (places.col(1).array() - corner[1]) / sides[1];
    modes.values.col(j) = scale * (M_PI * a * x).cos() * (M_PI * b * y).cos();
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
