#pragma once
#include "sim/cuda/contact.cuh"
#include "sim/cuda/projective_numbers.h"

namespace flash::sim::cuda {

// Contacts of an iterate of the projective method and their multipliers, as sim/oracle/projective_contact.h
// and sim/oracle/constraint_newton.h have them, with the inertia metric W = H M^-1 H^T: a vertex feels its
// own contacts alone. A thread has the vertices i, i + team_size(), ...; what it writes of them no other
// thread reads, so that barriers are those of sums alone: one pair a trial length.

/// A vertex's contacts with the obstacles of a step, in memory.
struct VertexContacts {
  const ProjectiveMemory& memory;
  int size, obstacles;  ///< vertices, obstacles of the environment

  __device__ int& touching(int obstacle, int i) const { return memory.touching[obstacle * size + i]; }
  __device__ double* numbers(int which, int obstacle, int i) const {
    return memory.contacts + (3L * which * obstacles + obstacle) * size + i;
  }
  __device__ Triple get(int which, int obstacle, int i) const {
    const double* from = numbers(which, obstacle, i);
    const long step = static_cast<long>(obstacles) * size;
    return {from[0], from[step], from[2 * step]};
  }
  __device__ void set(int which, int obstacle, int i, const Triple& v) const {
    double* to = numbers(which, obstacle, i);
    const long step = static_cast<long>(obstacles) * size;
    to[0] = v.x;
    to[step] = v.y;
    to[2 * step] = v.z;
  }
  __device__ Triple get(ContactNumber which, int obstacle, int i) const {
    return get(static_cast<int>(which), obstacle, i);
  }
  __device__ void set(ContactNumber which, int obstacle, int i, const Triple& v) const {
    set(static_cast<int>(which), obstacle, i, v);
  }
  /// Multipliers of a set.
  __device__ Triple multiplier(int of_set, int obstacle, int i) const {
    return get(static_cast<int>(ContactNumber::first_multiplier) + of_set, obstacle, i);
  }
  __device__ void set_multiplier(int of_set, int obstacle, int i, const Triple& v) const {
    set(static_cast<int>(ContactNumber::first_multiplier) + of_set, obstacle, i, v);
  }
};

/// Normal and tangents of a contact.
struct ContactDirections {
  Triple rows[3];

  /// The tangents turned by an angle from those of Eigen's unitOrthogonal.
  __device__ ContactDirections(const Triple& normal, double angle) {
    constexpr double least = 1e-12;
    Triple first;
    if (fabs(normal.x) > least * fabs(normal.z) || fabs(normal.y) > least * fabs(normal.z)) {
      const double inverse = 1 / sqrt(normal.x * normal.x + normal.y * normal.y);
      first = {-normal.y * inverse, normal.x * inverse, 0};
    } else {
      const double inverse = 1 / sqrt(normal.y * normal.y + normal.z * normal.z);
      first = {0, -normal.z * inverse, normal.y * inverse};
    }
    const Triple second = cross(normal, first);
    rows[0] = normal;
    if (angle == 0) {
      rows[1] = first;
      rows[2] = second;
      return;
    }
    rows[1] = cos(angle) * first + sin(angle) * second;
    rows[2] = cos(angle) * second - sin(angle) * first;
  }
  __device__ Triple along(const Triple& v) const {
    return {dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)};
  }
  __device__ Triple force(const Triple& multiplier) const {
    return multiplier.x * rows[0] + multiplier.y * rows[1] + multiplier.z * rows[2];
  }
};

/// What find_contacts has seen.
struct FoundContacts {
  bool any, lost;  ///< contacts; contacts of the last iterate that had a force and are none any more
  double largest;  ///< free motion of a vertex [m]
};

