#pragma once
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/incremental_potential.cuh"
#include "sim/cuda/own_vertices.cuh"
#include "sim/cuda/team_sum.cuh"
#include "sim/law/contact_exchange.h"
#include "sim/law/feasible_place.h"

namespace flash::sim::cuda {

// Contact of a sheet with obstacles: sim/newton/active_set.h and sim/step/contact_set.h for one environment.
// A thread decides for the vertices i, i + team_size(), ...; none of them reads what another decides.

/// The way of the linear problem's solution at a vertex.
__device__ inline Triple way_at(const float* direction, int i) {
  return {direction[3 * i], direction[3 * i + 1], direction[3 * i + 2]};
}

/// Vertices of a thread whose contacts are on their way to it at the same time: as many as registers hold.
template <typename Kind>
inline constexpr int contacts_together = Kind::most == 1 ? 2 : 1;

template <typename Kind>
__device__ __noinline__ void project_vertices(const SheetTables& tables, const StepProblem& step,
                                              const ContactSet* contacts, Point* positions) {
  struct Vertex {
    bool free, listed;
    Triple start, point;
  };
  const ObstacleStep<double> obstacles = obstacles_of<Kind>(step);
  SurfaceRoom<Kind::most> room;
  VertexTouch touches[Kind::most];
  synchronize_team();
  for_own_vertices<contacts_together<Kind>>(
      tables.size,
      [&](int i) {
        const bool free = step.held_axes[i] == 0, listed = contacts != nullptr && contacts->listed[i] != 0;
        return Vertex{free, free && listed, triple(step.start[i]), triple(positions[i])};
      },
      [&](int i, const Vertex& vertex) {
        return read_kept<Kind::most>(contacts, i, obstacles.count, vertex.listed);
      },
      [&](int i, const Vertex& vertex, const KeptContact<Kind::most>& kept) {
        const auto& [free, listed, start, point] = vertex;
        if (!free) return;
        Triple place = point;
        if (listed) {
          take_touches(kept, obstacles.count, touches);
          carry_bristles(obstacles, step, i, touches);
          place = feasible_place(obstacles, start, contact_of(obstacles, kept.contact, touches), touches,
                                 point, room);
        } else if (!(clearance_of(obstacles, start, point) >= 0)) {
          place = projected_out(obstacles, start, nullptr, point, room);
        }
        positions[i] = {place.x, place.y, place.z, 0};
      });
}

/// Moves a trial iterate out of the obstacles, held vertices onto their surface. `contacts`: of the linear
/// problem, null where there is none yet.
__device__ inline void project_to_feasible(const SheetTables& tables, const StepProblem& step,
                                           const ContactSet* contacts, Point* positions) {
  if (step.obstacles.count == 0) return;
  for_obstacles_of(step,
                   [&](auto kind) { project_vertices<decltype(kind)>(tables, step, contacts, positions); });
}

template <typename Kind>
__device__ __noinline__ void copy_records(const SheetTables& tables, int count, const ContactSet& from,
                                          const ContactSet& to) {
  for_own_vertices<contacts_together<Kind>>(
      tables.size, [&](int i) { return from.listed[i]; },
      [&](int i, int listed) { return read_kept<Kind::most>(&from, i, count, listed != 0); },
      [&](int i, int listed, const KeptContact<Kind::most>& kept) {
        to.listed[i] = listed;
        if (listed == 0) return;
        write(kept.contact, to.contacts, i);
        for (int k = 0; k < count; ++k) write(kept.touches[k], to.touches, i, k);
      });
}

/// Copies what holds the vertices at an iterate.
__device__ inline void copy_contacts(const SheetTables& tables, const StepProblem& step,
                                     const ContactSet& from, const ContactSet& to) {
  for_obstacles_of(step, [&](auto kind) {
    copy_records<decltype(kind)>(tables, decltype(kind)::most == 1 ? 1 : step.obstacles.count, from, to);
  });
}

template <typename Kind>
__device__ __noinline__ void gather_contacts(const SheetTables& tables, const StepProblem& step,
                                             const ContactSet& contacts, VertexRestriction* list,
                                             int* of_place, float* left, int* count) {
  struct Vertex {
    bool free, listed;
  };
  const ObstacleStep<double> obstacles = obstacles_of<Kind>(step);
  VertexTouch touches[Kind::most];
  for_own_vertices<contacts_together<Kind>>(
      tables.size,
      [&](int i) {
        const bool free = step.held_axes[i] == 0, listed = contacts.listed[i] != 0;
        return Vertex{free, free && listed};
      },
      [&](int i, const Vertex& vertex) {
        return read_kept<Kind::most>(&contacts, i, obstacles.count, vertex.listed);
      },
      [&](int i, const Vertex& vertex, const KeptContact<Kind::most>& kept) {
        if (!vertex.free) return;
        VertexContact contact;
        if (vertex.listed) {
          take_touches(kept, obstacles.count, touches);
          contact = contact_of(obstacles, kept.contact, touches);
        }
        const bool held = contact.freedom != Freedom::free;
        step.restrictions.set_projector(i, held ? contact.free : identity3());
        if (!held) {
          of_place[i] = -1;
          return;
        }
        VertexRestriction restriction = {i, {}, {}};
        for (int c = 0; c < 3; ++c) {
          for (int r = 0; r < 3; ++r) restriction.free[3 * c + r] = static_cast<float>(contact.free.at(r, c));
          restriction.correction[c] = static_cast<float>(contact.correction[c]);
        }
        const int at = take_numbers(*count, 1);
        list[at] = restriction;
        of_place[i] = at;
        if (left == nullptr) return;
        for (int c = 0; c < 3; ++c) {
          const Triple coupling = friction_coupling(obstacles, contact, touches, c);
          for (int r = 0; r < 3; ++r)
            left[9 * at + 3 * c + r] = static_cast<float>(contact.free.at(r, c) + coupling[r]);
        }
      });
}

/// Fills in what may not move freely: held vertices, and those that `contacts` hold. Their order does not
/// matter. `left`: null, or the matrices of sim/cuda/generalized_residuals.cuh. `count`: on chip, of which
/// that of the first block is used.
__device__ inline void gather_restrictions(const SheetTables& tables, StepProblem& step,
                                           const ContactSet& contacts, VertexRestriction* list, int* of_place,
                                           float* left, int* count) {
  if (step.obstacles.count == 0) return;
  count = in_block(count, 0);
  synchronize_team();
  if (team_rank() == 0) *count = step.held_count;
  for (int k = team_rank(); k < step.held_count && left != nullptr; k += team_size())
    for (int e = 0; e < 9; ++e) left[9 * k + e] = list[k].free[e];
  synchronize_team();
  for_obstacles_of(step, [&](auto kind) {
    gather_contacts<decltype(kind)>(tables, step, contacts, list, of_place, left, count);
  });
  synchronize_team();
  if (block_rank() == 0) step.restrictions.count = *count;
  synchronize_team();
}

/// Second derivative of the gap to a surface that holds a vertex at `point` [1/m].
__device__ inline Symmetric3 curvature_at(const ObstacleStep<double>& obstacles, int k, const Triple& start,
                                          const Triple& point) {
  const ObstacleShape shape = obstacles.obstacles[k].shape;
  if (shape == ObstacleShape::plane || shape == ObstacleShape::box) return {};
  VertexTouch touch;
  const SurfaceGap<double> gap = gap_in_step(obstacles, k, start, point);
  touch.normal = gap.normal;
  touch.curvature_direction = gap.curvature_direction;
  touch.ball_curvature = gap.ball_curvature;
  return curvature_of(touch);
}

template <typename Kind>
__device__ __noinline__ void write_blocks_of_contacts(const SheetTables& tables, const StepProblem& step,
                                                      const Iterate& now, bool curved, float* blocks) {
  const ObstacleStep<double> obstacles = obstacles_of<Kind>(step);
  VertexTouch touches[Kind::most];
  for (int i = team_rank(); i < tables.size; i += team_size()) {
    Symmetric3 sum;
    if (step.held_axes[i] == 0 && now.contacts.listed[i] != 0) {
      read_touches(now.contacts, i, obstacles.count, touches);
      sum = restricted(slip_stiffness_of(obstacles, touches), along_surfaces(obstacles.count, touches));
      for (int k = 0; k < obstacles.count && curved; ++k)
        if (touches[k].holds)
          sum = sum - touches[k].normal_force *
                          curvature_at(obstacles, k, triple(step.start[i]), triple(now.positions[i]));
    }
    for (int e = 0; e < 9; ++e) blocks[9 * i + e] = static_cast<float>(sum.at(e % 3, e / 3));
  }
}

/// What contact adds to the diagonal blocks: the stiffness of friction, whose force turns with the slip; with
/// `curved` that of round surfaces, on which the normal force turns.
__device__ inline void write_own_blocks(const SheetTables& tables, const StepProblem& step,
                                        const Iterate& now, bool curved, float* blocks) {
  for_obstacles_of(
      step, [&](auto kind) { write_blocks_of_contacts<decltype(kind)>(tables, step, now, curved, blocks); });
}

template <typename Kind>
__device__ __noinline__ bool exchange_vertices(const SheetTables& tables, const StepProblem& step,
                                               const Iterate& now, const float* direction,
                                               const float* change, bool stuck, const ContactSet& contacts,
                                               float* gradient) {
  struct Vertex {
    bool free, listed;
    Triple way;
    double clearance;  ///< of one that is not listed
  };
  const ObstacleStep<double> obstacles = obstacles_of<Kind>(step);
  const double reach = stuck ? touching_gap : no_such_side;
  SurfaceRoom<Kind::most> room;
  VertexTouch touches[Kind::most];
  bool any = false;
  for_own_vertices<contacts_together<Kind>>(
      tables.size,
      [&](int i) {
        return Vertex{step.held_axes[i] == 0, contacts.listed[i] != 0, way_at(direction, i),
                      now.contacts.clearance[i]};
      },
      [&](int i, const Vertex& vertex) {
        return read_kept<Kind::most>(&contacts, i, obstacles.count, vertex.free && vertex.listed);
      },
      [&](int i, const Vertex& vertex, const KeptContact<Kind::most>& kept) {
        const auto& [free, listed, way, clearance] = vertex;
        if (!free) return;
        VertexContact contact;
        if (listed) {
          take_touches(kept, obstacles.count, touches);
          contact = contact_of(obstacles, kept.contact, touches);
          const Triple force = force_at(now.force, i);
          if (!stuck && contact.freedom != Freedom::free &&
              release(obstacles, force + way_at(change, i), contact, touches, room)) {
            const Triple row = contact.freedom == Freedom::free ? force : force_at(now.residuals, i);
            for (int c = 0; c < 3; ++c) gradient[3 * i + c] = static_cast<float>(row[c]);
          } else if (!hold(obstacles, way, reach, contact, touches)) {
            // Of several surfaces the forces change all the same.
            if (Kind::most > 1) write_contact(contact, touches, obstacles.count, contacts, i);
            return;
          }
        } else {
          if (clearance > reach || clearance > norm(way)) return;
          find_touches(obstacles, triple(step.start[i]), triple(now.positions[i]), touches);
          if (!hold(obstacles, way, reach, contact, touches)) return;
          contacts.listed[i] = 1;
        }
        write_contact(contact, touches, obstacles.count, contacts, i);
        any = true;
      });
  return any_of_team(any);
}

/// One exchange of the active set of the linear problem, as exchange_contacts of the CPU; `stuck`: as
/// hold_touching. `change`: what the direction adds to the forces. Returns whether any vertex changed, to
/// all.
__device__ inline bool exchange_contacts(const SheetTables& tables, const StepProblem& step,
                                         const Iterate& now, const float* direction, const float* change,
                                         bool stuck, const ContactSet& contacts, float* gradient) {
  return for_obstacles_of(step, [&](auto kind) {
    return exchange_vertices<decltype(kind)>(tables, step, now, direction, change, stuck, contacts, gradient);
  });
}

template <typename Kind>
__device__ __noinline__ void write_bristles_of_contacts(const SheetTables& tables, const StepProblem& step,
                                                        const ContactSet& contacts, Point* bristles) {
  const ObstacleStep<double> obstacles = obstacles_of<Kind>(step);
  VertexTouch touches[Kind::most];
  for (int i = team_rank(); i < tables.size; i += team_size()) {
    const bool touched = step.held_axes[i] == 0 && contacts.listed[i] != 0;
    if (touched) read_touches(contacts, i, obstacles.count, touches);
    for (int k = 0; k < obstacles.count; ++k) {
      const Triple own = touched ? bristle_at_end(obstacles.obstacles[k], touches[k]) : Triple{};
      bristles[k * tables.size + i] = {own.x, own.y, own.z, 0};
    }
  }
}

/// The bristles of the vertices at the end of a step, as in State. Without obstacles they stay straight.
__device__ inline void write_bristles(const SheetTables& tables, const StepProblem& step,
                                      const ContactSet& contacts, Point* bristles) {
  if (step.obstacles.count == 0) return;
  for_obstacles_of(
      step, [&](auto kind) { write_bristles_of_contacts<decltype(kind)>(tables, step, contacts, bristles); });
}

/// What a step says of its contacts.
struct ContactEnd {
  double complementarity;  ///< largest gap of a vertex that a surface pushes, or depth of any other [m]
  double penetration;      ///< deepest vertex below a surface [m]
  double start_depth;      ///< deepest that started inside an obstacle [m]
  double work;             ///< of the obstacles on the sheet [J]
  double bristles;         ///< energy that those of friction started with [J]
};

template <typename Kind>
__device__ __noinline__ ContactEnd judge_vertices(const SheetTables& tables, const StepProblem& step,
                                                  const Iterate& end, double* partial) {
  const ObstacleStep<double> obstacles = obstacles_of<Kind>(step);
  VertexTouch touches[Kind::most];
  double complementarity = 0, penetration = 0, start_depth = 0, sums[2];
  sum_over_team(tables.size, sums, partial, [&](int i, double(&own)[2]) {
    double &work = own[0], &bristles = own[1];
    const Triple start = triple(step.start[i]), point = triple(end.positions[i]);
    const int axes = step.held_axes[i];
    for (int k = 0; k < obstacles.count; ++k) {
      const SurfaceGap<double> gap = gap_in_step(obstacles, k, start, point);
      if (axes == 7) {
        penetration = worse_of(penetration, gap.sunk - gap.distance);
        continue;
      }
      const double depth =
          gap.starts_inside ? -gap_to(obstacles.obstacles[k], point).distance : -gap.distance;
      penetration = worse_of(penetration, depth);
      complementarity = worse_of(complementarity, -gap.distance);
      if (axes == 0) start_depth = worse_of(start_depth, -distance_at_start(obstacles.obstacles[k], start));
    }
    if (axes != 0 || end.contacts.listed[i] == 0) return;
    read_touches(end.contacts, i, obstacles.count, touches);
    carry_bristles(obstacles, step, i, touches);
    bristles += bristle_energy(obstacles, touches);
    for (int k = 0; k < obstacles.count; ++k) {
      const VertexTouch& touch = touches[k];
      if (!touch.holds) continue;
      complementarity = worse_of(complementarity, touch.gap);
      const Triple friction = -(obstacles.obstacles[k].friction * touch.normal_force) * touch.slip_direction,
                   force = touch.normal_force * touch.normal + friction;
      // The obstacle pushes out a vertex that starts inside, even where it stands still.
      work += touch.starts_inside ? fmax(0.0, dot(force, point - start))
                                  : dot(force, gap_in_step(obstacles, k, start, point).surface_moved);
    }
  });
  complementarity = worst_over_team(complementarity, partial);
  penetration = worst_over_team(penetration, partial);
  start_depth = worst_over_team(start_depth, partial);
  synchronize_team();
  return {complementarity, penetration, start_depth > inside_depth ? start_depth : 0, sums[0], sums[1]};
}

__device__ inline ContactEnd judge_contacts(const SheetTables& tables, const StepProblem& step,
                                            const Iterate& end, double* partial) {
  if (step.obstacles.count == 0) return {};
  return for_obstacles_of(
      step, [&](auto kind) { return judge_vertices<decltype(kind)>(tables, step, end, partial); });
}

}  // namespace flash::sim::cuda
