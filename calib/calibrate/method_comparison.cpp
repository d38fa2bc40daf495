#include "calib/calibrate/method_comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flash::calib {

std::vector<ClosedForm> closed_forms() { return {{"park", park}, {"shah", shah}}; }

std::vector<ComparedMethod> compare_closed_forms(const std::vector<PoseLoop>& loops,
                                                 const std::vector<ClosedForm>& forms) {
  std::vector<ComparedMethod> methods;
  for (const ClosedForm& form : forms) {
    ComparedMethod& method = methods.emplace_back();
    method.name = form.name;
    const std::optional<HandEyePoses> poses = form.solve(loops);
    method.wild = !poses || !poses->X.matrix().allFinite();
    if (method.wild) continue;
    method.poses = *poses;
    method.relative = relative_rms(loops, poses->X);
    method.wild = !std::isfinite(method.relative.rotation);
  }
  double rotation = std::numeric_limits<double>::infinity(), translation = rotation;
  for (const ComparedMethod& method : methods) {
    if (method.wild) continue;
    rotation = std::min(rotation, method.relative.rotation);
    translation = std::min(translation, method.relative.translation);
  }
  constexpr double kWild = 3;
  for (ComparedMethod& method : methods)
    method.wild = method.wild || method.relative.rotation > kWild * rotation + 1e-6 ||
                  method.relative.translation > kWild * translation + 1e-6;
  return methods;
}

}  // namespace flash::calib