/// The contacts at `positions` that the free motion may reach, with the multipliers that they had as the
/// first set.
__device__ __noinline__ FoundContacts find_contacts(const StepProblem& step, VertexContacts contacts,
                                                    double tangent_angle, const Point* positions,
                                                    const float* free_motion) {
  constexpr double margin = 1e-6;
  FoundContacts found = {};
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const Triple free = way_at(free_motion, i);
    const double way = norm(free);
    found.largest = worse_of(found.largest, way);
    if (step.held_axes[i] != 0) continue;
    const Triple point = triple(positions[i]), start = triple(step.start[i]);
    for (int k = 0; k < step.obstacles.count; ++k) {
      const Triple force = contacts.get(ContactNumber::force, k, i);
      const SurfaceGap<double> gap = gap_to(step.obstacles.obstacles[k], point);
      const bool touches = gap.distance < 2 * way + margin;
      contacts.touching(k, i) = touches ? 1 : 0;
      if (!touches) {
        if (is_zero(force)) continue;
        found.lost = true;
        contacts.set(ContactNumber::force, k, i, {0, 0, 0});
        continue;
      }
      found.any = true;
      const ContactDirections directions(gap.normal, tangent_angle);
      Triple gaps = directions.along(point - start - gap.surface_moved);
      gaps.x = gap.distance;
      contacts.set(ContactNumber::normal, k, i, gap.normal);
      contacts.set(ContactNumber::gap, k, i, gaps);
      contacts.set_multiplier(0, k, i, directions.along(force));
    }
  }
  return found;
}

/// Forces of the contacts on a vertex.
__device__ inline Triple contact_force(const VertexContacts& contacts, int i) {
  Triple sum = {0, 0, 0};
  for (int k = 0; k < contacts.obstacles; ++k)
    if (contacts.touching(k, i) != 0) sum = sum + contacts.get(ContactNumber::force, k, i);
  return sum;
}

/// What a vertex's multipliers are solved with.
struct VertexLaw {
  const StepProblem& step;
  const VertexContacts& contacts;
  const MultiplierSettings& settings;
  double inverse_mass;
  int i;

  __device__ double friction(int k) const { return step.obstacles.obstacles[k].friction; }
  __device__ ContactDirections directions(int k) const {
    return {contacts.get(ContactNumber::normal, k, i), settings.tangent_angle};
  }
  __device__ ContactRows rows(const Triple& gap, const Triple& multiplier, int k) const {
    const double gaps[3] = {gap.x, gap.y, gap.z}, numbers[3] = {multiplier.x, multiplier.y, multiplier.z},
                 diagonal[3] = {inverse_mass, inverse_mass, inverse_mass};
    return contact_rows(settings.kind, gaps, numbers, friction(k), diagonal, step.h);
  }
  __device__ ContactViolation violation(const Triple& gap, const Triple& multiplier, int k) const {
    const double gaps[3] = {gap.x, gap.y, gap.z}, numbers[3] = {multiplier.x, multiplier.y, multiplier.z},
                 diagonal[3] = {inverse_mass, inverse_mass, inverse_mass};
    return contact_violation(gaps, numbers, friction(k), diagonal, step.h);
  }
  __device__ Triple projected(const Triple& multiplier, int k) const {
    double numbers[3] = {multiplier.x, multiplier.y, multiplier.z};
    project_multiplier(settings.max_force, friction(k), numbers);
    return {numbers[0], numbers[1], numbers[2]};
  }
  /// The multipliers `length` of a change further; what slides follows its rim.
  __device__ Triple trial(const Triple& multiplier, const double change[3], double length,
                          const ContactRows& at, int k) const {
    double numbers[3] = {multiplier.x + length * change[0], multiplier.y + length * change[1],
                         multiplier.z + length * change[2]};
    follow_rim(at, friction(k), numbers);
    project_multiplier(settings.max_force, friction(k), numbers);
    return {numbers[0], numbers[1], numbers[2]};
  }
  /// Forces of a set of multipliers.
  __device__ Triple force(int of_set) const {
    Triple sum = {0, 0, 0};
    for (int k = 0; k < contacts.obstacles; ++k)
      if (contacts.touching(k, i) != 0) sum = sum + directions(k).force(contacts.multiplier(of_set, k, i));
    return sum;
  }
  /// The only obstacle that touches the vertex, -1 where none does, -2 where several do.
  __device__ int only_obstacle() const {
    int found = -1;
    for (int k = 0; k < contacts.obstacles; ++k)
      if (contacts.touching(k, i) != 0) found = found == -1 ? k : -2;
    return found;
  }
};

