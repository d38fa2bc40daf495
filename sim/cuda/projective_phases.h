#pragma once

namespace flash::sim::cuda {

/// Where the time of a step of the projective method goes.
enum class ProjectivePhase { forces, solves, contacts, multipliers, rest };
inline constexpr int projective_phases = 5;
inline constexpr const char* projective_phase_names[projective_phases] = {
    "forces", "solves", "places of contacts", "multipliers", "rest"};

}  // namespace flash::sim::cuda
