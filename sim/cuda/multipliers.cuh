#pragma once
#include "sim/cuda/vertex_contacts.cuh"
#include "sim/law/contact_newton.h"

namespace flash::sim::cuda {

// The multipliers of contacts, as sim/oracle/constraint_newton.h has them, with the inertia metric W = H M^-1
// H^T. A vertex then feels its own contacts alone, and is solved by itself: with a step length and as many
// iterations as it needs, by the thread that owns it, and without a barrier.

/// The laws of a contact of a vertex.
template <typename Real>
struct ContactLaw {
  const MultiplierSettings& settings;
  Real inverse_mass, h;

  /// What a force of 1 N moves the vertex by in the step [m/N].
  __device__ Real per_force() const { return h * h * inverse_mass; }
  __device__ ContactRows<Real> rows(const Vector3<Real>& gap, const Vector3<Real>& multiplier,
                                    Real friction) const {
    const Real gaps[3] = {gap.x, gap.y, gap.z}, numbers[3] = {multiplier.x, multiplier.y, multiplier.z},
               diagonal[3] = {inverse_mass, inverse_mass, inverse_mass};
    return contact_rows(settings.kind, gaps, numbers, friction, diagonal, h);
  }
  __device__ ContactViolation<Real> violation(const Vector3<Real>& gap, const Vector3<Real>& multiplier,
                                              Real friction) const {
    const Real gaps[3] = {gap.x, gap.y, gap.z}, numbers[3] = {multiplier.x, multiplier.y, multiplier.z},
               diagonal[3] = {inverse_mass, inverse_mass, inverse_mass};
    return contact_violation(gaps, numbers, friction, diagonal, h);
  }
  __device__ Vector3<Real> projected(const Vector3<Real>& multiplier, Real friction) const {
    Real numbers[3] = {multiplier.x, multiplier.y, multiplier.z};
    project_multiplier(static_cast<Real>(settings.max_force), friction, numbers);
    return {numbers[0], numbers[1], numbers[2]};
  }
  /// The multipliers `length` of a change further; what slides follows its rim.
  __device__ Vector3<Real> trial(const Vector3<Real>& multiplier, const Vector3<Real>& change, Real length,
                                 const ContactRows<Real>& at, Real friction) const {
    Real numbers[3] = {multiplier.x + length * change.x, multiplier.y + length * change.y,
                       multiplier.z + length * change.z};
    follow_rim(at, friction, numbers);
    project_multiplier(static_cast<Real>(settings.max_force), friction, numbers);
    return {numbers[0], numbers[1], numbers[2]};
  }
};

/// Squared violations of a vertex summed, and the worst one.
template <typename Real>
struct VertexMerit {
  Real sum = 0, worst = 0;

