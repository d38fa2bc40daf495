#include "sim/vertex_constraint.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace flash::sim {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double resting = 1e-13;  ///< slip up to which a vertex has not moved: rounding of a position [m]
constexpr double smoothing =
    1e-8;  ///< slip at which friction is 0.7 of its bound, for a smooth start of sliding [m]

/// Of vertex i against every obstacle. Keeps the memory of `touches`.
void find_touches(const ContactStep& step, const data::Points& positions, int i,
                  std::vector<Touch>& touches) {
  touches.resize(step.environment.obstacles.size());
  for (size_t k = 0; k < touches.size(); ++k) {
    const Gap gap = step.gap(static_cast<int>(k), positions, i);
    touches[k] = {.obstacle = static_cast<int>(k),
                  .gap = gap.distance,
                  .sunk = gap.sunk,
                  .normal = gap.normal,
                  .curved = gap.curved};
  }
}

double friction_of(const Environment& environment, const Touch& touch) {
  const Obstacle& obstacle = environment.obstacles[touch.obstacle];
  return obstacle.friction >= 0 ? obstacle.friction : environment.material.friction;
}

/// Displacement since the start of the step along the surfaces that hold the vertex, against them: against
/// their mean by mu lambda_n where there are several [m].
Vector3d slip_of(const ContactStep& step, const VertexConstraint& constraint, const data::Points& positions,
                 int i) {
  Vector3d surfaces_moved = Vector3d::Zero();
  double weights = 0;
  std::array<Vector3d, 3> normals;
  size_t count = 0;
  for (const Touch& touch : constraint.touches) {
    if (!touch.holds) continue;
    const Gap gap = step.gap(touch.obstacle, positions, i);
    const double weight = friction_of(step.environment, touch) * touch.normal_force + 1e-300;
    surfaces_moved += weight * gap.surface_moved;
    weights += weight;
    normals[count++] = gap.normal;
  }
  const Vector3d against =
      (positions.row(i) - step.environment.state.positions.row(i)).transpose() - surfaces_moved / weights;
  if (count == 1) return against - normals[0] * normals[0].dot(against);
  if (count > 2) return Vector3d::Zero();
  const Vector3d edge = normals[0].cross(normals[1]).normalized();
  return edge * edge.dot(against);
}

/// Length of a slip as friction takes it, smooth where it starts [m].
double smooth_length(double length) { return std::sqrt(length * length + smoothing * smoothing); }

/// Fills in the vertex's own slip against each touching surface. Returns the longest [m].
double find_slips(const ContactStep& step, const data::Points& positions, int i,
                  std::vector<Touch>& touches) {
  double longest = 0;
  for (Touch& touch : touches) {
    if (touch.gap > touching_gap) continue;
    const Vector3d moved = (positions.row(i) - step.environment.state.positions.row(i)).transpose() -
                           step.gap(touch.obstacle, positions, i).surface_moved;
    const Vector3d slip = moved - touch.normal * touch.normal.dot(moved);
    longest = std::max(longest, slip.norm());
    touch.slip = smooth_length(slip.norm());
    touch.slip_direction = slip / touch.slip;
  }
  return longest;
}

/// Normal forces of surfaces that each rub against their own slip: the reaction is the sum of
/// lambda_k (n_k - mu_k d_k).
std::vector<double> rubbing_forces(const Environment& environment, const std::vector<Touch>& touches,
                                   const std::vector<bool>& eligible, const Vector3d& needed) {
  std::vector<Vector3d> normals, directions;
  std::vector<double> along, forces(touches.size(), 0.0);
  for (size_t k = 0; k < touches.size(); ++k) {
    if (!eligible[k]) continue;
    normals.push_back(touches[k].normal);
    directions.push_back(touches[k].normal -
                         friction_of(environment, touches[k]) * touches[k].slip_direction);
    along.push_back(touches[k].normal.dot(needed));
  }
  const std::vector<double> found = complementary(normals, directions, along);
  for (size_t k = 0, next = 0; k < touches.size(); ++k)
    if (eligible[k]) forces[k] = found[next++];
  return forces;
}

