#include "sysid/infer/agreement.h"

#include <algorithm>
#include <cmath>

#include "data/files/text.h"
#include "sysid/infer/agreed_numbers.h"
#include "sysid/infer/posterior.h"

namespace flash::sysid {
namespace {

/// Chance below which recordings contradict each other. Chosen: by `make agreement` none of 35 searches of
/// one cloth was told so, and all 34 of two whose D differs were.
constexpr double kContradicts = 0.01;

std::vector<std::size_t> searched(const std::vector<Axis>& axes) {
  std::vector<std::size_t> several;
  for (std::size_t k = 0; k < axes.size(); ++k)
    if (axes[k].values.size() > 1) several.push_back(k);
  return several;
}

/// "at least 1e-3": what is likeliest at an end of the range may be likelier beyond it.
std::string asked(const Axis& axis, double value) {
  const std::string bound = value <= axis.values.front()  ? "at most "
                            : value >= axis.values.back() ? "at least "
                                                          : "";
  return bound + data::format_short(value);
}

/// The largest distance of what two recordings ask for, over its standard deviation.
double apart_in(const Agreement& agreement, const Axis& axis, std::size_t k) {
  double most = 0;
  for (std::size_t r = 0; r < agreement.alone.size(); ++r)
    for (std::size_t q = 0; q < r; ++q)
      most = std::max(most, std::abs(coordinate_of(axis, agreement.alone[r][k]) -
                                     coordinate_of(axis, agreement.alone[q][k])) /
                                std::hypot(agreement.spreads[r][k], agreement.spreads[q][k], 1e-9));
  return most;
}

}  // namespace

// The incomplete gamma function by its recurrence (Abramowitz and Stegun 6.5.21).
double chance_beyond(double x, int freedom) {
  const double half = 0.5 * x;
  if (!(half > 0)) return 1;
  double chance = freedom % 2 == 0 ? std::exp(-half) : std::erfc(std::sqrt(half));
  for (double a = freedom % 2 == 0 ? 1 : 0.5; a < 0.5 * freedom; a += 1)
    chance += std::exp(a * std::log(half) - half - std::lgamma(a + 1));
  return std::min(chance, 1.0);
}

std::string better_text(const Agreement& agreement, const std::vector<Axis>& axes) {
  if (!(agreement.estimate_excess > three_deviations) || agreement.chance < kContradicts) return "";
  std::string text = "the estimate is not the likeliest of what was simulated: ";
  for (const std::size_t k : searched(axes))
    text += (k == searched(axes).front() ? "" : ", ") + axes[k].name + " " +
            data::format_short(agreement.likeliest[k]);
  return text + " is likelier for the recordings together; search more values";
}

std::string contradiction_text(const Agreement& agreement, const std::vector<Axis>& axes,
                               const std::vector<std::string>& names) {
  if (agreement.chance >= kContradicts) return "";
  std::size_t most = 0;
  double farthest = -1;
  for (const std::size_t k : searched(axes))
    if (const double apart = apart_in(agreement, axes[k], k); apart > farthest) {
      farthest = apart;
      most = k;
    }
  std::string text = "the recordings contradict each other: no one set of parameters serves all. Alone, ";
  for (std::size_t r = 0; r < names.size(); ++r)
    text += (r > 0 ? ", " : "") + names[r] + " asks for " + axes[most].name + " " +
            asked(axes[most], agreement.alone[r][most]);
  const double once_in = std::min(1e6, std::floor(1 / std::max(agreement.chance, 1e-9)));
  return text + ". Chance explains it once in " + data::format_count(static_cast<std::size_t>(once_in)) +
         " times or less. Search them one by one: what is said of all together serves one of them at best";
}

}  // namespace flash::sysid
