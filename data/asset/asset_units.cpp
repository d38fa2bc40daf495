#include "data/asset/asset_units.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "data/files/json_reader.h"

namespace flash::data {
namespace {

std::vector<std::pair<std::string, std::string>> all_units(const Asset& asset) {
  const bool in_pascal = asset.thickness || asset.element_type == ElementType::tetrahedron;
  return {{"obj_mass", "kg"},
          {"mass", "kg"},
          {"density", "kg/m^3"},
          {"areal_density", "kg/m^2"},
          {"young", in_pascal ? "Pa" : "N/m"},
          {"poisson", "1"},
          {"thickness", "m"},
          {"bending_rigidity", "N m"},
          {"bending", "N m"},  // of results
          {"bending_ratio", "1"},
          {"twisting_ratio", "1"},
          {"young_ratio", "1"},
          {"shear_ratio", "1"},
          {"warp_direction", "deg"},
          {"yield_curvature", "1/m"},
          {"friction", "1"},
          {"air_drag", "1/s"},
          {"stiffness_damping", "s"},
          {"trans", "m"},
          {"rotation", "deg"}};
}

}  // namespace

nlohmann::ordered_json units_of(const nlohmann::ordered_json& numbers, const Asset& asset) {
  nlohmann::ordered_json units = nlohmann::ordered_json::object();
  for (const auto& [name, unit] : all_units(asset))
    if (numbers.contains(name)) units[name] = unit;
  return units;
}

void check_units(const JsonObject& units, const Asset& asset) {
  const std::vector<std::pair<std::string, std::string>> all = all_units(asset);
  std::vector<std::string> names;
  for (const auto& [name, unit] : all) names.push_back(name);
  for (const auto& [name, value] : units.value().items()) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      const std::string nearest = nearest_name(name, names);
      throw units.error(name.c_str(), nearest.empty() ? "the name of a number of the asset"
                                                      : "a number of the asset, as \"" + nearest + '"');
    }
    const std::string& unit = all[static_cast<std::size_t>(found - names.begin())].second;
    if (value != unit)
      throw units.error(name.c_str(), '"' + unit + "\", in which " + name + " is read" +
                                          (name == "young" && asset.thickness ? " beside a thickness" : ""));
  }
}

}  // namespace flash::data
