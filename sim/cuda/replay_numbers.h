#pragma once
#include "sim/cuda/contact_records.h"
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/four.h"
#include "sim/cuda/front_tables.h"
#include "sim/cuda/most_obstacles.h"
#include "sim/cuda/phase_clock.h"
#include "sim/cuda/sheet_tables.h"
#include "sim/cuda/vertex_records.h"
#include "sim/newton/step_numbers.h"

struct __half;  // of CUDA

namespace flash::sim::cuda {

// What the kernel of a replay knows. Vertices by their places in the elimination.

/// An environment apart from its state.
struct ReplayMaterial {
  MembraneLaw law;
  SheetLame lame, damping;  ///< `damping` as `lame`, but for the law that has no lambda
  double membrane_stiffness, rigidity, areal_density, air_drag, stiffness_damping;  ///< as in SheetMaterial
  double gravity[3];                                                                ///< [m/s^2]
  double weight_factor;      ///< |gravity|, 9.81 without [m/s^2]
  double force_scale;        ///< |M g| [N]
  double largest_stiffness;  ///< as in sim/step/body_law.h, without damping [N/m]
  double bending_rounding;   ///< of the energies of bending at both ends of a step [J]
  int obstacle_count;
  bool several;  ///< whether a box stands beside another obstacle
};

/// An obstacle as an environment has it.
struct PlacedObstacle {
  MovingObstacle<double> obstacle;  ///< where it stands in its frame is `start`
  int frame;                        ///< that carries it, where it moves
};

/// A frame of a schedule at the end of a step.
struct FramePose {
  Frame<double> frame;
  Vector3<double> turn;  ///< rotation vector from it to the next pose [rad]
};

/// What obstacles do to the vertices at an iterate, by place.
struct ContactSet {
  int* listed;                            ///< whether `contacts` and `touches` say anything of a vertex
  VertexRecords<ContactRecord> contacts;  ///< only of those
  VertexRecords<TouchRecord> touches;     ///< only of those: a layer for each obstacle
  double* clearance;                      ///< distance to the nearest obstacle [m]
};

/// A vertex held in some axes at the end of a step.
struct HeldPlace {
  int place;
  int axes;  ///< bits 1, 2 and 4: x, y and z
  double target[3];
  int holds[3];   ///< number of the hold that each axis obeys
  double bow[3];  ///< see HeldVertex
};

/// A spring between a vertex and its place in a soft hold, which moves from one to another over a step.
struct SpringPlace {
  int place;
  int axes;   ///< in which it acts: bits 1, 2 and 4
  int hold;   ///< its number
  int entry;  ///< of its stiffness
  double from[3], to[3];
  double bow[3];  ///< see HeldVertex
};

/// How one step of one environment went.
struct ReplayStats {
  double residual;                    ///< |r| / |M g|
  double penetration;                 ///< deepest vertex below a surface [m]
  double complementarity;             ///< as in StepReport [m]
  double kinetic, membrane, bending;  ///< energies at the end [J]
  int iterations, solves, factorizations, substeps;
  int converged;

  /// What it took, in solves, about: by the parts of steps of 1,024 vertices on one processor.
  FLASH_HOST_DEVICE int work() const { return solves + 2 * iterations + 8 * factorizations; }
};

/// Memory of a team for the generalized minimal residuals of a step with contacts.
struct CoupledMemory {
  float* left;        ///< a matrix for each restriction, nine numbers, column after column
  float* basis;       ///< most_directions + 1 vectors, three numbers a vertex
  float* directions;  ///< most_directions of them
  double* small;      ///< small_numbers
};

/// Numbers of its small problem: the triangle, the rotations, the right-hand side and the weights.
inline constexpr int small_columns = most_directions + 1;
inline constexpr int small_numbers =
    most_directions * small_columns + 2 * most_directions + 2 * small_columns;

/// Memory of a team. Vectors have three numbers a vertex where nothing is said.
struct TeamMemory {
  Point* positions[3];     ///< of the iterates
  double* forces[3];       ///< what each vertex needs from outside [N]
  double* residuals[3];    ///< what the constraints leave of it [N]
  ContactSet contacts[4];  ///< of the iterates and of the linear problem; null without obstacles
  float* own_blocks;       ///< what contact and springs add to the diagonal of the matrix, nine numbers a
                           ///< vertex
  int* held_axes;          ///< by place: bits 1, 2 and 4 for x, y and z
  CoupledMemory coupled;   ///< null without obstacles
  float *gradient, *direction, *change;
  float *residual, *image;
  float* solved;  ///< FrontTables::vector_size
  Four<float>* search;
  float *shares, *updates, *block_rows, *blocks;
  __half* factor;  ///< of the environment at hand; zeros where nothing is stored
  double *triangle_gradients, *hinge_gradients;
  float *hinge_matrix, *hinge_products;
  double *start_metrics, *start_angles;
  Point* bent;
  double* damped;
  VertexRestriction* restrictions;
  int* restriction_of;  ///< by place, -1 for none
  float* projectors;    ///< six a vertex (Restrictions); null without obstacles
  double* hold_starts;  ///< where held vertices were when the step began
  long long* clocks;    ///< ticks of the processor spent in each phase
};

/// State of one environment, or of one behind the other. Bristles: a point for each vertex on each obstacle.
struct SheetState {
  Point *positions, *velocities, *bristles;

