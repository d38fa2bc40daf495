#pragma once
#include "sim/cuda/layout/inverse_layout.h"
#include "sim/cuda/projective_phases.h"
#include "sim/cuda/replay_numbers.h"
#include "sim/law/contact_newton.h"

namespace flash::sim::cuda {

// What the kernel of the projective method knows. Vertices by the places of the sheet's layout.

/// An InverseTree in the memory of a device.
struct InverseTables {
  int size, slots, tiles, node_count, level_count, task_count, below_count, gathered_count;
  const InverseNode* nodes;
  const InverseLevel* levels;
  const InverseTask* tasks;
  const int *below, *gather_starts, *gathered;
  const int *slot_of, *place_at;  ///< of each place, and of each slot, -1 for none
};

/// Settings of the contacts, as in ConstraintSettings.
struct MultiplierSettings {
  ContactRowKind kind;
  int iterations;
  double tolerance;  ///< [m]
  double max_force;  ///< [N]
  double damping;    ///< fixed step length; 0: the best of 1, 1/2, 1/4, 1/8
  double tangent_angle;
};

/// Numbers of a vertex against an obstacle, three each. Of the multipliers there are those at hand, the best
/// ones, and two that are tried.
enum class ContactNumber { normal, gap, free_gap, force, first_multiplier };
inline constexpr int multiplier_sets = 4, contact_numbers = 3 * (4 + multiplier_sets);

/// Memory of a team. Vectors have three numbers a vertex where nothing is said.
struct ProjectiveMemory {
  Point* positions;  ///< of the iterate
  double* force;     ///< what each vertex needs from outside [N]
  double* reaction;  ///< of the obstacles [N]
  double *triangle_gradients, *hinge_gradients;
  double *start_metrics, *start_angles;  ///< null where nothing is damped
  Point* bent;
  double* damped;
  int* held_axes;
  float* motion;  ///< that a solve gives [m]
  float* passed;  ///< three numbers a row below: in memory, where there is no room on chip
  __half* right;  ///< vectors of a solve, likewise
  __half* solved;
  MovingObstacle<double>* obstacles;
  int* touching;     ///< of each vertex on each obstacle
  double* contacts;  ///< ContactNumber, of each vertex on each obstacle
  long long* clocks;
};

struct ProjectiveNumbers {
  ReplayNumbers replay;  ///< what both methods have
  InverseTables inverse;
  const int* factor_of;  ///< each environment
  const uint4* tiles;    ///< of each factor, 32 words of four a part of a tile
  const float* scale;    ///< of each factor, by slot
  const ProjectiveMemory* teams;
  MultiplierSettings multipliers;
  int iterations;            ///< local-global ones a step
  double contact_tolerance;  ///< [m]
  // Bytes from the start of the memory on chip, -1 where there is no room.
  int places_at;  ///< of the vertices, behind what sums need
  int right_at, solved_at, passed_at;
  int tables_at;  ///< of the inverse
  int scale_at;
  int tiles_at, tiles_on_chip;
};

}  // namespace flash::sim::cuda