/// How the friction force of slipping surfaces changes with the force on the vertex: the sum of mu_k d_k
/// l_k^T, where l_k . f is the normal force of surface k under the force f.
Matrix3d coupling_of(const Environment& environment, const std::vector<Touch>& touches) {
  Matrix3d normals = Matrix3d::Zero(), rubs = Matrix3d::Zero(), gram = Matrix3d::Identity();
  int count = 0;
  for (const Touch& touch : touches) {
    if (!touch.holds) continue;
    normals.col(count) = touch.normal;
    rubs.col(count++) = friction_of(environment, touch) * touch.slip_direction;
  }
  gram.topLeftCorner(count, count) =
      normals.leftCols(count).transpose() * (normals.leftCols(count) - rubs.leftCols(count));
  return rubs * gram.inverse() * normals.transpose();
}

}  // namespace

Matrix3d along_surfaces(const std::vector<Touch>& touches) {
  std::array<Vector3d, 3> normals;
  size_t count = 0;
  for (const Touch& touch : touches)
    if (touch.holds) normals[count++] = touch.normal;
  if (count > 2) return Matrix3d::Zero();
  if (count == 1) return Matrix3d::Identity() - normals[0] * normals[0].transpose();
  const Vector3d edge = normals[0].cross(normals[1]).normalized();
  return edge * edge.transpose();
}

std::vector<double> complementary(const std::vector<Vector3d>& normals,
                                  const std::vector<Vector3d>& directions, const std::vector<double>& b) {
  const int count = static_cast<int>(normals.size());
  std::vector<double> best(normals.size(), 0.0);
  double largest = 0, best_violation = 0;
  for (const double each : b) {
    largest = std::max(largest, std::abs(each));
    best_violation = std::max(best_violation, each);
  }
  const double rounding = 1e-12 * largest;
  // Of one, two or three faces; in space no more are independent.
  const auto try_faces = [&](const std::array<int, 3>& faces, int size) {
    Matrix3d gram = Matrix3d::Identity();
    Vector3d right = Vector3d::Zero();
    for (int r = 0; r < size; ++r) {
      right[r] = b[faces[r]];
      for (int c = 0; c < size; ++c) gram(r, c) = normals[faces[r]].dot(directions[faces[c]]);
    }
    // Faces that point the same way, or against each other.
    if (std::abs(gram.determinant()) < 1e-6) return;
    const Vector3d x = gram.inverse() * right;
    if (x.head(size).minCoeff() < 0) return;
    Vector3d sum = Vector3d::Zero();
    for (int r = 0; r < size; ++r) sum += x[r] * directions[faces[r]];
    double violation = 0;
    for (int k = 0; k < count; ++k) violation = std::max(violation, b[k] - normals[k].dot(sum));
    if (violation >= best_violation - rounding) return;
    best_violation = violation;
    std::fill(best.begin(), best.end(), 0.0);
    for (int r = 0; r < size; ++r) best[faces[r]] = x[r];
  };
  for (int i = 0; i < count; ++i) {
    try_faces({i, 0, 0}, 1);
    for (int j = i + 1; j < count; ++j) {
      try_faces({i, j, 0}, 2);
      for (int k = j + 1; k < count; ++k) try_faces({i, j, k}, 3);
    }
  }
  return best;
}

std::vector<double> normal_forces(const std::vector<Touch>& touches, const std::vector<bool>& eligible,
                                  const Vector3d& needed) {
  std::vector<double> forces(touches.size(), 0.0);
  std::vector<size_t> those;
  for (size_t k = 0; k < touches.size(); ++k)
    if (eligible[k]) those.push_back(k);
  if (those.size() == 1) {
    forces[those[0]] = std::max(0.0, touches[those[0]].normal.dot(needed));
    return forces;
  }
  std::vector<Vector3d> normals;
  std::vector<double> along;
  for (const size_t k : those) {
    normals.push_back(touches[k].normal);
    along.push_back(touches[k].normal.dot(needed));
  }
  const std::vector<double> found = complementary(normals, normals, along);
  for (size_t k = 0; k < those.size(); ++k) forces[those[k]] = found[k];
  return forces;
}

ContactStep::ContactStep(const Environment& environment_in, double time_step_in, double exit_speed_in)
    : environment(environment_in),
      time(environment_in.state.time + time_step_in),
      time_step(time_step_in),
      exit_speed(exit_speed_in),
      motions(obstacle_motions(environment_in, environment_in.state.time, time)) {}

