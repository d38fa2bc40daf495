#include "calib/dataset/told_shape.h"

#include <cmath>
#include <cstdio>

namespace flash::calib {
namespace {

constexpr double kTold = 0.5;

}  // namespace

bool told(const WarpEstimate& warp, Eigen::Index number) {
  return warp.prior_sd > 0 && warp.sd[number] < kTold * warp.prior_sd;
}

bool told(const EdgeOffset& edges) { return edges.sd > 0 && edges.sd < kTold * kUsualEdgeOffset; }

std::string describe(const WarpEstimate& warp, double deviations) {
  constexpr const char* kForms[kWarp] = {"its middle %.2f +- %.2f mm behind its ends along x",
                                         "its middle %.2f +- %.2f mm behind its ends along y",
                                         "twisted by %.2f +- %.2f mm"};
  std::string text;
  for (Eigen::Index i = 0; i < kWarp; ++i) {
    if (!told(warp, i)) continue;
    char part[80];
    const double hundredths = std::round(1e5 * warp.estimate[i]) + 0.0;  // what rounds to zero has no sign
    std::snprintf(part, sizeof part, kForms[i], hundredths / 100, 1e3 * deviations * warp.sd[i]);
    text += (text.empty() ? "" : ", ") + std::string(part);
  }
  return text;
}

}  // namespace flash::calib
