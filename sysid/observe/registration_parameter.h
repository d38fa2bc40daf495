#pragma once
#include <string>
#include <vector>

#include "data/recording/recording.h"

namespace flash::sysid {

/// What the registration of a recording fits beside the material.
struct RegistrationParameter {
  const char* name;   ///< in results, "offset_x"
  const char* label;  ///< as a person reads it, "offset x"
  const char* field;  ///< of `nuisance` in recording.json, "offset_m"
};

inline constexpr RegistrationParameter registration_parameters[] = {{"offset_x", "offset x", "offset_m"},
                                                                    {"offset_y", "offset y", "offset_m"},
                                                                    {"offset_z", "offset z", "offset_m"},
                                                                    {"yaw", "yaw", "yaw_rad"},
                                                                    {"time", "clock", "time_s"}};

/// Whether it is among those that ended at a bound, by name.
bool is_at_bound(const std::vector<std::string>& bounds_hit, const RegistrationParameter& parameter);

/// "yaw is at its bound of 0.26 rad; widen nuisance.yaw_rad in recording.json".
std::string at_bound_text(const RegistrationParameter& parameter, const data::NuisanceBounds& bounds);

}  // namespace flash::sysid
