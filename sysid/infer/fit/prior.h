#pragma once
#include <string>

namespace flash::sysid {

/// What is known of a parameter beforehand: one standard deviation either way. Of a positive parameter the
/// logarithm is normal.
struct Prior {
  std::string name;
  double value = 0;   ///< in the unit of the asset field
  double spread = 2;  ///< of a positive parameter a factor above 1, else a difference
};

}  // namespace flash::sysid