std::vector<VertexConstraint> begin_step(const ContactStep& step, data::Points& positions) {
  const Environment& environment = step.environment;
  std::vector<VertexConstraint> constraints(environment.state.positions.rows());
  for (const FixedVertex& support : environment.fixed) {
    VertexConstraint& constraint = constraints[support.vertex];
    constraint.hold = Hold::fixed;
    for (int axis = 0; axis < 3; ++axis) {
      if (!support.axes[axis]) continue;
      constraint.free(axis, axis) = 0;
      positions(support.vertex, axis) = support.position[axis];
    }
  }
  for (size_t k = 0; k < environment.grasps.size(); ++k) {
    const Grasp& grasp = environment.grasps[k];
    const data::Points& offsets = environment.state.grasp_offsets[k];
    if (offsets.rows() == 0) continue;
    const Eigen::Isometry3d pose = data::pose_at(grasp.gripper, step.time);
    const double closed =
        grasp.closing_time > 0 ? std::clamp((step.time - grasp.from) / grasp.closing_time, 0.0, 1.0) : 1.0;
    const double blend = closed * closed * (3 - 2 * closed);
    for (size_t v = 0; v < grasp.vertices.size(); ++v) {
      Vector3d offset = offsets.row(v);
      if (grasp.targets.rows() > 0) offset += blend * (grasp.targets.row(v).transpose() - offset);
      VertexConstraint& constraint = constraints[grasp.vertices[v]];
      constraint.hold = Hold::fixed;
      constraint.grasp = static_cast<int>(k);
      constraint.free.setZero();
      positions.row(grasp.vertices[v]) = pose * offset;
    }
  }
  project_to_feasible(step, constraints, positions);
  return constraints;
}

void update_contacts(const ContactStep& step, const data::Points& positions, const data::Points& force,
                     std::vector<VertexConstraint>& constraints) {
  for (size_t i = 0; i < constraints.size(); ++i) {
    VertexConstraint& constraint = constraints[i];
    const Vector3d needed = force.row(i);
    if (constraint.hold == Hold::fixed) {
      constraint.reaction = needed - constraint.free * needed;
      continue;
    }
    auto& touches = constraint.touches;
    find_touches(step, positions, static_cast<int>(i), touches);
    // Of a free one all but the touches is as it was made: most of them are, and it is much to write.
    if (constraint.hold != Hold::free) {
      VertexConstraint released;
      released.touches.swap(touches);
      std::swap(constraint, released);
    }
    const auto on_surface = [](const Touch& touch) { return touch.gap <= touching_gap; };
    if (std::none_of(touches.begin(), touches.end(), on_surface)) continue;
    std::vector<bool> eligible(touches.size());
    std::transform(touches.begin(), touches.end(), eligible.begin(), on_surface);
    const bool slipped = find_slips(step, positions, static_cast<int>(i), touches) > resting;
    const bool several = std::count(eligible.begin(), eligible.end(), true) > 1;
    const std::vector<double> normal = slipped && several
                                           ? rubbing_forces(step.environment, touches, eligible, needed)
                                           : normal_forces(touches, eligible, needed);
    int held = 0;
    for (size_t k = 0; k < touches.size(); ++k) {
      touches[k].holds = normal[k] > 0;
      touches[k].normal_force = normal[k];
      if (!touches[k].holds) continue;
      constraint.friction_bound += friction_of(step.environment, touches[k]) * normal[k];
      ++held;
    }
    if (held == 0) continue;

    const double bound = constraint.friction_bound;
    const Matrix3d along = along_surfaces(touches);
    const Vector3d needed_tangential = along * needed;
    if (!slipped && needed_tangential.norm() <= bound) {
      constraint.hold = Hold::stick;
      constraint.free.setZero();
      constraint.reaction = needed;
      for (Touch& touch : touches)
        if (touch.holds && bound > 0)
          touch.friction =
              friction_of(step.environment, touch) * touch.normal_force / bound * needed_tangential;
      continue;
    }
    constraint.hold = Hold::slip;
    constraint.free = along;
    if (slipped) {
      const Vector3d slip = slip_of(step, constraint, positions, static_cast<int>(i));
      constraint.slip_direction = slip / smooth_length(slip.norm());
      constraint.friction_coupling = coupling_of(step.environment, touches);
    } else {
      constraint.slip_direction = -needed_tangential / needed_tangential.norm();
    }
    for (Touch& touch : touches) {
      if (!touch.holds) continue;
      const double own_bound = friction_of(step.environment, touch) * touch.normal_force;
      const Vector3d& direction = slipped ? touch.slip_direction : constraint.slip_direction;
      touch.friction = -own_bound * direction;
      constraint.reaction += touch.normal_force * touch.normal + touch.friction;
      if (slipped)
        constraint.slip_stiffness += own_bound / touch.slip *
                                     (Matrix3d::Identity() - touch.normal * touch.normal.transpose() -
                                      direction * direction.transpose());
    }
  }
}