/// Squared violations of a vertex summed, and the worst one.
struct VertexMerit {
  double sum = 0, worst = 0;

  __device__ void add(const ContactViolation& v) {
    sum += v.normal * v.normal + v.tangential * v.tangential;
    worst = worse_of(worse_of(worst, v.normal), v.tangential);
  }
};

/// Tries a step of the multipliers of a vertex that several obstacles touch, from a set of them to another
/// one: their rows share its mass. By conjugate residuals, which take what repeats.
__device__ __noinline__ VertexMerit try_together(const VertexLaw& law, int from, int to,
                                                 double trial_length) {
  constexpr int most = 3 * most_obstacles, steps = 100;
  constexpr double tolerance = 1e-12, least = 1e-14;
  Triple axes[most];
  double scale[most], compliance[most], b[most], known[most] = {};
  ContactRows rows[most_obstacles];
  int which[most_obstacles], count = 0;
  const double h2 = law.step.h * law.step.h;
  const Triple force_before = law.force(from);
  for (int k = 0; k < law.contacts.obstacles; ++k) {
    if (law.contacts.touching(k, law.i) == 0) continue;
    const ContactDirections d = law.directions(k);
    const Triple gap =
        law.contacts.get(ContactNumber::free_gap, k, law.i) + (h2 * law.inverse_mass) * d.along(force_before);
    which[count] = k;
    rows[count] = law.rows(gap, law.contacts.multiplier(from, k, law.i), k);
    const double c = rows[count].cosine, s = rows[count].sine;
    axes[3 * count] = d.rows[0];
    axes[3 * count + 1] = c * d.rows[1] + s * d.rows[2];
    axes[3 * count + 2] = c * d.rows[2] - s * d.rows[1];
    ++count;
  }
  const int n = 3 * count;
  Triple known_force = {0, 0, 0};
  for (int r = 0; r < n; ++r) {
    const ConstraintRow& row = rows[r / 3].rows[r % 3];
    compliance[r] = row.compliance;
    scale[r] = row.omega > least ? sqrt(row.omega) : 0;
    if (scale[r] == 0 && row.compliance > 0) known[r] = row.rhs / (h2 * row.compliance);
    known_force = known_force + known[r] * axes[r];
  }
  for (int r = 0; r < n; ++r)
    b[r] = scale[r] > 0 ? rows[r / 3].rows[r % 3].rhs / (h2 * scale[r]) -
                              scale[r] * law.inverse_mass * dot(axes[r], known_force)
                        : 0;
  const auto apply = [&](const double* x, double* y) {
    Triple force = {0, 0, 0};
    for (int r = 0; r < n; ++r) force = force + (scale[r] * x[r]) * axes[r];
    for (int r = 0; r < n; ++r)
      y[r] = scale[r] * law.inverse_mass * dot(axes[r], force) + compliance[r] * x[r];
  };
  const auto product = [&](const double* x, const double* y) {
    double sum = 0;
    for (int r = 0; r < n; ++r) sum += x[r] * y[r];
    return sum;
  };
  // Preconditioned by the diagonal.
  double x[most] = {}, z[most], p[most], Kz[most], Kp[most], q[most], P[most], r_[most];
  for (int r = 0; r < n; ++r) {
    const double diagonal = scale[r] * scale[r] * law.inverse_mass + compliance[r];
    P[r] = diagonal > 0 ? diagonal : 1;
    r_[r] = b[r];
    p[r] = z[r] = b[r] / P[r];
  }
  apply(z, Kz);
  for (int r = 0; r < n; ++r) Kp[r] = Kz[r];
  double zKz = product(z, Kz);
  const double size = product(b, b);
  for (int step = 0; step < steps && product(r_, r_) > tolerance * tolerance * size; ++step) {
    for (int r = 0; r < n; ++r) q[r] = Kp[r] / P[r];
    const double curvature = product(Kp, q);
    if (!(curvature > 0) || !(zKz > 0)) break;
    const double length = zKz / curvature;
    for (int r = 0; r < n; ++r) {
      x[r] += length * p[r];
      r_[r] -= length * Kp[r];
      z[r] -= length * q[r];
    }
    apply(z, Kz);
    const double next = product(z, Kz), ratio = next / zKz;
    for (int r = 0; r < n; ++r) {
      p[r] = z[r] + ratio * p[r];
      Kp[r] = Kz[r] + ratio * Kp[r];
    }
    zKz = next;
  }
  Triple trials[most_obstacles], force = {0, 0, 0};
  for (int k = 0; k < count; ++k) {
    double change[3];
    for (int r = 0; r < 3; ++r) change[r] = scale[3 * k + r] * x[3 * k + r] + known[3 * k + r];
    turn_tangents(rows[k], -1, change + 1);
    trials[k] =
        law.trial(law.contacts.multiplier(from, which[k], law.i), change, trial_length, rows[k], which[k]);
    law.contacts.set_multiplier(to, which[k], law.i, trials[k]);
    force = force + law.directions(which[k]).force(trials[k]);
  }
  VertexMerit merit;
  for (int k = 0; k < count; ++k)
    merit.add(law.violation(law.contacts.get(ContactNumber::free_gap, which[k], law.i) +
                                (h2 * law.inverse_mass) * law.directions(which[k]).along(force),
                            trials[k], which[k]));
  return merit;
}

