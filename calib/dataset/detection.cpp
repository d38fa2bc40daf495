#include "calib/dataset/detection.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace flash::calib {

std::vector<RefinerScore> rank_refiners(const std::vector<Detection>& detections) {
  std::map<std::string, int> views;
  for (const Detection& detection : detections)
    for (const CornerReading& reading : detection.readings) ++views[reading.refiner];
  int most = 0;
  for (const auto& [refiner, count] : views) most = std::max(most, count);
  // One that reads only a few of the views cannot be compared over those.
  std::set<std::string> compared;
  for (const auto& [refiner, count] : views)
    if (2 * count >= most) compared.insert(refiner);
  std::map<std::string, std::pair<double, double>> sums;  // squared error, points
  for (const Detection& detection : detections) {
    std::size_t readings = 0;
    for (const CornerReading& reading : detection.readings) readings += compared.count(reading.refiner);
    if (readings < compared.size()) continue;
    for (const CornerReading& reading : detection.readings) {
      const double points = static_cast<double>(reading.observation.points.size());
      sums[reading.refiner].first += points * reading.observation.pose_rms * reading.observation.pose_rms;
      sums[reading.refiner].second += points;
    }
  }
  std::vector<RefinerScore> scores;
  for (const std::string& refiner : compared) {
    const auto& [error, points] = sums[refiner];
    scores.push_back({refiner, points > 0 ? std::sqrt(error / points) : 0, views[refiner]});
  }
  std::stable_sort(scores.begin(), scores.end(),
                   [](const RefinerScore& a, const RefinerScore& b) { return a.rms < b.rms; });
  return scores;
}

std::vector<Observation> observations_of(const std::vector<Detection>& detections,
                                         const std::string& refiner) {
  std::vector<Observation> observations;
  for (const Detection& detection : detections) {
    if (detection.readings.empty()) continue;
    const auto found = std::find_if(detection.readings.begin(), detection.readings.end(),
                                    [&](const CornerReading& reading) { return reading.refiner == refiner; });
    observations.push_back(
        (found == detection.readings.end() ? detection.readings.front() : *found).observation);
  }
  return observations;
}

}  // namespace flash::calib
