#pragma once
#include <type_traits>

#include "sim/cuda/elastic_gradient.cuh"
#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/rigid_turn.cuh"
#include "sim/cuda/springs.cuh"
#include "sim/cuda/vertex_records.cuh"
#include "sim/newton/step_numbers.h"

namespace flash::sim::cuda {

inline constexpr double epsilon = 2.220446049250313e-16;  ///< of double precision

// What one implicit Euler step minimizes, as sim/step/incremental_potential.h, with what holds vertices.

/// One step of an environment as a problem. The threads of a block have it in common.
struct StepProblem {
  const ReplayMaterial* material;
  double h;                                    ///< [s]
  EnvironmentNumbers numbers;                  ///< of this h
  const Point *start, *velocities, *bristles;  ///< as in State
  int size;                                    ///< number of vertices
  const Point* loads;                          ///< null without
  Restrictions restrictions;
  const int* held_axes;  ///< by place: bits 1, 2 and 4 for x, y and z
  int held_count;        ///< the first so many restrictions are of held vertices
  ObstacleStep<double> obstacles;
  StepStart damped_since;
  ElasticEnergies at_start;
  Springs springs;

  __device__ double mass(const SheetTables& tables, int i) const {
    return material->areal_density * tables.vertex_area[i];
  }
  __device__ Triple gravity() const {
    return {material->gravity[0], material->gravity[1], material->gravity[2]};
  }
  __device__ Triple load(int i) const { return loads == nullptr ? Triple{0, 0, 0} : triple(loads[i]); }
  /// The bristles of an obstacle on a vertex at the start of the step, as in State.
  __device__ Triple bristle(int obstacle, int i) const { return triple(bristles[obstacle * size + i]); }
  /// Displacement since the start of the step, less that without forces but gravity.
  __device__ Triple inertial(int i, const Triple& moved) const {
    return moved - h * triple(velocities[i]) - (h * h) * gravity();
  }
  /// The part of a vector along the axes that holds carry.
  __device__ Triple held_part(int i, const Triple& v) const {
    const int axes = held_axes[i];
    return {axes & 1 ? v.x : 0, axes & 2 ? v.y : 0, axes & 4 ? v.z : 0};
  }
};

/// A point on the way to the end of a step. The threads of a block have it in common.
struct Iterate {
  Point* positions;
  double* force;
  double* residuals;
  ContactSet contacts;
  ElasticEnergies elastic;
  double potential;      ///< [J]
  double friction;       ///< potential of friction at its own normal forces [J]
  double line_friction;  ///< at those of the iterate from which the line leads here [J]
  double residual;       ///< norm [N]
  double rounding;       ///< of it, by that of positions where friction turns and springs stretch [N]
  double worst;  ///< largest residual of a vertex beyond its rounding, over its weight (least_weight.h)
};

__device__ inline Triple force_at(const double* force, int i) {
  return {force[3 * i], force[3 * i + 1], force[3 * i + 2]};
}

/// Adds the damping of a quadratic bending model to the force. Returns its potential.
__device__ inline double add_turned_damping(const SheetTables& tables, const StepProblem& step,
                                            const TeamMemory& memory, const Point* positions, double* force,
                                            double* partial) {
  const int first = team_rank(), step_size = team_size();
  double centres[7];
  const Triple origin = triple(positions[0]), start_origin = triple(step.start[0]);
  sum_over_team(tables.size, centres, partial, [&](int i, double(&own)[7]) {
    const double mass = step.mass(tables, i);
    const Triple to = triple(positions[i]) - origin, from = triple(step.start[i]) - start_origin;
    own[0] += mass * to.x;
    own[1] += mass * to.y;
    own[2] += mass * to.z;
    own[3] += mass * from.x;
    own[4] += mass * from.y;
    own[5] += mass * from.z;
    own[6] += mass;
  });
  const double per_mass = 1 / centres[6];
  const Triple to_centre = origin + per_mass * Triple{centres[0], centres[1], centres[2]},
               from_centre = start_origin + per_mass * Triple{centres[3], centres[4], centres[5]};
  double sums[9];
  sum_over_team(tables.size, sums, partial, [&](int i, double(&own)[9]) {
    const Triple to = step.mass(tables, i) * (triple(positions[i]) - to_centre),
                 from = triple(step.start[i]) - from_centre;
    const double left[3] = {to.x, to.y, to.z}, right[3] = {from.x, from.y, from.z};
#pragma unroll
    for (int k = 0; k < 9; ++k) own[k] += left[k / 3] * right[k % 3];
  });
  double moments[3][3];
  for (int k = 0; k < 9; ++k) moments[k / 3][k % 3] = sums[k];
  const RigidTurn turn = rigid_turn(moments);
  for (int i = first; i < tables.size; i += step_size) {
    const Triple bent = triple(positions[i]) - to_centre - turn.turn(triple(step.start[i]) - from_centre);
    memory.bent[i] = {bent.x, bent.y, bent.z, 0};
  }
  synchronize_team();
  const double rigidity = step.numbers.damping_share * step.numbers.rigidity;
  multiply_scalar_rows<double>(
      tables, StepsInMemory<double>{tables.step_values},
      [&](int vertex) { return triple(memory.bent[vertex]); },
      [&](int row, int c, double sum) { memory.damped[3 * row + c] = rigidity * sum; });
  synchronize_team();
  double totals[4];
  sum_over_team(tables.size, totals, partial, [&](int i, double(&own)[4]) {
    const Triple damped = force_at(memory.damped, i),
                 torque = cross(damped, turn.turn(triple(step.start[i]) - from_centre));
    own[0] += 0.5 * dot(damped, triple(memory.bent[i]));
    own[1] += torque.x;
    own[2] += torque.y;
    own[3] += torque.z;
  });
  const Triple response = turn.respond({totals[1], totals[2], totals[3]});
  for (int i = first; i < tables.size; i += step_size) {
    const Triple added =
        force_at(memory.damped, i) +
        step.mass(tables, i) * cross(response, turn.turn(triple(step.start[i]) - from_centre));
    force[3 * i] += added.x;
    force[3 * i + 1] += added.y;
    force[3 * i + 2] += added.z;
  }
  return totals[0];
}

/// What obstacles do to a vertex.
struct ContactResponse {
  Triple reaction;                 ///< [N]
  double friction, line_friction;  ///< as in Iterate [J]
  double rounding;                 ///< of the reaction, by that of positions where friction turns [N]
};

// Kinds of obstacles that code is made for. For one the compiler has no loops to make. Where all are planes
// nothing is called, and what a vertex is worked on with stays in registers: else it is kept in memory over
// calls, and that is more than the first-level cache has room for.

struct NoObstacles {
  static constexpr int most = 0;
};
struct OnePlane {
  static constexpr int most = 1;
  static constexpr bool planes = true;
};
struct OneObstacle {
  static constexpr int most = 1;
  static constexpr bool planes = false;
};
struct AnyObstacles {
  static constexpr int most = most_obstacles;
  static constexpr bool planes = false;
};

/// The obstacles of a step, which are of this kind.
template <typename Kind>
__device__ ObstacleStep<double> obstacles_of(const StepProblem& step) {
  ObstacleStep<double> obstacles = step.obstacles;
  obstacles.planes = Kind::planes;
  if constexpr (Kind::most == 1) {
    obstacles.count = 1;
    obstacles.several = false;
  }
  return obstacles;
}

/// act(the kind of obstacles of a step that has some).
template <typename Act>
__device__ auto for_obstacles_of(const StepProblem& step, const Act& act) {
  if (step.obstacles.count > 1) return act(AnyObstacles{});
  return step.obstacles.planes ? act(OnePlane{}) : act(OneObstacle{});
}

/// What is kept of the contact of a vertex, and of its touches.
template <int most>
struct KeptContact {
  ContactRecord contact;
  TouchRecord touches[most];
};

/// Reads nothing of a vertex that is not `listed`.
template <int most>
__device__ KeptContact<most> read_kept(const ContactSet* contacts, int i, int count, bool listed) {
  KeptContact<most> kept;
  if (listed) {
    kept.contact = read(contacts->contacts, i);
    for (int k = 0; k < count; ++k) kept.touches[k] = read(contacts->touches, i, k);
  }
  return kept;
}

/// The touches of a vertex that is listed.
template <int most>
__device__ void take_touches(const KeptContact<most>& kept, int count, VertexTouch* touches) {
  for (int k = 0; k < count; ++k) touches[k] = touch_of(kept.touches[k]);
}

__device__ inline void read_touches(const ContactSet& contacts, int i, int count, VertexTouch* touches) {
  for (int k = 0; k < count; ++k) touches[k] = touch_of(read(contacts.touches, i, k));
}
__device__ inline void carry_bristles(const ObstacleStep<double>& obstacles, const StepProblem& step, int i,
                                      VertexTouch* touches) {
  carry_bristles(
      obstacles, [&](int obstacle) { return step.bristle(obstacle, i); }, touches);
}
/// What holds a vertex that is listed, as contact_of says. `touches`: what read_touches gave.
__device__ inline VertexContact read_contact(const ContactSet& contacts, int i,
                                             const ObstacleStep<double>& obstacles,
                                             const VertexTouch* touches) {
  return contact_of(obstacles, read(contacts.contacts, i), touches);
}
__device__ inline void write_contact(const VertexContact& contact, const VertexTouch* touches, int count,
                                     const ContactSet& contacts, int i) {
  write(record_of(contact), contacts.contacts, i);
  for (int k = 0; k < count; ++k) write(record_of(touches[k]), contacts.touches, i, k);
}

/// Decides what the obstacles do to vertex i, which needs `force`.
template <typename Kind>
__device__ ContactResponse update_contact(const StepProblem& step, const ContactSet& contacts,
                                          const ContactSet* line, int i, const Triple& point,
                                          const Triple& force) {
  const ObstacleStep<double> obstacles = obstacles_of<Kind>(step);
  const Triple start = triple(step.start[i]);
  VertexTouch touches[Kind::most];
  ContactResponse response = {};
  if (line != nullptr && line->listed[i] != 0) {
    read_touches(*line, i, obstacles.count, touches);
    carry_bristles(obstacles, step, i, touches);
    response.line_friction =
        friction_potential_of(obstacles, start, point, read_contact(*line, i, obstacles, touches), touches);
  }
  const double clearance = clearance_of(obstacles, start, point);
  contacts.clearance[i] = clearance;
  contacts.listed[i] = 0;
  if (clearance > touching_gap) return response;
  find_touches(obstacles, start, point, touches);
  carry_bristles(obstacles, step, i, touches);
  SurfaceRoom<Kind::most> room;
  const VertexContact contact = decide_contact(obstacles, start, point, force, touches, room);
  if (contact.freedom == Freedom::free) return response;
  write_contact(contact, touches, obstacles.count, contacts, i);
  contacts.listed[i] = 1;
  response.reaction = contact.reaction;
  response.friction = friction_potential_of(obstacles, start, point, contact, touches);
  response.rounding = epsilon * norm(point) * norm(contact.slip_stiffness);
  return response;
}

/// What the vertices of an iterate add up to.
struct VertexSums {
  double potential;                ///< but for that of elasticity and its damping [J]
  double friction, line_friction;  ///< as in Iterate [J]
  double residual, rounding;       ///< as in Iterate, squared [N^2]
  double worst;                    ///< as in Iterate, times the weight of a unit of mass [N/kg]
};

/// Completes the forces of the vertices, in which those of elasticity stand, and decides their contacts.
template <typename Kind>
__device__ __noinline__ VertexSums balance_vertices(const SheetTables& tables, const StepProblem& step,
                                                    const ContactSet* line, const Iterate& at,
                                                    double* partial) {
  double* force = at.force;
  const Point* positions = at.positions;
  const double per_step = 1 / (step.h * step.h), drag = step.material->air_drag / step.h,
               stiffness = step.material->largest_stiffness * (1 + step.material->stiffness_damping / step.h);
  enum { potential, residual, friction, line_friction, rounding, count };
  double sums[count], worst = 0;
  sum_over_team(tables.size, sums, partial, [&](int i, double(&added)[count]) {
    const double mass = step.mass(tables, i);
    const Triple point = triple(positions[i]), moved = point - triple(step.start[i]),
                 inertial = step.inertial(i, moved), load = step.load(i);
    const Triple own = force_at(force, i) + mass * (per_step * inertial + drag * moved) - load;
    added[potential] +=
        0.5 * mass * (per_step * dot(inertial, inertial) + drag * dot(moved, moved)) - dot(load, moved);
    force[3 * i] = own.x;
    force[3 * i + 1] = own.y;
    force[3 * i + 2] = own.z;
    Triple reaction = step.held_part(i, own);
    const double judged = fmax(mass, step.material->areal_density * tables.least_area);
    double uncertain = fmin(epsilon * norm(point) * (stiffness + mass * per_step),
                            most_rounding * step.material->weight_factor * judged);
    if constexpr (Kind::most > 0)
      if (step.held_axes[i] == 0) {
        const ContactResponse contact = update_contact<Kind>(step, at.contacts, line, i, point, own);
        reaction = contact.reaction;
        uncertain += contact.rounding;
        added[friction] += contact.friction;
        added[line_friction] += contact.line_friction;
      }
    const Triple left = own - reaction;
    at.residuals[3 * i] = left.x;
    at.residuals[3 * i + 1] = left.y;
    at.residuals[3 * i + 2] = left.z;
    const double squared = dot(left, left);
    added[residual] += squared;
    added[rounding] += uncertain * uncertain;
    worst = worse_of(worst, (sqrt(squared) - uncertain) / judged);
  });
  worst = worst_over_team(worst, partial);
  return {sums[potential], sums[friction], sums[line_friction], sums[residual], sums[rounding], worst};
}

/// What springs add to an iterate.
struct SpringSums {
  double potential;  ///< [J]
  double rounding;   ///< of the residual, by that of positions, squared [N^2]
  double worst;      ///< the largest rounding of a vertex over its mass [N/kg]
};

/// Adds what springs need against them to the forces.
__device__ inline __noinline__ SpringSums pull_by_springs(const SheetTables& tables, const StepProblem& step,
                                                          const Iterate& at, double* partial) {
  enum { potential, rounding, count };
  double sums[count], worst = 0;
  const Springs& springs = step.springs;
  sum_over_team(springs.count, sums, partial, [&](int first, double(&added)[count]) {
    if (!springs.is_first_of_vertex(first)) return;
    const int i = springs.list[first].place;
    const Triple x = triple(at.positions[i]);
    Triple force{}, stiffness{};
    for_springs_of_vertex(springs, first, [&](int k) {
      force = force + springs.force(k, x);
      stiffness = stiffness + springs.along_axes(k);
      added[potential] += springs.energy(k, x);
    });
    at.force[3 * i] -= force.x;
    at.force[3 * i + 1] -= force.y;
    at.force[3 * i + 2] -= force.z;
    const double uncertain = epsilon * norm(x) * norm(stiffness);
    added[rounding] += uncertain * uncertain;
    worst = worse_of(worst, uncertain / step.mass(tables, i));
  });
  worst = worst_over_team(worst, partial);
  return {sums[potential], sums[rounding], worst};
}

/// Fills in an iterate from its positions. `line`: contacts of the iterate from which a line leads here, null
/// without. `triangle_shares`: for what triangles give to the gradient. `ring`: as elastic_gradient has it.
template <bool places_on_chip>
__device__ __noinline__ void evaluate(const SheetTables& tables, const StepProblem& step,
                                      const TeamMemory& memory, double* triangle_shares, const StepRing& ring,
                                      const ContactSet* line, Iterate& at) {
  double* partial = shared_memory<double>();
  synchronize_team();
  const ElasticEnergies elastic =
      elastic_gradient<places_on_chip>(tables, step.numbers, step.damped_since, at.positions, at.force,
                                       {triangle_shares, memory.hinge_gradients}, partial, ring);
  double damping = elastic.damping;
  if (step.damped_since.metrics != nullptr && tables.bundle_count > 0)
    damping += add_turned_damping(tables, step, memory, at.positions, at.force, partial);
  SpringSums springs = {};
  if (step.springs.count > 0) springs = pull_by_springs(tables, step, at, partial);
  const auto balance = [&](auto kind) {
    return balance_vertices<decltype(kind)>(tables, step, line, at, partial);
  };
  const VertexSums sums =
      step.obstacles.count == 0 ? balance(NoObstacles{}) : for_obstacles_of(step, balance);
  if (block_rank() == 0) {
    at.elastic = elastic;
    at.potential = sums.potential + damping + elastic.membrane + elastic.bending + springs.potential;
    at.residual = sqrt(sums.residual);
    at.friction = sums.friction;
    at.line_friction = sums.line_friction;
    at.rounding = sqrt(sums.rounding + springs.rounding);
    at.worst = (sums.worst - springs.worst) / step.material->weight_factor;
  }
  synchronize_team();
}

/// Whether |r| <= tolerance |M g|, and no vertex misses its weight by more than 30 times as much. The
/// rounding of positions changes inertia, elastic forces, the springs of holds and the friction of a vertex
/// that starts to slide: that much more may be missing, of springs the most of them at each vertex.
__device__ inline bool balanced(const StepProblem& step, const Iterate& at, double tolerance) {
  return at.worst <= vertex_tolerance * tolerance &&
         at.residual <= tolerance * step.material->force_scale + at.rounding;
}

/// Whether the place where a step starts is its end.
__device__ inline bool rests(const StepProblem& step, const Iterate& start, double tolerance) {
  return start.residual <= start_tolerance_share * tolerance * step.material->force_scale;
}

}  // namespace flash::sim::cuda