/// Tries a step of a vertex's multipliers, from a set of them to another one.
__device__ inline VertexMerit try_multipliers(const VertexLaw& law, int from, int to, double length) {
  const int k = law.only_obstacle();
  if (k == -1) return {};
  if (k == -2) return try_together(law, from, to, length);
  const double h2 = law.step.h * law.step.h;
  const Triple free = law.contacts.get(ContactNumber::free_gap, k, law.i),
               multiplier = law.contacts.multiplier(from, k, law.i);
  const ContactRows rows = law.rows(free + (h2 * law.inverse_mass) * multiplier, multiplier, k);
  double change[3];
  for (int r = 0; r < 3; ++r) change[r] = lone_change(rows.rows[r], law.inverse_mass, law.step.h);
  turn_tangents(rows, -1, change + 1);
  const Triple trial = law.trial(multiplier, change, length, rows, k);
  law.contacts.set_multiplier(to, k, law.i, trial);
  VertexMerit merit;
  merit.add(law.violation(free + (h2 * law.inverse_mass) * trial, trial, k));
  return merit;
}

/// Makes the first set of multipliers feasible, and the gaps without them from the free motion that they
/// leave.
__device__ inline VertexMerit begin_multipliers(const VertexLaw& law, const Triple& free_motion) {
  VertexMerit merit;
  const int only = law.only_obstacle();
  if (only == -1) return merit;
  const double h2 = law.step.h * law.step.h * law.inverse_mass;
  const VertexContacts& contacts = law.contacts;
  const Triple force = only == -2 ? law.force(0) : Triple{0, 0, 0};
  for (int k = 0; k < contacts.obstacles; ++k) {
    if (contacts.touching(k, law.i) == 0) continue;
    const ContactDirections directions = law.directions(k);
    const Triple multiplier = contacts.multiplier(0, k, law.i), feasible = law.projected(multiplier, k);
    const Triple gap = directions.along(free_motion) + contacts.get(ContactNumber::gap, k, law.i),
                 free = gap - h2 * (only == -2 ? directions.along(force) : multiplier);
    contacts.set(ContactNumber::free_gap, k, law.i, free);
    contacts.set_multiplier(0, k, law.i, feasible);
    if (only >= 0) merit.add(law.violation(free + h2 * feasible, feasible, k));
  }
  if (only >= 0) return merit;
  const Triple now = law.force(0);
  for (int k = 0; k < contacts.obstacles; ++k)
    if (contacts.touching(k, law.i) != 0)
      merit.add(
          law.violation(contacts.get(ContactNumber::free_gap, k, law.i) + h2 * law.directions(k).along(now),
                        contacts.multiplier(0, k, law.i), k));
  return merit;
}

