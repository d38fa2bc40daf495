#pragma once

namespace flash::sim {

// Numbers by which a step is solved, on the processor and on a device.

// Newton's iteration.

/// Of the tolerance, for the place where a step starts to be taken for its end as it is. With the whole
/// tolerance forces below it would move nothing, however long they act. Nor does rounding count there.
inline constexpr double start_tolerance_share = 1e-3;
/// Iterations of a part of a step after which friction follows the normal forces.
inline constexpr int coupled_after = 20;
/// Moves of a step that neither criterion of the line search accepts.
inline constexpr int most_forced_moves = 6;
/// Linear problems an iteration, each with the contacts that the one before asks for.
inline constexpr int linear_problems = 6;

// Its line search.

inline constexpr double armijo_share = 1e-4;   ///< of the decrease of the potential that the slope promises
inline constexpr double residual_share = 0.1;  ///< of the decrease of the residual that a full step promises
inline constexpr double least_length = 1e-3;   ///< down to which a step is halved
inline constexpr double greatest_length = 30;  ///< up to which a step is lengthened
inline constexpr double flat_slope = 0.2;      ///< share of the first slope from which on a line is flat
inline constexpr double least_growth = 1.5, greatest_growth = 3;  ///< of a length at a time
inline constexpr double residual_growth = 10;  ///< of the residual by a lengthened step, at most

// Its linear problems.

inline constexpr double linear_tolerance = 0.3;  ///< of a linear problem, as a share of the step's
/// Share of the first residual that conjugate gradients solve to: a direction needs a digit or two.
inline constexpr double enough = 0.1;
inline constexpr int most_solves = 20;      ///< of conjugate gradients
inline constexpr int most_directions = 40;  ///< of the generalized minimal residual method, which keeps them

// When a step is solved.

inline constexpr double weight_of_nothing =
    9.81;  ///< gravity that weights are told by where there is none [m/s^2]
inline constexpr double vertex_tolerance = 30;  ///< of a vertex as a multiple of the body's
inline constexpr double rounding_tolerance =
    1e-6;  ///< residual over weight below which shorter steps are no help
/// Residual over weight that the rounding of inertia and of elastic forces may leave. Metal foil on small
/// cells, or a scene kilometres away, rounds to more: such a step is not solved.
inline constexpr double most_rounding = 1e-2;
inline constexpr double gap_tolerance = 1e-9;     ///< on gaps and complementarity [m]
inline constexpr double energy_tolerance = 1e-2;  ///< gain of energy, as a share of what can be converted
inline constexpr double weight_rounding = 1e-9;   ///< way over which the work of the weight is rounding [m]
inline constexpr double stiffness_rounding = 1e-14;  ///< of the energy of a membrane, strains being near one
inline constexpr int most_halvings = 16;             ///< of a step, for which a device has room

}  // namespace flash::sim
