#include "sim/step/feasible_positions.h"

#include <algorithm>

#include "sim/law/contact_law.h"

namespace flash::sim {

using data::Points;
using Eigen::Vector3d;

namespace {

constexpr double closed_share = 0.01;  ///< share of the gap at the iterate that counts as closed
constexpr double same_surface = 0.5;   ///< cosine between the normals of a surface, before its end
constexpr int projection_rounds = 40, slip_rounds = 10;

/// Whether the vertex is to land on the surface that held it at the iterate. The step has to be long enough
/// to bring it down, and must not have taken it beyond the end of that surface.
bool lands(const Touch& touch, const SurfaceGap<double>& gap) {
  return touch.holds && gap.distance > 0 && (touch.touches() || gap.distance <= closed_share * touch.gap) &&
         dot(gap.normal, vector3(touch.normal)) > same_surface;
}

bool stays(const ContactStep& step, std::span<const Touch> touches, const Points& positions, int i) {
  for (size_t k = 0; k < step.obstacles.size(); ++k) {
    if ((touches.empty() || !touches[k].holds) && step.is_far(static_cast<int>(k), positions, i)) continue;
    const SurfaceGap<double> gap = step.gap(static_cast<int>(k), positions, i);
    if (!(gap.distance >= 0) || (!touches.empty() && lands(touches[k], gap))) return false;
  }
  return true;
}

/// Moves vertex i by the shortest way out of all obstacles, and onto those where it is to land. Exact for
/// planes at once; round surfaces and faces that change take a few rounds.
void project_vertex(const ContactStep& step, std::span<const Touch> touches, Points& positions, int i) {
  if (stays(step, touches, positions, i)) return;
  const size_t count = step.obstacles.size();
  std::vector<Vector3<double>> normals(count);
  std::vector<double> depths(count), shares(count);
  for (int round = 0; round < projection_rounds; ++round) {
    double moved = 0;
    for (size_t k = 0; k < count; ++k) {
      const SurfaceGap<double> gap = step.gap(static_cast<int>(k), positions, i);
      normals[k] = gap.normal;
      depths[k] = -gap.distance;
      if (touches.empty() || !lands(touches[k], gap)) continue;
      positions.row(i) -= gap.distance * vector3d(gap.normal).transpose();
      moved = std::max(moved, gap.distance);
      depths[k] = 0;
    }
    if (moved == 0 && std::all_of(depths.begin(), depths.end(), [](double depth) { return depth <= 0; }))
      return;
    solve_lcp(static_cast<int>(count), normals.data(), normals.data(), depths.data(), shares.data());
    Vector3<double> way{};
    for (size_t k = 0; k < count; ++k) way = way + shares[k] * normals[k];
    positions.row(i) += vector3d(way).transpose();
    if (std::max(moved, norm(way)) <= resting_slip) return;
  }
}

/// Takes back a slip against `direction`.
void stop_turned_slip(const ContactStep& step, std::span<const Touch> touches, const Vector3d& direction,
                      Points& positions, int i) {
  Vector3d slip = slip_of(step, positions, i, touches);
  if (slip.dot(direction) >= 0) return;
  // The way back leaves a round surface: the vertex is projected on it, and the slip taken back again.
  for (int round = 0; round < slip_rounds && slip.norm() > resting_slip; ++round) {
    positions.row(i) -= slip.transpose();
    project_vertex(step, touches, positions, i);
    slip = slip_of(step, positions, i, touches);
  }
}

}  // namespace

void project_to_feasible(const ContactStep& step, const ContactSet& contacts, Points& positions) {
  std::vector<double> clearance;
  find_clearance(step, positions, clearance);
  for (int i = 0; i < positions.rows(); ++i) {
    const int k = contacts.place[i];
    if (k < 0) {
      if (!(clearance[i] >= 0)) project_vertex(step, {}, positions, i);
      continue;
    }
    const VertexConstraint& constraint = contacts.constraints[k];
    if (constraint.freedom == Freedom::held) continue;
    const std::span<const Touch> touches = contacts.touches_of(k);
    project_vertex(step, touches, positions, i);
    if (constraint.freedom == Freedom::slip)
      stop_turned_slip(step, touches, constraint.slip_direction, positions, i);
  }
}

}  // namespace flash::sim
