#include "sysid/infer/agreement.h"

#include <algorithm>
#include <cmath>

#include "data/text.h"

namespace flash::sysid {
namespace {

constexpr double kContradicts = 0.01;  // chance below which recordings contradict each other

/// Chance that chi-square of so many degrees of freedom is larger than x: the incomplete gamma function by
/// its recurrence (Abramowitz and Stegun 6.5.21).
double chance_beyond(double x, int freedom) {
  const double half = 0.5 * x;
  double a = freedom % 2 == 0 ? 1 : 0.5;
  double chance = freedom % 2 == 0 ? std::exp(-half) : std::erfc(std::sqrt(half));
  for (; a < 0.5 * freedom; a += 1) chance += std::exp(a * std::log(half) - half - std::lgamma(a + 1));
  return std::min(chance, 1.0);
}

std::vector<std::size_t> searched(const std::vector<Axis>& axes) {
  std::vector<std::size_t> several;
  for (std::size_t k = 0; k < axes.size(); ++k)
    if (axes[k].values.size() > 1) several.push_back(k);
  return several;
}

std::vector<double> values_at(const std::vector<Axis>& axes, Eigen::Index point) {
  std::vector<double> values(axes.size());
  for (std::size_t k = axes.size(); k-- > 0;) {
    const auto count = static_cast<Eigen::Index>(axes[k].values.size());
    values[k] = axes[k].values[static_cast<std::size_t>(point % count)];
    point /= count;
  }
  return values;
}

/// "at least 1e-3": what is likeliest at an end of the points may be likelier beyond it.
std::string asked(const Axis& axis, double value) {
  const std::string bound = value == axis.values.front()  ? "at most "
                            : value == axis.values.back() ? "at least "
                                                          : "";
  return bound + data::format_short(value);
}

}  // namespace

Agreement agreement_of(const std::vector<Axis>& axes, const Eigen::MatrixXd& deviances) {
  Agreement agreement;
  double least = 0;
  for (Eigen::Index r = 0; r < deviances.cols(); ++r) {
    Eigen::Index point = 0;
    least += deviances.col(r).minCoeff(&point);
    agreement.alone.push_back(values_at(axes, point));
  }
  agreement.excess = std::max(0.0, deviances.rowwise().sum().minCoeff() - least);
  const int freedom = static_cast<int>(searched(axes).size()) * static_cast<int>(deviances.cols() - 1);
  if (freedom > 0 && agreement.excess > 0) agreement.chance = chance_beyond(agreement.excess, freedom);
  return agreement;
}

Agreement agreement_of(const Emulator& emulator, const std::vector<Axis>& axes,
                       const MotionLikelihood& likelihood, const GridSettings& grid) {
  Eigen::MatrixXd deviances(cartesian_product(axes).size(), emulator.models.size());
  for (std::size_t r = 0; r < emulator.models.size(); ++r)
    deviances.col(static_cast<Eigen::Index>(r)) =
        deviance_over({{emulator.models[r]}, emulator.share}, axes, likelihood.only(r), grid);
  return agreement_of(axes, deviances);
}

std::string contradiction_text(const Agreement& agreement, const std::vector<Axis>& axes,
                               const std::vector<std::string>& names) {
  if (agreement.chance >= kContradicts) return "";
  // The parameter that they disagree most on, over what was looked at.
  std::size_t most = 0;
  double farthest = -1;
  for (const std::size_t k : searched(axes)) {
    const double first = coordinate_of(axes[k], axes[k].values.front()),
                 last = coordinate_of(axes[k], axes[k].values.back());
    double low = last, high = first;
    for (const std::vector<double>& values : agreement.alone) {
      low = std::min(low, coordinate_of(axes[k], values[k]));
      high = std::max(high, coordinate_of(axes[k], values[k]));
    }
    if (const double apart = (high - low) / (last - first); apart > farthest) {
      farthest = apart;
      most = k;
    }
  }
  std::string text = "the recordings contradict each other: no one set of parameters serves all. Alone, ";
  for (std::size_t r = 0; r < names.size(); ++r)
    text += (r > 0 ? ", " : "") + names[r] + " asks for " + axes[most].name + " " +
            asked(axes[most], agreement.alone[r][most]);
  return text + ". Chance explains it once in " +
         data::format_short(std::min(1e6, std::round(1 / std::max(agreement.chance, 1e-9)))) +
         " times or less: the intervals are those of a compromise";
}

}  // namespace flash::sysid
