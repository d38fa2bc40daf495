#include "sim/environment_checks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sim/step/body_law.h"

namespace flash::sim {

namespace {

bool frames_exist(const Environment& environment) {
  const int frames = environment.schedule ? static_cast<int>(environment.schedule->frames.size()) : 0;
  const auto exists = [&](int frame) { return frame >= base_frame && frame < frames; };
  return std::all_of(environment.holds.begin(), environment.holds.end(),
                     [&](const Hold& hold) { return exists(hold.frame); }) &&
         std::all_of(environment.obstacles.begin(), environment.obstacles.end(),
                     [&](const Obstacle& obstacle) { return exists(obstacle.frame); });
}

bool solids_match(const SheetPlan& plan, const Environment& environment) {
  for (std::size_t b = 0; b < plan.bodies.size(); ++b)
    if (plan.bodies[b].body.is_solid() != (environment.solids.count(static_cast<int>(b)) > 0)) return false;
  return true;
}

/// Throws unless `low` <= value <= `high`, and finite.
void expect_between(const char* field, double value, double low, double high, const char* expected) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  throw data::input_error("material", field, "found " + data::format_short(value) + ", expected " + expected);
}

constexpr double above_zero = std::numeric_limits<double>::min();
constexpr double no_limit = std::numeric_limits<double>::max();

}  // namespace

void check_environments(const SheetPlan& plan, const std::vector<Environment>& environments) {
  for (std::size_t e = 0; e < environments.size(); ++e) {
    const Environment& environment = environments[e];
    const auto require = [&](bool met, const char* what) {
      if (!met) throw std::invalid_argument("environment " + std::to_string(e) + ": " + what);
    };
    require(environment.state.positions.rows() == plan.pattern.size &&
                environment.state.velocities.rows() == plan.pattern.size,
            "expected a position and a velocity for each vertex of the plan");
    require(environment.state.bristles.rows() == 0 ||
                environment.state.bristles.rows() ==
                    plan.pattern.size * static_cast<Eigen::Index>(environment.obstacles.size()),
            "expected bristles for each vertex on each obstacle, or none");
    require(environment.holds.size() == environments.front().holds.size(),
            "expected as many holds as environment 0 has");
    require(environment.materials.size() >= plan.bodies.size(), "expected a material for each body");
    require(solids_match(plan, environment),
            "expected a solid material for each body of tetrahedra, and for no other");
    require(frames_exist(environment), "a hold or an obstacle names a frame that the schedule does not have");
    try {
      for (const Hold& hold : environment.holds) check_stiffness(hold);
      body_laws(plan, environment);
    } catch (const data::InputError& error) {
      throw data::InputError("environment " + std::to_string(e) + ": " + error.what());
    }
  }
}

void check_material(const data::SheetMaterial& material) {
  const char *positive = "a number above 0", *zero_or_more = "a number of 0 or more";
  expect_between("membrane_stiffness", material.membrane_stiffness, above_zero, no_limit, positive);
  expect_between("poissons_ratio", material.poissons_ratio, std::nextafter(-1.0, 0.0), 0.5,
                 "a number above -1 and of 1/2 at most");
  expect_between("areal_density", material.areal_density, above_zero, no_limit, positive);
  expect_between("bending_rigidity", material.bending_rigidity, 0, no_limit, zero_or_more);
  expect_between("friction", material.friction, 0, no_limit, zero_or_more);
  expect_between("air_drag", material.air_drag, 0, no_limit, zero_or_more);
  expect_between("stiffness_damping", material.stiffness_damping, 0, no_limit, zero_or_more);
  if (!(material.yield_curvature > 0))
    throw data::input_error(
        "material", "yield_curvature",
        "found " + data::format_short(material.yield_curvature) + ", expected " + positive);
}

void check_material(const data::SolidMaterial& material) {
  const char *positive = "a number above 0", *zero_or_more = "a number of 0 or more";
  expect_between("youngs_modulus", material.youngs_modulus, above_zero, no_limit, positive);
  expect_between("poissons_ratio", material.poissons_ratio, std::nextafter(-1.0, 0.0),
                 std::nextafter(0.5, 0.0), "a number above -1 and below 1/2");
  expect_between("density", material.density, above_zero, no_limit, positive);
  expect_between("friction", material.friction, 0, no_limit, zero_or_more);
  expect_between("air_drag", material.air_drag, 0, no_limit, zero_or_more);
  expect_between("stiffness_damping", material.stiffness_damping, 0, no_limit, zero_or_more);
}

}  // namespace flash::sim
