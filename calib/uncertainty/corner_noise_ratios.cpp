#include "calib/uncertainty/corner_noise_ratios.h"

#include <algorithm>
#include <cmath>

namespace flash::calib {

std::vector<double> corner_noise_ratios(const Bundle& bundle) {
  constexpr double kOwn = 6;  // of a pose
  const std::size_t count = bundle.poses.size();
  std::vector<double> squares(count), freedom(count, -kOwn);
  for (const BundleView& view : bundle.views) {
    const auto pose = static_cast<std::size_t>(view.pose);
    squares[pose] += residuals(bundle, view).squaredNorm();
    freedom[pose] += 2 * static_cast<double>(view.points.cols());
  }
  // Of each log variance: itself, and the variance that few corners give it.
  double weights = 0, mean = 0, scatter = 0, by_corners = 0;
  std::vector<double> logs(count), variances(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (!(freedom[i] > 0 && squares[i] > 0)) continue;
    logs[i] = std::log(squares[i] / freedom[i]);
    variances[i] = 2 / freedom[i];
    weights += 1;
    mean += logs[i];
    by_corners += variances[i];
  }
  std::vector<double> ratios(count, 1);
  if (weights < 2) return ratios;
  mean /= weights;
  for (std::size_t i = 0; i < count; ++i)
    if (variances[i] > 0) scatter += (logs[i] - mean) * (logs[i] - mean) / (weights - 1);
  const double beyond = std::max(0.0, scatter - by_corners / weights);
  for (std::size_t i = 0; i < count; ++i)
    if (variances[i] > 0) ratios[i] = std::exp(0.5 * beyond / (beyond + variances[i]) * (logs[i] - mean));
  return ratios;
}

}  // namespace flash::calib
