#pragma once
#include <Eigen/Core>
#include <utility>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::sysid {

/// Positions of a sheet at equal steps. Where only keyframes are wanted, positions in between may be empty,
/// never the first.
struct Motion {
  double start = 0;                     ///< time of the first positions [s]
  double step = 0.01;                   ///< [s]
  std::vector<data::Points> positions;  ///< [m]
  std::vector<Eigen::Vector3d>
      forces{};  ///< last gripper on sheet, in each step: one fewer than positions [N]
};

/// Share of a step within which a time is that of the step itself. Work: rounding.
constexpr double kSameStep = 1e-6;

/// Positions at time t, linear between steps, held outside the simulated span; `velocities` [m/s], when asked
/// for, is the slope used, zero outside the span and where a neighbour is empty.
void surface_at(const Motion& motion, double t, data::Points& positions, data::Points* velocities = nullptr);

/// The first and the last step whose positions surface_at takes for the time.
std::pair<std::size_t, std::size_t> steps_at(const Motion& motion, double t);

/// Whether the positions are there that surface_at takes for the time.
bool has_surface_at(const Motion& motion, double t);

/// The last gripper's force on the sheet in the step that ends at t, rounded; zero where there is no grasp.
Eigen::Vector3d force_at(const Motion& motion, double t);

}  // namespace flash::sysid
