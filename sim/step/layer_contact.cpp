#include "sim/step/layer_contact.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "sim/law/edge_crossing.h"
#include "sim/law/vertex_contact.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {

using data::Points;

namespace {

constexpr double far = 1e300;         // [m]
constexpr double margin_share = 0.5;  ///< of the thickness, that a vertex may move before a new search

void gather(const Points& x, const std::array<int, 4>& vertices, Vector3<double>* places) {
  for (int k = 0; k < 4; ++k) places[k] = vector3(x, vertices[k]);
}

/// Whether two features may be nearer than `reach`, by their boxes.
bool may_come_near(PairKind kind, const Vector3<double>* x, double reach) {
  const int split = kind == PairKind::vertex_face ? 1 : 2;
  for (int axis = 0; axis < 3; ++axis) {
    double low[2] = {far, far}, high[2] = {-far, -far};
    for (int k = 0; k < 4; ++k) {
      const int feature = k < split ? 0 : 1;
      low[feature] = std::min(low[feature], x[k][axis]);
      high[feature] = std::max(high[feature], x[k][axis]);
    }
    if (low[0] - high[1] >= reach || low[1] - high[0] >= reach) return false;
  }
  return true;
}

auto key_of(PairKind kind, const std::array<int, 4>& vertices) {
  return std::tuple(kind == PairKind::edge_edge, vertices);
}

const PairBristle* find_bristle(const std::vector<PairBristle>& bristles, PairKind kind,
                                const std::array<int, 4>& vertices) {
  const auto key = key_of(kind, vertices);
  const auto at =
      std::lower_bound(bristles.begin(), bristles.end(), key, [](const PairBristle& bristle, const auto& k) {
        return std::tuple(bristle.edges, bristle.vertices) < k;
      });
  return at != bristles.end() && std::tuple(at->edges, at->vertices) == key ? &*at : nullptr;
}

/// The deflection of the bristles of a touch were its vertices at `positions`, along its plane [m].
Vector3<double> deflection(const LayerFriction& touch, const Points& start, const Points& positions) {
  Vector3<double> moved = touch.bristle;
  for (int k = 0; k < 4; ++k) {
    const int i = touch.vertices[k];
    moved = moved + touch.weights[k] * (vector3(positions, i) - vector3(start, i));
  }
  return along_plane(touch.normal, moved);
}

void add_row(Points& rows, int i, const Vector3<double>& v) {
  rows(i, 0) += v.x;
  rows(i, 1) += v.y;
  rows(i, 2) += v.z;
}

}  // namespace

Symmetric3 stiffness_of(const LayerFriction& friction, double time_step) {
  Symmetric3 turns = identity3() - square(friction.normal);
  if (friction.slip > bristle_length(time_step)) turns = turns - square(friction.slip_direction);
  return (friction.bound / friction_length(friction.slip, time_step)) * turns;
}

LayerStep::LayerStep(PairSurface& surface, const Environment& environment, double time_step)
    : surface_(surface),
      environment_(environment),
      settings_(*environment.self_contact),
      time_step_(time_step),
      carried_(static_cast<std::size_t>(environment.state.positions.rows()), false) {}

void LayerStep::set_carried(const std::vector<bool>& carried) {
  carried_ = carried;
  near_.boxes.clear();
}

bool LayerStep::cover(const Candidates& candidates, const Points& from, const Points& to) {
  const std::vector<Bounds>& boxes = candidates.boxes;
  const auto covers = [&](const Points& x, Eigen::Index i) {
    const Eigen::Array3d place = x.row(i).transpose().array();
    return (boxes[i].low <= place).all() && (place <= boxes[i].high).all();
  };
  bool all = !boxes.empty();
  for (Eigen::Index i = 0; i < from.rows() && all; ++i) all = covers(from, i) && covers(to, i);
  return all;
}

void LayerStep::search(const Points& from, const Points& to, double margin, Candidates& candidates) {
  candidates.boxes.resize(static_cast<std::size_t>(from.rows()));
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    const Eigen::Array3d a = from.row(i).transpose().array(), b = to.row(i).transpose().array();
    candidates.boxes[i] = {a.min(b) - margin, a.max(b) + margin};
  }
  find_candidates(surface_, candidates.boxes, settings_.thickness, carried_, candidates.pairs);
  ++counts_.searches;
  counts_.pairs = std::max(counts_.pairs, static_cast<long>(candidates.pairs.size()));
}

