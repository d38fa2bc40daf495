#include "sysid/design/usual_ranges.h"

#include <algorithm>
#include <string>

namespace flash::sysid {
namespace {

double own_value(const MaterialBase& base, const std::string& name) {
  return parameter_named(name).get(make_candidate(base, {}, {}), base);
}

}  // namespace

std::vector<Axis> usual_ranges(const MaterialBase& base) {
  const double young = own_value(base, "young"), bending = own_value(base, "bending");
  return {{"young", {0.2 * young, 5 * young}, true},
          {"poisson", {0, 0.45}, false},
          {"bending", {0.1 * bending, 10 * bending}, true},
          {"friction", {0.15, 0.6}, true}};
}

std::vector<double> values_in_range(const MaterialBase& base, const std::vector<Axis>& axes) {
  std::vector<double> values;
  for (const Axis& axis : axes)
    values.push_back(std::clamp(own_value(base, axis.name), axis.values.front(), axis.values.back()));
  return values;
}

}  // namespace flash::sysid
