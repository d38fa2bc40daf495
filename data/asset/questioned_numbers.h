#pragma once
#include <string>
#include <vector>

#include "data/asset/asset.h"

namespace flash::data {

/// A number and the range in which it usually is, of things or of what is stated about them.
struct UsualNumber {
  std::string name;
  double value, low, high;
  std::string unit, below, above;  ///< what may be meant where it is less, or more
};

/// One line about all numbers that are not as usual, as units were mistaken; empty where there are none.
std::string questioned(const std::string& source, const std::vector<UsualNumber>& numbers);

/// One line about the numbers of an asset that sheets or solids rarely have, as units were mistaken (g/m^2
/// for kg/m^2, E t in N/m for E in Pa), with the usual ranges: from tissue to a rubber mat, from gels to
/// steel. Empty where there are none.
std::string questioned(const Asset& asset, const SheetMaterial& material);
std::string questioned(const Asset& asset, const SolidMaterial& material);

}  // namespace flash::data