/// A sum and the largest of numbers that are not negative over the items below n, for all threads.
template <typename Own>
__device__ VertexMerit merit_over_team(int n, double* partial, const Own& own) {
  double* largest = partial + seats;
  VertexMerit all;
  synchronize_team();
  add_up<1>(n, partial, [&](int i, double(&added)[1]) {
    const VertexMerit merit = own(i);
    added[0] += merit.sum;
    all.worst = worse_of(all.worst, merit.worst);
  });
  all.worst = worst_over_warp(all.worst);
  if (lane() == 0) put_in_all(largest + team_warp(), all.worst);
  synchronize_team();
  all.sum = total(n, partial);
  all.worst = 0;
  for (int w = lane(); w < team_warps(); w += 32) all.worst = worse_of(all.worst, largest[w]);
  all.worst = worst_over_warp(all.worst);
  return all;
}

/// A set of multipliers that is none of these.
__device__ inline int another_set(int a, int b, int c) {
  int k = 0;
  while (k == a || k == b || k == c) ++k;
  return k;
}

/// Solves for the multipliers of all contacts, from those at hand, to `tolerance` [m]. free_motion: [m], of
/// the forces with those multipliers. Returns what is left of the laws at the gaps of the iterate.
__device__ __noinline__ double solve_multipliers(const SheetTables& tables, const StepProblem& step,
                                                 VertexContacts contacts, const MultiplierSettings& settings,
                                                 double tolerance, const float* free_motion,
                                                 double* partial) {
  const auto law = [&](int i) { return VertexLaw{step, contacts, settings, 1 / step.mass(tables, i), i}; };
  VertexMerit merit = merit_over_team(
      step.size, partial, [&](int i) { return begin_multipliers(law(i), way_at(free_motion, i)); });
  double best_worst = merit.worst;
  int now = 0, best = 0;
  const double first = settings.damping > 0 ? settings.damping : 1.0,
               last = settings.damping > 0 ? settings.damping : 0.125;
  for (int iteration = 0; merit.worst > tolerance && iteration < settings.iterations; ++iteration) {
    VertexMerit accepted;
    int taken = -1;
    for (double length = first; length >= last; length *= 0.5) {
      const int tried = another_set(now, best, taken);
      const VertexMerit trial = merit_over_team(
          step.size, partial, [&](int i) { return try_multipliers(law(i), now, tried, length); });
      if (taken < 0 || trial.sum < accepted.sum) {
        accepted = trial;
        taken = tried;
      }
      if (accepted.sum < merit.sum) break;
    }
    merit = accepted;
    now = taken;
    if (merit.worst < best_worst) {
      best_worst = merit.worst;
      best = now;
    }
  }
  double left = 0;
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const VertexLaw own = law(i);
    for (int k = 0; k < contacts.obstacles; ++k) {
      if (contacts.touching(k, i) == 0) continue;
      const Triple multiplier = contacts.multiplier(best, k, i);
      const ContactViolation v = own.violation(contacts.get(ContactNumber::gap, k, i), multiplier, k);
      left = worse_of(worse_of(left, v.normal), v.tangential);
      contacts.set(ContactNumber::force, k, i, own.directions(k).force(multiplier));
    }
  }
  return worst_over_team(left, partial);
}

}  // namespace flash::sim::cuda