  FLASH_HOST_DEVICE SheetState of(long environment, int size, int obstacles) const {
    return {positions + environment * size, velocities + environment * size,
            bristles + environment * obstacles * size};
  }
};

/// What a solver keeps of an environment from step to step besides its factor.
struct SolverState {
  int step;                      ///< at which it goes on; another one: it starts anew
  int refactor;                  ///< whether the next solve needs a new factor
  int spring_count, held_count;  ///< of the last step
  ElasticEnergies at_start;      ///< of the next one
};

/// The environments that no team works on.
struct WaitingEnvironments {
  int* steps;                ///< where each of them stands; -1: a team works on it, or it is at its end
  int* work;                 ///< that each took since its `begins`, in solves
  const float* expected;     ///< work of a step of each, by its last ones
  int* unfinished;           ///< how many are not at their end
  const int *begins, *ends;  ///< steps of each
  int count;
  int leave_at;     ///< so many unfinished ones teams leave to others
  const int* stop;  ///< of the host: once set no team takes another environment
};

/// Steps after which a team gives an environment back and takes the one with the most work left.
inline constexpr int turn_steps = 10;

struct ReplayNumbers {
  FrontTables fronts;
  SheetTables sheet;          ///< of the environment at hand
  const SheetTables* sheets;  ///< of each environment, with the bending of its material
  const TeamMemory* teams;
  SolverState* solvers;  ///< of each environment
  __half* factors;       ///< `factor_numbers` an environment
  long factor_numbers;
  WaitingEnvironments waiting;
  int places_on_chip;                    ///< whether there is room
  int gradient_shares_at;                ///< what triangles give to gradients, on chip, -1 without room
  int matrix_shares_on_chip;             ///< whether there is room for what they give to matrices
  int solved_at, search_at;              ///< these vectors of the linear problem on chip, -1 without room
  int step_ring_at, step_depth;          ///< of a StepRing on chip for products
  int gradient_ring_at, gradient_depth;  ///< of one for gradients

  // Settings.
  double time_step, tolerance;
  double lost_residual;  ///< above which an environment is lost: it goes no further
  int max_iterations, stale_factor_solves, halvings;
  int restart_interval;  ///< steps after which a solver starts anew; 0: never
  int stats_each;        ///< steps that an environment has in `stats`, the first that of its `begins`

  const ReplayMaterial* materials;
  const int* motions;      ///< of each environment
  const Point* loads;      ///< a force a vertex of each environment [N]; null without
  const int* hold_starts;  ///< of each motion and step, in `holds`
  int motion_steps;        ///< steps of a motion, and one more, in `hold_starts`
  const HeldPlace* holds;
  const int* spring_starts;    ///< as hold_starts, in `springs`
  const SpringPlace* springs;  ///< of a step by their vertices
  const double* stiffness;     ///< of springs: `stiffness_each` an environment [N/m]
  int stiffness_each;
  const PlacedObstacle* obstacles;  ///< `most_obstacles_each` an environment; null without
  int most_obstacles_each;
  const FramePose* poses;  ///< of each motion and step, `frames` each
  int frames;
  double exit_speed;  ///< [m/s]
  SheetState states;  ///< of each environment
  ReplayStats* stats;
  double* hold_forces;  ///< on the sheet: environments x steps x holds x 3, zero at first [N]
  int hold_count;
  double* obstacle_forces;  ///< likewise: environments x steps x most_obstacles_each x 3
  const int* kept_index;    ///< of each step from kept_begin on, -1 where it is not kept; null for none
  int kept_begin, kept_count;
  const int* order;  ///< vertex at each place
  double* kept;      ///< environments x kept steps x vertices x 3 [m]
};

}  // namespace flash::sim::cuda
