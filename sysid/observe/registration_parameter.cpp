#include "sysid/observe/registration_parameter.h"

#include <algorithm>

#include "data/files/text.h"

namespace flash::sysid {

bool is_at_bound(const std::vector<std::string>& bounds_hit, const RegistrationParameter& parameter) {
  return std::find(bounds_hit.begin(), bounds_hit.end(), parameter.name) != bounds_hit.end();
}

std::string at_bound_text(const RegistrationParameter& parameter, const data::NuisanceBounds& bounds) {
  const std::string name = parameter.name;
  const std::string bound = name == "yaw"    ? data::format_short(bounds.yaw) + " rad"
                            : name == "time" ? data::format_short(bounds.time) + " s"
                                             : data::format_short(bounds.offset[name.back() - 'x']) + " m";
  return std::string(parameter.label) + " is at its bound of " + bound + "; widen nuisance." +
         parameter.field + " in recording.json" +
         (name == "yaw" ? ", or mend the heading with which the sheet starts (--heading of import)" : "");
}

}  // namespace flash::sysid
