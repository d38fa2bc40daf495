#pragma once
#include <array>
#include <string>
#include <vector>

#include "sim/scene/environment.h"

namespace flash::sim {

/// A number of a material under the name that it has in it.
template <class Material>
struct MaterialValue {
  const char* name;
  double Material::*value;
};

inline constexpr std::array<MaterialValue<data::SheetMaterial>, 8> sheet_values = {{
    {"membrane_stiffness", &data::SheetMaterial::membrane_stiffness},
    {"poissons_ratio", &data::SheetMaterial::poissons_ratio},
    {"areal_density", &data::SheetMaterial::areal_density},
    {"bending_rigidity", &data::SheetMaterial::bending_rigidity},
    {"friction", &data::SheetMaterial::friction},
    {"air_drag", &data::SheetMaterial::air_drag},
    {"stiffness_damping", &data::SheetMaterial::stiffness_damping},
    {"yield_curvature", &data::SheetMaterial::yield_curvature},
}};

inline constexpr std::array<MaterialValue<data::SolidMaterial>, 6> solid_values = {{
    {"youngs_modulus", &data::SolidMaterial::youngs_modulus},
    {"poissons_ratio", &data::SolidMaterial::poissons_ratio},
    {"density", &data::SolidMaterial::density},
    {"friction", &data::SolidMaterial::friction},
    {"air_drag", &data::SolidMaterial::air_drag},
    {"stiffness_damping", &data::SolidMaterial::stiffness_damping},
}};

}  // namespace flash::sim