  __device__ void add(const ContactViolation<Real>& v) {
    sum += v.normal * v.normal + v.tangential * v.tangential;
    worst = worse_of(worse_of(worst, v.normal), v.tangential);
  }
};

/// Newton's iteration on the multipliers of a vertex, from `now` on, to `tolerance` [m]: change(now) is a
/// step, trial(now, step, length) where a part of it leads, and merit(multipliers) what they leave. Returns
/// the best ones that were met.
template <typename Real, typename Multipliers, typename Change, typename Trial, typename Merit>
__device__ Multipliers iterate_multipliers(const MultiplierSettings& settings, Real tolerance,
                                           Multipliers now, const Change& change, const Trial& trial,
                                           const Merit& merit_of) {
  const Real first = settings.damping > 0 ? static_cast<Real>(settings.damping) : Real(1),
             last = settings.damping > 0 ? first : Real(0.125);
  VertexMerit<Real> merit = merit_of(now);
  Multipliers best = now;
  Real best_worst = merit.worst;
  for (int iteration = 0; merit.worst > tolerance && iteration < settings.iterations; ++iteration) {
    const auto step = change(now);
    Multipliers taken;
    VertexMerit<Real> accepted;
    for (Real length = first; length >= last; length *= Real(0.5)) {
      const Multipliers tried = trial(now, step, length);
      const VertexMerit<Real> of_trial = merit_of(tried);
      if (length == first || of_trial.sum < accepted.sum) {
        accepted = of_trial;
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
  return best;
}

/// The multipliers of a vertex's only contact. free_gap: with no force of it.
__device__ inline Vector3<float> solve_alone(const ContactLaw<float>& law, const Vector3<float>& free_gap,
                                             float friction, float tolerance,
                                             const Vector3<float>& multiplier) {
  struct Step {
    ContactRows<float> rows;
    Vector3<float> change;
  };
  const auto gap_at = [&](const Vector3<float>& m) { return free_gap + law.per_force() * m; };
  return iterate_multipliers(
      law.settings, tolerance, law.projected(multiplier, friction),
      [&](const Vector3<float>& m) {
        const ContactRows<float> rows = law.rows(gap_at(m), m, friction);
        float change[3];
        for (int r = 0; r < 3; ++r) change[r] = lone_change(rows.rows[r], law.inverse_mass, law.h);
        turn_tangents(rows, -1, change + 1);
        return Step{rows, {change[0], change[1], change[2]}};
      },
      [&](const Vector3<float>& m, const Step& step, float length) {
        return law.trial(m, step.change, length, step.rows, friction);
      },
      [&](const Vector3<float>& m) {
        VertexMerit<float> merit;
        merit.add(law.violation(gap_at(m), m, friction));
        return merit;
      });
}

/// Contacts of a vertex that several obstacles touch: their forces move it together.
struct ContactsTogether {
  int count = 0;
  int obstacles[most_obstacles];
  double friction[most_obstacles];
  Triple rows[most_obstacles][3];  ///< ContactDirections
  Triple gaps[most_obstacles];     ///< that the free motion leaves without a force of theirs
};

struct MultipliersTogether {
  Triple of[most_obstacles];
};

/// The steps of all rows together, by conjugate residuals, which take what repeats.
struct StepTogether {
  ContactRows<double> rows[most_obstacles];
  Triple changes[most_obstacles];
};

__device__ inline Triple force_of(const ContactsTogether& c, const MultipliersTogether& m) {
  Triple sum = {0, 0, 0};
  for (int k = 0; k < c.count; ++k)
    sum = sum + m.of[k].x * c.rows[k][0] + m.of[k].y * c.rows[k][1] + m.of[k].z * c.rows[k][2];
  return sum;
}

/// The gap of a contact while a force acts on the vertex.
__device__ inline Triple gap_under(const ContactLaw<double>& law, const ContactsTogether& c, int k,
                                   const Triple& force) {
  const Triple along = {dot(c.rows[k][0], force), dot(c.rows[k][1], force), dot(c.rows[k][2], force)};
  return c.gaps[k] + law.per_force() * along;
}

__device__ __noinline__ void change_together(const ContactLaw<double>& law, const ContactsTogether& c,
                                             const MultipliersTogether& now, StepTogether& step) {
  constexpr int most = 3 * most_obstacles, steps = 100;
  constexpr double tolerance = 1e-12, least = 1e-14;
  Triple axes[most];
  double scale[most], compliance[most], b[most], known[most] = {};
  const double h2 = law.h * law.h;
  const Triple force_before = force_of(c, now);
  for (int k = 0; k < c.count; ++k) {
    step.rows[k] = law.rows(gap_under(law, c, k, force_before), now.of[k], c.friction[k]);
    const double cosine = step.rows[k].cosine, sine = step.rows[k].sine;
    axes[3 * k] = c.rows[k][0];
    axes[3 * k + 1] = cosine * c.rows[k][1] + sine * c.rows[k][2];
    axes[3 * k + 2] = cosine * c.rows[k][2] - sine * c.rows[k][1];
  }
  const int n = 3 * c.count;
  Triple known_force = {0, 0, 0};
  for (int r = 0; r < n; ++r) {
    const ConstraintRow<double>& row = step.rows[r / 3].rows[r % 3];
    compliance[r] = row.compliance;
    scale[r] = row.omega > least ? sqrt(row.omega) : 0;
    if (scale[r] == 0 && row.compliance > 0) known[r] = row.rhs / (h2 * row.compliance);
    known_force = known_force + known[r] * axes[r];
  }
  for (int r = 0; r < n; ++r)
    b[r] = scale[r] > 0 ? step.rows[r / 3].rows[r % 3].rhs / (h2 * scale[r]) -
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
  double x[most] = {}, z[most], p[most], Kz[most], Kp[most], q[most], P[most], left[most];
  for (int r = 0; r < n; ++r) {
    const double diagonal = scale[r] * scale[r] * law.inverse_mass + compliance[r];
    P[r] = diagonal > 0 ? diagonal : 1;
    left[r] = b[r];
    p[r] = z[r] = b[r] / P[r];
  }
  apply(z, Kz);
  for (int r = 0; r < n; ++r) Kp[r] = Kz[r];
  double zKz = product(z, Kz);
  const double size = product(b, b);
  for (int k = 0; k < steps && product(left, left) > tolerance * tolerance * size; ++k) {
    for (int r = 0; r < n; ++r) q[r] = Kp[r] / P[r];
    const double curvature = product(Kp, q);
    if (!(curvature > 0) || !(zKz > 0)) break;
    const double length = zKz / curvature;
    for (int r = 0; r < n; ++r) {
      x[r] += length * p[r];
      left[r] -= length * Kp[r];
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
  for (int k = 0; k < c.count; ++k) {
    double change[3];
    for (int r = 0; r < 3; ++r) change[r] = scale[3 * k + r] * x[3 * k + r] + known[3 * k + r];
    turn_tangents(step.rows[k], -1, change + 1);
    step.changes[k] = {change[0], change[1], change[2]};
  }
}

/// The multipliers of a vertex that several obstacles touch, in double precision: their rows may repeat.
__device__ __noinline__ MultipliersTogether solve_together(const ContactLaw<double>& law,
                                                           const ContactsTogether& c, double tolerance,
                                                           MultipliersTogether multipliers) {
  for (int k = 0; k < c.count; ++k) multipliers.of[k] = law.projected(multipliers.of[k], c.friction[k]);
  return iterate_multipliers(
      law.settings, tolerance, multipliers,
      [&](const MultipliersTogether& now) {
        StepTogether step;
        change_together(law, c, now, step);
        return step;
      },
      [&](const MultipliersTogether& now, const StepTogether& step, double length) {
        MultipliersTogether tried = now;
        for (int k = 0; k < c.count; ++k)
          tried.of[k] = law.trial(now.of[k], step.changes[k], length, step.rows[k], c.friction[k]);
        return tried;
      },
      [&](const MultipliersTogether& m) {
        const Triple force = force_of(c, m);
        VertexMerit<double> merit;
        for (int k = 0; k < c.count; ++k)
          merit.add(law.violation(gap_under(law, c, k, force), m.of[k], c.friction[k]));
        return merit;
      });
}

/// Solves for the multipliers of a vertex that several obstacles touch. Returns the worst of what is left of
/// the laws at the gaps of the iterate [m].
__device__ __noinline__ float meet_several(const StepProblem& step, const VertexContacts& contacts,
                                           const MultiplierSettings& settings, int i, double inverse_mass,
                                           double tolerance, const Vector3<float>& way) {
  const ContactLaw<double> law = {settings, inverse_mass, step.h};
  ContactsTogether c;
  MultipliersTogether multipliers;
  Triple at_iterate[most_obstacles];
  for (int k = 0; k < contacts.obstacles; ++k) {
    if (contacts.touching(k, i) == 0) continue;
    const Four<float> surface = contacts.surface(k, i);
    const float2 slip = contacts.slip(k, i);
    const ContactDirections<double> directions({surface.x, surface.y, surface.z}, settings.tangent_angle);
    const Vector3<float> force = vector_of(contacts.force(k, i));
    for (int r = 0; r < 3; ++r) c.rows[c.count][r] = directions.rows[r];
    c.obstacles[c.count] = k;
    c.friction[c.count] = step.obstacles.obstacles[k].friction;
    multipliers.of[c.count] = directions.along({force.x, force.y, force.z});
    at_iterate[c.count] = {surface.w, slip.x, slip.y};
    c.gaps[c.count] = at_iterate[c.count] + directions.along({way.x, way.y, way.z});
    ++c.count;
  }
  const Triple force = force_of(c, multipliers);
  for (int k = 0; k < c.count; ++k) c.gaps[k] = gap_under(law, c, k, Triple{0, 0, 0} - force);
  const MultipliersTogether solved = solve_together(law, c, tolerance, multipliers);
  VertexMerit<double> left;
  for (int k = 0; k < c.count; ++k) {
    const Triple& m = solved.of[k];
    const Vector3<float> own = single(m.x * c.rows[k][0] + m.y * c.rows[k][1] + m.z * c.rows[k][2]);
    contacts.force(c.obstacles[k], i) = {own.x, own.y, own.z, 0};
    left.add(law.violation(at_iterate[k], m, c.friction[k]));
  }
  return static_cast<float>(left.worst);
}

/// The same of a vertex that one obstacle touches.
__device__ inline float meet_one(const StepProblem& step, const VertexContacts& contacts,
                                 const MultiplierSettings& settings, int k, int i, float inverse_mass,
                                 float tolerance, const Vector3<float>& way) {
  const ContactLaw<float> law = {settings, inverse_mass, static_cast<float>(step.h)};
  const Four<float> surface = contacts.surface(k, i);
  const float2 slip = contacts.slip(k, i);
  const auto friction = static_cast<float>(step.obstacles.obstacles[k].friction);
  const ContactDirections<float> directions({surface.x, surface.y, surface.z}, settings.tangent_angle);
  const Vector3<float> before = directions.along(vector_of(contacts.force(k, i))),
                       gap = {surface.w, slip.x, slip.y},
                       free_gap = gap + directions.along(way) - law.per_force() * before;
  const Vector3<float> multiplier = solve_alone(law, free_gap, friction, tolerance, before);
  const Vector3<float> force = directions.force(multiplier);
  contacts.force(k, i) = {force.x, force.y, force.z, 0};
  VertexMerit<float> left;
  left.add(law.violation(gap, multiplier, friction));
  return left.worst;
}

/// Solves for the multipliers of all contacts, from the free motion that those at hand leave: to a
/// thousandth of a vertex's way, or to the tolerance where that is larger. Sets the reaction. Returns the
/// worst that is left of the laws at the gaps of the iterate, of the thread's vertices [m].
template <Keeping keeping>
__device__ __noinline__ float solve_multipliers(const ProjectiveWork<keeping>& w, const StepProblem& step,
                                                float back) {
  constexpr float share = 1e-3f;
  const MultiplierSettings& settings = w.numbers.multipliers;
  const VertexContacts contacts(w.memory, step.size, step.obstacles.count);
  const SolvedWay<keeping> way(w, back);
  float left = 0;
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const SolveVertex vertex = way.vertices[i];
    if (vertex.scale == 0) continue;
    int count = 0, last = 0;
    for (int k = 0; k < contacts.obstacles; ++k)
      if (contacts.touching(k, i) != 0) {
        ++count;
        last = k;
      }
    if (count > 0) {
      const Vector3<float> free = way(vertex);
      const float tolerance = std::fmax(static_cast<float>(settings.tolerance), share * norm(free));
      const double inverse_mass = 1 / step.mass(w.tables(), i);
      const float own = count == 1 ? meet_one(step, contacts, settings, last, i,
                                              static_cast<float>(inverse_mass), tolerance, free)
                                   : meet_several(step, contacts, settings, i, inverse_mass, tolerance, free);
      left = worse_of(left, own);
    }
    set_reaction(contacts, i);
  }
  return left;
}

}  // namespace flash::sim::cuda
