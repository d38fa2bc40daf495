#pragma once
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/worlds.h"

namespace flash::sim {

/// Numbers of a material by name, one for each environment.
using MaterialNumbers = std::vector<std::pair<std::string, std::vector<double>>>;

/// All numbers of the material of one body (sim/scene/material_values), of every environment.
MaterialNumbers material_numbers(const Worlds& worlds, int body, bool is_solid);

/// Sets numbers of the environments chosen; those without a name stay. Throws data::InputError, which names
/// the number, where there are not as many as environments and for a name that the material does not have.
void set_material_numbers(Worlds& worlds, int body, bool is_solid, std::span<const int> chosen,
                          const MaterialNumbers& numbers);

}  // namespace flash::sim
