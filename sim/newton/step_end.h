#pragma once
#include "sim/law/host_device.h"
#include "sim/newton/step_numbers.h"

namespace flash::sim {

// What the end of a step is judged by, for the processor and for a device.

/// Residual that a linear problem is to be solved to, where a step is to be solved to `wanted` and is at
/// `residual` [N].
FLASH_HOST_DEVICE inline double linear_target(double wanted, double residual) {
  return linear_tolerance * (residual < wanted ? residual : wanted);
}

/// Whether contact is settled: of no vertex that a surface pushes is the gap, and of no other one the depth,
/// larger than that [m].
FLASH_HOST_DEVICE inline bool is_complementary(double largest) { return largest <= gap_tolerance; }

/// Where the energy of a step came from and went to [J].
struct EnergyAccount {
  double kinetic_at_start, kinetic_at_end;
  double stored_at_start, stored_at_end;  ///< elastic
  double falls;                           ///< work of weight and loads
  double work;                            ///< of holds, springs and obstacles
  double unbalanced;                      ///< of what is left of the forces
  double bristles;                        ///< that those of friction started with
  double rounding;                        ///< of positions and of bending, at the start and at the end

  /// What the energies at the end may be above those they came from.
  FLASH_HOST_DEVICE double allowed() const {
    const double there = kinetic_at_start + stored_at_start + (falls > 0 ? falls : 0) + (work > 0 ? work : 0);
    return energy_tolerance * there + unbalanced + bristles + rounding;
  }
  FLASH_HOST_DEVICE bool balances() const {
    return kinetic_at_end - kinetic_at_start + stored_at_end - stored_at_start - falls - work <= allowed();
  }
};

/// Rounding of the energies of a sheet: of the work of its weight over weight_rounding, of its membrane,
/// whose stiffness [N/m] is over its areal density [kg/m^2], and of its bending at both ends of a step.
FLASH_HOST_DEVICE inline double rounding_of_weight(double mass, double gravity) {
  return weight_rounding * mass * gravity;
}
FLASH_HOST_DEVICE inline double rounding_of_membrane(double mass, double stiffness, double density) {
  return stiffness_rounding * stiffness * mass / density;
}

}  // namespace flash::sim
