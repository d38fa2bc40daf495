#pragma once
#include "sim/cuda/layout/inverse_layout.h"
#include "sim/cuda/projective_phases.h"
#include "sim/cuda/replay_numbers.h"
#include "sim/law/contact_newton.h"

namespace flash::sim::cuda {

// What the kernel of the projective method knows. Vertices by the places of the sheet's layout.

/// Settings of the contacts, as in ConstraintSettings.
struct MultiplierSettings {
  ContactRowKind kind;
  int iterations;
  double tolerance;  ///< [m]
  double max_force;  ///< [N]
  double damping;    ///< fixed step length; 0: the best of 1, 1/2, 1/4, 1/8
  double tangent_angle;
};

/// Memory of a team: numbers of vertices, where nothing is said.
struct ProjectiveMemory {
  Point* positions;  ///< of the prediction, and where forces need double precision of the iterate
  double* force;     ///< three numbers each, in double precision [N]
  int* held_axes;
  Four<float>* forces;     ///< what each needs from outside [N]
  Four<float>* reactions;  ///< of the obstacles [N]
  Four<float>* pulls;      ///< begin_forces()
  float* bending;          ///< three numbers each
  Four<float>* shares;     ///< of the corners of triangles, three of each one after the other
  Four<float>* places;     ///< VertexPlaces, null where they are on chip
  char* solve;             ///< SolveLayout, likewise
  double *triangle_gradients, *hinge_gradients;  ///< in double precision, null where it is not needed
  double *start_metrics, *start_angles;          ///< null where nothing is damped
  Point* bent;
  double* damped;
  MovingObstacle<double>* obstacles;
  // Of each vertex on each obstacle (VertexContacts):
  int* touching;
  Four<float>* surfaces;
  float2* slips;
  Four<float>* contact_forces;
  long long* clocks;
};

struct ProjectiveNumbers {
  ReplayNumbers replay;  ///< what both methods have
  SolveLayout solve;
  const uint4* solve_tables;              ///< SolveImage
  const int4* triangle_corners;           ///< its vertices, and the bits of its area
  const Four<float>* triangle_gradients;  ///< w10, w11, w20 and w21 of SheetTables
  const int* corner_shares;               ///< of SheetTables::corners, in ProjectiveMemory::shares
  const int* factor_of;                   ///< each environment
  const uint4* tiles;                     ///< of each factor, 32 words of four a part of a tile
  const SolveVertex* vertices;            ///< of each factor, by place
  const ProjectiveMemory* teams;
  MultiplierSettings multipliers;
  int iterations;            ///< local-global ones a step
  double contact_tolerance;  ///< [m]
  bool on_chip;              ///< whether there is room for places and solves
  // Bytes from the start of the memory on chip.
  int places_at, solve_at, tiles_at;
  int near_tiles;  ///< tiles on chip
};

}  // namespace flash::sim::cuda
