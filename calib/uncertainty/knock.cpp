#include "calib/uncertainty/knock.h"

#include <algorithm>
#include <cmath>

#include "calib/uncertainty/motion_in_time.h"

namespace flash::calib {
namespace {

constexpr std::size_t kLeastViews = 5;  // on either side
constexpr double kOdds = 20;            // against a motion, before any view is seen

std::vector<double> step_at(std::size_t pose, std::size_t count) {
  std::vector<double> shape(count, 0);
  std::fill(shape.begin() + static_cast<std::ptrdiff_t>(pose), shape.end(), 1.0);
  return shape;
}

/// What motions have to earn: six unknowns and a time each, and their rarity.
double price(const MotionInTime& motions, double count, double places, double rival) {
  return count * (6 * std::log(motions.numbers()) + 2 * std::log(2 * places * kOdds)) + std::max(0.0, rival);
}

/// The best second step beside one, of the same kind.
double gain_of_two(const MotionInTime& motions, const Knock& knock, std::size_t count, double earn) {
  double gain = knock.gain;
  for (std::size_t k = kLeastViews; k + kLeastViews <= count; ++k) {
    if (std::max(k, knock.pose) - std::min(k, knock.pose) < kLeastViews) continue;
    gain = std::max(gain,
                    motions.fit({step_at(knock.pose, count), step_at(k, count)}, knock.camera).fall - earn);
  }
  return gain;
}

}  // namespace

std::optional<Knock> find_knock(const Refinement& refined, const BundleSettings& settings, double rival) {
  const Bundle& bundle = refined.bundle;
  const std::size_t count = bundle.poses.size();
  if (!MotionInTime::applies(bundle, settings) || count < 2 * kLeastViews) return std::nullopt;
  const MotionInTime motions(refined, settings);
  const auto places = static_cast<double>(count - 2 * kLeastViews + 1);
  const double earn = price(motions, 1, places, rival);
  std::optional<Knock> best, other;  // of the kinds
  for (const bool camera : {true, false}) {
    std::optional<Knock> of_kind;
    for (std::size_t k = count - kLeastViews; k >= kLeastViews; --k) {
      const MotionInTime::Fit fit = motions.fit({step_at(k, count)}, camera);
      const double gain = fit.fall - earn;
      const Vector6d motion = fit.motion;
      if (gain > (of_kind ? of_kind->gain : 0) && beyond_usual(bundle, motion))
        of_kind = Knock{k, camera, motion, true, gain};
    }
    if (of_kind && (!best || of_kind->gain > best->gain)) std::swap(best, of_kind);
    if (of_kind) other = of_kind;
  }
  if (best && other) best->told = best->gain - other->gain > 2 * std::log(kOdds);
  if (best) best->second = gain_of_two(motions, *best, count, price(motions, 2, places, rival));
  return best;
}

std::optional<Drift> find_drift(const Refinement& refined, const BundleSettings& settings,
                                const std::vector<double>& shape, double rival) {
  const Bundle& bundle = refined.bundle;
  if (!MotionInTime::applies(bundle, settings) || bundle.poses.size() < 2 * kLeastViews) return std::nullopt;
  const MotionInTime motions(refined, settings);
  const double earn = price(motions, 1, 1, rival);
  std::optional<Drift> best, other;
  for (const bool camera : {true, false}) {
    const MotionInTime::Fit fit = motions.fit({shape}, camera);
    const Drift drift{camera, fit.motion, true, fit.fall - earn};
    if (!(drift.gain > 0)) continue;
    (!best || drift.gain > best->gain ? other = best, best : other) = drift;
  }
  if (best && other) best->told = best->gain - other->gain > 2 * std::log(kOdds);
  return best;
}

SlowDrift slow_drift(const Refinement& refined, const BundleSettings& settings,
                     const std::vector<double>& shape, double rival) {
  SlowDrift drift;
  if (!MotionInTime::applies(refined.bundle, settings) || refined.bundle.poses.size() < 2 * kLeastViews)
    return drift;
  const MotionInTime motions(refined, settings);
  double odds = 0, best = 0;
  for (const bool camera : {true, false}) {
    const MotionInTime::Fit fit = motions.fit({shape}, camera);
    const double fall = fit.fall - std::max(0.0, rival);
    const double size = std::max(0.0, fall / 6 - 1);  // variance of the motion over that of its estimate
    const double kept = size / (1 + size);
    // Beyond that no evidence makes a difference, and odds would not be numbers.
    const double evidence =
        std::exp(std::min(100.0, 0.5 * fall * kept)) * std::pow(1 + size, -3) / (2 * kOdds);
    const Vector6d shift = kept * motions.shift_of_camera(shape, {}, camera) * fit.motion;
    drift.covariance += evidence * (shift * shift.transpose() + kept * motions.growth(shape, camera));
    odds += evidence;
    if (evidence > best) drift.motion = fit.motion;
    best = std::max(best, evidence);
  }
  drift.covariance /= 1 + odds;
  drift.probability = odds / (1 + odds);
  return drift;
}

}  // namespace flash::calib
