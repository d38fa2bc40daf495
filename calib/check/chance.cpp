#include "calib/check/chance.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace flash::calib {

double chance_beyond(double x, int degrees_of_freedom) {
  if (!(x > 0)) return 1;
  // Each term by its logarithm: exp(-x / 2) alone is zero where many degrees of freedom make x likely.
  const bool odd = degrees_of_freedom % 2 == 1;
  double sum = odd ? std::erfc(std::sqrt(0.5 * x)) : 0;
  for (double k = odd ? 0.5 : 0; k < 0.5 * degrees_of_freedom - 0.25; ++k)
    sum += std::exp(-0.5 * x + k * std::log(0.5 * x) - std::lgamma(k + 1));
  return std::min(sum, 1.0);
}

std::string chance_text(double chance) {
  if (chance < 1e-6) return "less than 0.0001 %";
  char text[40];
  std::snprintf(text, sizeof text, "%.3g %%", 100 * chance);
  return text;
}

}  // namespace flash::calib
