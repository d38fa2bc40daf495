#include "data/asset/questioned_numbers.h"

#include "data/files/text.h"

namespace flash::data {

std::string questioned(const std::string& source, const std::vector<UsualNumber>& numbers) {
  std::string text;
  for (const UsualNumber& each : numbers) {
    const bool low = each.value < each.low;
    if (!low && each.value <= each.high) continue;
    text += (text.empty() ? "" : "; ") + each.name + " found " + format_short(each.value) + ' ' + each.unit +
            ", usually " + format_short(each.low) + " to " + format_short(each.high) +
            (low ? each.below : each.above);
  }
  return text.empty() ? "" : source + ": unusual, is the unit right? " + text;
}

std::string questioned(const Asset& asset, const SheetMaterial& m) {
  constexpr double kSoftest = 1e3, kStiffest = 1e12;  // [Pa]
  std::vector<UsualNumber> numbers = {
      {"areal density", m.areal_density, 0.005, 20, "kg/m^2", "", " (150 g/m^2 are 0.15)"}};
  if (asset.thickness)
    numbers.push_back({"young with a thickness", asset.young, kSoftest, kStiffest, "Pa",
                       " (E t in N/m has no thickness beside it)", ""});
  else
    numbers.push_back(
        {"young without a thickness", asset.young, 0.1, 1e8, "N/m", "", " (E in Pa needs a thickness)"});
  return questioned(asset.source, numbers);
}

std::string questioned(const Asset& asset, const SolidMaterial& m) {
  return questioned(asset.source, {{"density", m.density, 10, 25000, "kg/m^3", " (1 g/cm^3 are 1000)", ""},
                                   {"young", m.youngs_modulus, 100, 1e12, "Pa", " (1 MPa are 1e6)", ""}});
}

}  // namespace flash::data