namespace {

/// Moves vertex i by the shortest way out of all obstacles, and onto those where it is to land. Exact for
/// planes at once; round surfaces and faces that change take a few rounds.
void project_vertex(const ContactStep& step, const VertexConstraint& constraint, data::Points& positions,
                    int i) {
  const size_t count = step.environment.obstacles.size();
  std::vector<Vector3d> normals(count);
  std::vector<double> depths(count);
  for (int round = 0; round < 40; ++round) {
    double moved = 0;
    for (size_t k = 0; k < count; ++k) {
      const Gap gap = step.gap(static_cast<int>(k), positions, i);
      normals[k] = gap.normal;
      depths[k] = -gap.distance;
      // A vertex that is to land does so where the step is long enough to bring it down.
      const bool lands =
          !constraint.touches.empty() && constraint.touches[k].holds && gap.distance > 0 &&
          (constraint.touches[k].gap <= touching_gap || gap.distance <= 0.01 * constraint.touches[k].gap);
      if (!lands) continue;
      positions.row(i) -= gap.distance * gap.normal.transpose();
      moved = std::max(moved, gap.distance);
      depths[k] = 0;
    }
    if (moved == 0 && std::all_of(depths.begin(), depths.end(), [](double depth) { return depth <= 0; }))
      return;
    if (count == 1) {
      if (depths[0] > 0) {
        positions.row(i) += depths[0] * normals[0].transpose();
        moved = depths[0];
      }
    } else {
      const std::vector<double> x = complementary(normals, normals, depths);
      Vector3d way = Vector3d::Zero();
      for (size_t k = 0; k < count; ++k) way += x[k] * normals[k];
      positions.row(i) += way.transpose();
      moved = std::max(moved, way.norm());
    }
    if (moved <= resting) return;
  }
}

}  // namespace

void project_to_feasible(const ContactStep& step, const std::vector<VertexConstraint>& constraints,
                         data::Points& positions) {
  if (step.environment.obstacles.empty()) return;
  for (size_t i = 0; i < constraints.size(); ++i) {
    const VertexConstraint& constraint = constraints[i];
    if (constraint.hold == Hold::fixed) continue;
    project_vertex(step, constraint, positions, static_cast<int>(i));
    if (constraint.hold != Hold::slip) continue;
    Vector3d slip = slip_of(step, constraint, positions, static_cast<int>(i));
    if (slip.dot(constraint.slip_direction) >= 0) continue;
    // On a round surface the way back along it leaves it: back on it, and again.
    for (int round = 0; round < 10 && slip.norm() > resting; ++round) {
      positions.row(i) -= slip.transpose();
      project_vertex(step, constraint, positions, static_cast<int>(i));
      slip = slip_of(step, constraint, positions, static_cast<int>(i));
    }
  }
}

double friction_potential(const ContactStep& step, const std::vector<VertexConstraint>& constraints,
                          const data::Points& positions) {
  double potential = 0;
  for (size_t i = 0; i < constraints.size(); ++i) {
    const VertexConstraint& constraint = constraints[i];
    if (constraint.friction_bound == 0) continue;
    for (const Touch& touch : constraint.touches) {
      if (!touch.holds) continue;
      const Gap gap = step.gap(touch.obstacle, positions, static_cast<int>(i));
      const Vector3d moved =
          (positions.row(i) - step.environment.state.positions.row(i)).transpose() - gap.surface_moved;
      const double slip = (moved - gap.normal * gap.normal.dot(moved)).norm();
      potential += friction_of(step.environment, touch) * touch.normal_force *
                   (constraint.slip_stiffness.isZero(0) ? slip : smooth_length(slip));
    }
  }
  return potential;
}

Penetration deepest_held(const ContactStep& step, const std::vector<VertexConstraint>& constraints,
                         const data::Points& positions) {
  Penetration deepest;
  for (size_t i = 0; i < constraints.size(); ++i) {
    if (constraints[i].hold != Hold::fixed) continue;
    for (size_t k = 0; k < step.motions.size(); ++k) {
      const Gap gap = step.gap(static_cast<int>(k), positions, static_cast<int>(i));
      const double depth = gap.sunk - gap.distance;
      if (depth > deepest.depth) deepest = {depth, static_cast<int>(i), static_cast<int>(k)};
    }
  }
  return deepest;
}

}  // namespace flash::sim
