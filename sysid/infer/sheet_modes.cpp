#include "sysid/infer/sheet_modes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
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
  // Many modes have their factor along a side in common.
  std::array<std::map<int, Eigen::ArrayXd>, 2> cosines;
  const auto cosine = [&](int side, int waves) -> const Eigen::ArrayXd& {
    const auto [found, is_new] = cosines[static_cast<std::size_t>(side)].try_emplace(waves);
    if (is_new)
      found->second = (M_PI * waves * ((places.col(side).array() - corner[side]) / sides[side])).cos();
    return found->second;
  };
  SheetModes modes{{}, Eigen::VectorXd(kModes), sides.maxCoeff()};
  modes.values.resize(places.rows(), kModes);
  for (int j = 0; j < kModes; ++j) {
    const auto [a, b, wave_number] = all[static_cast<std::size_t>(j)];
    modes.wave_numbers[j] = wave_number;
    const double scale = std::sqrt((a > 0 ? 2.0 : 1.0) * (b > 0 ? 2.0 : 1.0));
    modes.values.col(j) = scale * cosine(0, a) * cosine(1, b);
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
