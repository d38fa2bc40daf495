#include "sysid/infer/local_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "data/machine/parallel.h"

namespace flash::sysid {

double noise_between_neighbours(const ObservedRows& rows, const Eigen::VectorXd& residuals, int threads) {
  std::map<std::pair<int, int>, std::vector<Eigen::Index>> groups;
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (rows.weights[i] > 0) groups[{rows.keyframe[at], rows.channel[at]}].push_back(i);
  }
  std::vector<const std::vector<Eigen::Index>*> all;
  for (const auto& [key, group] : groups) all.push_back(&group);
  std::vector<std::vector<double>> of_groups(all.size());
  data::for_each_in_parallel(all.size(), threads, [&](std::size_t g) {
    for (const Eigen::Index i : *all[g]) {
      double nearest = std::numeric_limits<double>::infinity(), difference = 0;
      for (const Eigen::Index j : *all[g]) {
        const double distance = (rows.places.row(i) - rows.places.row(j)).squaredNorm();
        if (j == i || distance >= nearest) continue;
        nearest = distance;
        difference = std::abs(residuals[i] - residuals[j]);
      }
      if (std::isfinite(nearest)) of_groups[g].push_back(difference);
    }
  });
  std::vector<double> differences;
  for (const std::vector<double>& each : of_groups)
    differences.insert(differences.end(), each.begin(), each.end());
  if (differences.empty()) return 0;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  return 1.482602 * *middle / std::sqrt(2.0);
}

}  // namespace flash::sysid