void LayerStep::add_forces(const Points& positions, LayerContact& contact, Points& force) {
  if (!cover(near_, positions, positions))
    search(positions, positions, margin_share * settings_.thickness, near_);
  contact.touches.clear();
  contact.energy = 0;
  contact.closest = far;
  for (const CandidatePair& pair : near_.pairs) {
    Vector3<double> x[4];
    gather(positions, pair.vertices, x);
    if (!may_come_near(pair.kind, x, pair.thickness)) continue;
    const NearestPoints nearest = nearest_points(pair.kind, x);
    contact.closest = std::min(contact.closest, nearest.distance);
    const LayerResponse response = layer_response(pair.thickness, settings_.pressure, nearest.distance);
    if (response.force == 0) continue;
    const Crossing crossing = pair.kind == PairKind::edge_edge ? crossing_of(x) : Crossing{};
    const double area = pair.area * crossing.factor, normal_force = area * response.force;
    contact.energy += area * response.energy;
    for (int k = 0; k < 4; ++k)
      add_row(force, pair.vertices[k], (-nearest.weights[k] * normal_force) * nearest.normal);
    if (crossing.factor < 1) {
      const double energy = pair.area * response.energy;
      for (int k = 0; k < 4; ++k)
        add_row(force, pair.vertices[k],
                (k % 2 == 0 ? -energy : energy) * (k < 2 ? crossing.by_first : crossing.by_second));
    }
    contact.touches.push_back(
        {pair.kind, pair.vertices, nearest, pair.area, crossing.factor, response, normal_force});
  }
  frictions_of(contact.touches, contact.frictions);
  const Points& start = environment_.state.positions;
  for (LayerFriction& friction : contact.frictions) {
    const Vector3<double> slip = deflection(friction, start, positions);
    friction.slip = norm(slip);
    friction.slip_direction = (1 / friction_length(friction.slip, time_step_)) * slip;
    for (int k = 0; k < 4; ++k)
      add_row(force, friction.vertices[k], (friction.weights[k] * friction.bound) * friction.slip_direction);
  }
}

void LayerStep::frictions_of(const std::vector<LayerTouch>& touches,
                             std::vector<LayerFriction>& frictions) const {
  frictions.clear();
  const double length = bristle_length(time_step_);
  for (const LayerTouch& touch : touches) {
    LayerFriction friction{.kind = touch.kind,
                           .vertices = touch.vertices,
                           .normal = touch.nearest.normal,
                           .bound = settings_.friction * touch.normal_force};
    std::copy(touch.nearest.weights, touch.nearest.weights + 4, friction.weights);
    if (const PairBristle* bristle =
            find_bristle(environment_.state.pair_bristles, touch.kind, touch.vertices))
      friction.bristle = length * vector3(bristle->share);
    frictions.push_back(friction);
  }
}

double LayerStep::energy(const Points& positions) {
  LayerContact contact;
  Points force = Points::Zero(positions.rows(), 3);
  add_forces(positions, contact, force);
  return contact.energy;
}

double LayerStep::friction_potential(const LayerContact& contact, const Points& positions) const {
  double potential = 0;
  for (const LayerFriction& friction : contact.frictions)
    potential +=
        friction.bound *
        friction_energy(norm(deflection(friction, environment_.state.positions, positions)), time_step_);
  return potential;
}

double LayerStep::bristle_energy(const LayerContact& contact) const {
  double energy = 0;
  for (const LayerFriction& friction : contact.frictions)
    energy += friction.bound * friction_energy(norm(friction.bristle), time_step_);
  return energy;
}

double LayerStep::free_share(const Points& from, const Points& to) {
  const bool is_near = cover(near_, from, to);
  if (!is_near) search(from, to, 0, way_);
  const Eigen::VectorXd lengths = (to - from).rowwise().norm();
  double share = 1;
  for (const CandidatePair& pair : (is_near ? near_ : way_).pairs) {
    const auto& v = pair.vertices;
    Vector3<double> x[4], move[4];
    gather(from, v, x);
    // What is farther apart than both can go is free.
    const double longest =
        pair.kind == PairKind::vertex_face
            ? lengths[v[0]] + std::max({lengths[v[1]], lengths[v[2]], lengths[v[3]]})
            : std::max(lengths[v[0]], lengths[v[1]]) + std::max(lengths[v[2]], lengths[v[3]]);
    if (!may_come_near(pair.kind, x, share * longest + pair.thickness)) continue;
    for (int k = 0; k < 4; ++k) move[k] = share * (vector3(to, v[k]) - x[k]);
    ++counts_.ways;
    share *= sim::free_share(pair.kind, x, move, pair.thickness);
  }
  return share;
}

std::vector<PairBristle> LayerStep::bristles_at_end(const LayerContact& contact) const {
  std::vector<PairBristle> bristles;
  for (const LayerFriction& friction : contact.frictions)
    bristles.push_back(
        {friction.vertices, friction.kind == PairKind::edge_edge, vector3d(friction.slip_direction)});
  std::sort(bristles.begin(), bristles.end(), [](const PairBristle& a, const PairBristle& b) {
    return std::tuple(a.edges, a.vertices) < std::tuple(b.edges, b.vertices);
  });
  return bristles;
}

}  // namespace flash::sim
