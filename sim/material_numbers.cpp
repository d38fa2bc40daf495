#include "sim/material_numbers.h"

#include <array>
#include <cstddef>

#include "data/files/error.h"
#include "sim/named.h"
#include "sim/scene/material_values.h"

namespace flash::sim {

using data::InputError;

namespace {

template <class Material, std::size_t count>
void set_value(const std::array<MaterialValue<Material>, count>& values, const std::string& name,
               double number, Material& material) {
  for (const MaterialValue<Material>& known : values)
    if (known.name == name) {
      material.*known.value = number;
      return;
    }
  throw InputError(name + ": found a name that is none of its material, expected " +
                   listed(names_of(values)));
}

const data::SheetMaterial& sheet_of(const Environment& environment, int body) {
  return environment.materials[static_cast<std::size_t>(body)];
}

const data::SolidMaterial& solid_of(const Environment& environment, int body) {
  return environment.solids.at(body);
}

template <class Values, class Of>
MaterialNumbers numbers_of(const Worlds& worlds, int body, const Values& values, const Of& of) {
  MaterialNumbers numbers;
  for (const auto& known : values) {
    std::vector<double>& column = numbers.emplace_back(known.name, std::vector<double>()).second;
    for (int e = 0; e < worlds.size(); ++e) column.push_back(of(worlds.given(e), body).*known.value);
  }
  return numbers;
}

template <class Values, class Of>
void set_numbers(Worlds& worlds, int body, std::span<const int> chosen, const MaterialNumbers& numbers,
                 const Values& values_of, const Of& of) {
  std::vector<std::remove_cvref_t<decltype(of(worlds.given(0), body))>> materials;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    materials.push_back(of(worlds.given(chosen[i]), body));
    for (const auto& [name, values] : numbers) set_value(values_of, name, values[i], materials.back());
  }
  worlds.set_materials(Chosen(chosen), materials, body);
}

}  // namespace

MaterialNumbers material_numbers(const Worlds& worlds, int body, bool is_solid) {
  return is_solid ? numbers_of(worlds, body, solid_values, solid_of)
                  : numbers_of(worlds, body, sheet_values, sheet_of);
}

void set_material_numbers(Worlds& worlds, int body, bool is_solid, std::span<const int> chosen,
                          const MaterialNumbers& numbers) {
  for (const auto& [name, values] : numbers)
    if (values.size() != chosen.size())
      throw InputError(name + ": found " + std::to_string(values.size()) + " numbers, expected " +
                       std::to_string(chosen.size()));
  if (is_solid)
    set_numbers(worlds, body, chosen, numbers, solid_values, solid_of);
  else
    set_numbers(worlds, body, chosen, numbers, sheet_values, sheet_of);
}

}  // namespace flash::sim
