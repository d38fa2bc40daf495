#include "calib/check/chance.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace flash::calib {

double chance_beyond(double x, int degrees_of_freedom) {
  // Each term by its logarithm: exp(-x / 2) alone is zero where many degrees of freedom make x likely.
  double sum = 0;
  for (int k = 0; k < degrees_of_freedom / 2; ++k)
    sum += std::exp(-0.5 * x + (k > 0 ? k * std::log(0.5 * x) - std::lgamma(k + 1.0) : 0));
  return std::min(sum, 1.0);
}

std::string chance_text(double chance) {
  if (chance < 1e-6) return "less than 0.0001 %";
  char text[40];
  std::snprintf(text, sizeof text, "%.3g %%", 100 * chance);
  return text;
}

}  // namespace flash::calib
