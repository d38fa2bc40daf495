#include "data/asset/questioned_numbers.h"

#include "data/asset/plate_rigidity.h"
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
  constexpr double kStiff = 1e5;                      // E t, of cloth [N/m]
  constexpr double kApart = 1e3;  // of D from that of a plate; fibres that slide take a factor of 100
  std::vector<UsualNumber> numbers = {
      {"areal density", m.areal_density, 0.01, 20, "kg/m^2", "", " (150 g/m^2 are 0.15)"}};
  if (asset.thickness) {
    const double plate = plate_rigidity(asset.young, asset.poisson, *asset.thickness);
    numbers.push_back({"young with a thickness", asset.young, kSoftest, kStiffest, "Pa",
                       " (E t in N/m has no thickness beside it)", ""});
    numbers.push_back({"E t", asset.young * *asset.thickness, 0, kStiff, "N/m", "",
                       " of cloth (paper and plates have more; their steps take long)"});
    if (m.bending_rigidity > 0)
      numbers.push_back({"bending rigidity", m.bending_rigidity, plate / kApart, plate * kApart, "N m",
                         " about that of a plate of this young and thickness",
                         " about that of a plate of this young and thickness"});
  } else {
    numbers.push_back({"young without a thickness", asset.young, 0.1, kStiff, "N/m", "",
                       " (E in Pa needs a thickness; steps of stiffer sheets take long)"});
  }
  return questioned(asset.source, numbers);
}

std::string questioned(const Asset& asset, const SolidMaterial& m) {
  return questioned(asset.source, {{"density", m.density, 10, 25000, "kg/m^3", " (1 g/cm^3 are 1000)", ""},
                                   {"young", m.youngs_modulus, 100, 1e12, "Pa", " (1 MPa are 1e6)", ""}});
}

}  // namespace flash::data
