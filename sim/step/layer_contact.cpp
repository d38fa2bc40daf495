#include "sim/step/layer_contact.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "sim/law/vertex_contact.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {

using data::Points;

namespace {

constexpr double far = 1e300;           // [m]
constexpr double meeting_share = 1e-3;  ///< of the thickness: boxes that are farther apart do not meet
constexpr double margin_share = 0.5;    ///< of the thickness, that a vertex may move before a new search

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

/// A factor that takes parallel edges out smoothly, and its derivatives by the edges. The nearest points of
/// parallel edges jump; their ends meet the faces beside them anyway (Li et al. 2020).
struct Crossing {
  double factor = 1;
  Vector3<double> by_first{}, by_second{};
};

Crossing crossing_of(const Vector3<double>* x) {
  constexpr double least_squared_sine = 1e-2;
  const Vector3<double> u = x[1] - x[0], v = x[3] - x[2];
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
  const double q = (1 - uv * uv / (uu * vv)) / least_squared_sine;
  if (q >= 1) return {};
  // The derivative of the squared sine by u: -2 (u.v) / (uu vv) (v - u (u.v) / uu).
  const double slope = (2 - 2 * q) * -2 * uv / (uu * vv * least_squared_sine);
  return {q * (2 - q), slope * (v - (uv / uu) * u), slope * (u - (uv / vv) * v)};
}

/// What touches, candidates and bristles are in the order of.
auto key_of(const auto& pair) { return std::tuple(pair.kind == PairKind::edge_edge, pair.vertices); }
auto key_of(const PairBristle& bristle) { return std::tuple(bristle.edges, bristle.vertices); }

/// The places of one list, whose keys ascend, at keys that ascend as well.
template <typename Entry>
class AscendingPlaces {
 public:
  explicit AscendingPlaces(const std::vector<Entry>& list) : next_(list.begin()), end_(list.end()) {}

  const Entry* find(const auto& key) {
    while (next_ != end_ && key_of(*next_) < key) ++next_;
    return next_ != end_ && key_of(*next_) == key ? &*next_ : nullptr;
  }

 private:
  typename std::vector<Entry>::const_iterator next_, end_;
};

/// The deflection of the bristles of a touch were its vertices at `positions`, along its plane [m].
Vector3<double> deflection(const LayerTouch& touch, const Points& start, const Points& positions) {
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

Symmetric3 stiffness_of(const LayerTouch& touch, double friction, double time_step) {
  const Symmetric3 normal = square(touch.normal);
  Symmetric3 turns = identity3() - normal;
  if (touch.slip > bristle_length(time_step))
    turns = turns - symmetric_product(touch.dual, touch.slip_direction);
  return touch.stiffness * normal +
         (friction * touch.normal_force / friction_length(touch.slip, time_step)) * turns;
}

Vector3<double> friction_coupling_of(const LayerTouch& touch, double friction) {
  return (friction * touch.stiffness) * touch.slip_direction;
}

LayerStep::LayerStep(LayerMemory& memory, const Environment& environment, double time_step,
                     const std::vector<bool>& carried)
    : memory_(memory),
      environment_(environment),
      settings_(*environment.self_contact),
      time_step_(time_step),
      other_pairs_(memory.carried != carried || memory.thickness != settings_.thickness ||
                   memory.pressure != settings_.pressure) {
  if (!other_pairs_) return;
  memory_.carried = carried;
  memory_.thickness = settings_.thickness;
  memory_.pressure = settings_.pressure;
  memory_.near.boxes.clear();
}

bool LayerStep::cover(const BoxedPairs& candidates, const Points& from, const Points& to) {
  const std::vector<Bounds>& boxes = candidates.boxes;
  const auto covers = [&](const Points& x, Eigen::Index i) {
    const Eigen::Array3d place = x.row(i).transpose().array();
    return (boxes[i].low <= place).all() && (place <= boxes[i].high).all();
  };
  bool all = !boxes.empty();
  for (Eigen::Index i = 0; i < from.rows() && all; ++i) all = covers(from, i) && covers(to, i);
  return all;
}

void LayerStep::search(const Points& from, const Points& to, double margin, double reach,
                       BoxedPairs& candidates) {
  candidates.boxes.resize(static_cast<std::size_t>(from.rows()));
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    const Eigen::Array3d a = from.row(i).transpose().array(), b = to.row(i).transpose().array();
    candidates.boxes[i] = {a.min(b) - margin, a.max(b) + margin};
  }
  find_candidates(memory_.surface, candidates.boxes, reach, memory_.carried, candidates.pairs);
  ++counts_.searches;
  counts_.pairs = std::max(counts_.pairs, static_cast<long>(candidates.pairs.size()));
}

void LayerStep::add_forces(const Points& positions, LayerContact& contact, Points& force) {
  BoxedPairs& near = memory_.near;
  if (!cover(near, positions, positions)) {
    search(positions, positions, margin_share * settings_.thickness, settings_.thickness, near);
    std::sort(near.pairs.begin(), near.pairs.end(),
              [](const CandidatePair& a, const CandidatePair& b) { return key_of(a) < key_of(b); });
  }
  contact.touches.clear();
  contact.energy = 0;
  contact.closest = far;
  const double length = bristle_length(time_step_);
  AscendingPlaces bristles(environment_.state.pair_bristles);
  const Points& start = environment_.state.positions;
  for (const CandidatePair& pair : near.pairs) {
    Vector3<double> x[4];
    gather(positions, pair.vertices, x);
    if (!may_come_near(pair.kind, x, pair.thickness)) continue;
    const NearestPoints nearest = nearest_points(pair.kind, x);
    contact.closest = std::min(contact.closest, nearest.distance);
    const LayerResponse response = this->response(pair, nearest.distance);
    if (response.force == 0 && response.energy == 0) continue;
    const Crossing crossing = pair.kind == PairKind::edge_edge ? crossing_of(x) : Crossing{};
    const double area = pair.area * crossing.factor;
    LayerTouch touch{.kind = pair.kind,
                     .vertices = pair.vertices,
                     .normal_force = area * response.force,
                     .stiffness = area * response.stiffness,
                     .normal = nearest.normal};
    std::copy(nearest.weights, nearest.weights + 4, touch.weights);
    if (const PairBristle* bristle = bristles.find(key_of(pair))) {
      touch.dual = vector3(bristle->share);
      touch.bristle = length * touch.dual;
    }
    const Vector3<double> slip = deflection(touch, start, positions);
    touch.slip = norm(slip);
    touch.slip_direction = (1 / friction_length(touch.slip, time_step_)) * slip;
    contact.energy += area * response.energy;
    const Vector3<double> needed =
        settings_.friction * touch.normal_force * touch.slip_direction - touch.normal_force * touch.normal;
    for (int k = 0; k < 4; ++k) add_row(force, pair.vertices[k], touch.weights[k] * needed);
    if (crossing.factor < 1) {
      const double energy = pair.area * response.energy;
      touch.couple = energy * cross(crossing.by_first, x[1] - x[0]);
      for (int k = 0; k < 4; ++k)
        add_row(force, pair.vertices[k],
                (k % 2 == 0 ? -energy : energy) * (k < 2 ? crossing.by_first : crossing.by_second));
    }
    contact.touches.push_back(touch);
  }
}

LayerResponse LayerStep::response(const CandidatePair& pair, double distance) const {
  return layer_response(pair.thickness, settings_.pressure, distance);
}

double LayerStep::energy(const Points& positions) {
  LayerContact contact;
  Points force = Points::Zero(positions.rows(), 3);
  add_forces(positions, contact, force);
  return contact.energy;
}

double LayerStep::friction_potential(const LayerContact& contact, const Points& positions) const {
  double potential = 0;
  for (const LayerTouch& touch : contact.touches)
    potential +=
        settings_.friction * touch.normal_force *
        friction_energy(norm(deflection(touch, environment_.state.positions, positions)), time_step_);
  return potential;
}

void LayerStep::carry_duals(const LayerContact& from, double length, LayerContact& to) const {
  AscendingPlaces places(from.touches);
  for (LayerTouch& touch : to.touches) {
    const LayerTouch* before = places.find(key_of(touch));
    if (before == nullptr) continue;
    const double m = friction_length(before->slip, time_step_);
    const Vector3<double>& d = before->slip_direction;
    const Vector3<double> ds = friction_length(touch.slip, time_step_) * touch.slip_direction - m * d;
    const double along = before->slip > bristle_length(time_step_) ? dot(d, ds) : 0;
    const Vector3<double> dual = along_plane(
        touch.normal, before->dual + length * (d - before->dual) + (1 / m) * (ds - along * before->dual));
    touch.dual = (1 / larger_of(1.0, norm(dual))) * dual;
  }
}

double LayerStep::bristle_energy(const LayerContact& contact) const {
  double energy = 0;
  for (const LayerTouch& touch : contact.touches)
    energy += settings_.friction * touch.normal_force * friction_energy(norm(touch.bristle), time_step_);
  return energy;
}

template <typename Visit>
void LayerStep::follow(const Points& from, const Points& to, const double& share, double reach,
                       const Visit& visit) {
  const bool is_near = cover(memory_.near, from, to);
  if (!is_near) search(from, to, 0, reach * settings_.thickness, way_);
  const Eigen::VectorXd lengths = (to - from).rowwise().norm();
  for (const CandidatePair& pair : (is_near ? memory_.near : way_).pairs) {
    const auto& v = pair.vertices;
    Vector3<double> x[4], move[4];
    gather(from, v, x);
    // What is farther apart than both can go is free.
    const double longest =
        pair.kind == PairKind::vertex_face
            ? lengths[v[0]] + std::max({lengths[v[1]], lengths[v[2]], lengths[v[3]]})
            : std::max(lengths[v[0]], lengths[v[1]]) + std::max(lengths[v[2]], lengths[v[3]]);
    if (!may_come_near(pair.kind, x, share * longest + reach * pair.thickness)) continue;
    for (int k = 0; k < 4; ++k) move[k] = share * (vector3(to, v[k]) - x[k]);
    ++counts_.ways;
    if (!visit(pair, x, move)) return;
  }
}

double LayerStep::free_share(const Points& from, const Points& to) {
  double share = 1;
  follow(from, to, share, 1, [&](const CandidatePair& pair, const auto& x, const auto& move) {
    share *= sim::free_share(pair.kind, x, move, pair.thickness);
    return true;
  });
  return share;
}

bool LayerStep::is_free(const Points& from, const Points& to) {
  bool free = true;
  follow(from, to, 1, meeting_share, [&](const CandidatePair& pair, const auto& x, const auto& move) {
    free = stay_apart(pair.kind, x, move);
    return free;
  });
  return free;
}

std::vector<PairBristle> LayerStep::bristles_at_end(const LayerContact& contact) const {
  std::vector<PairBristle> bristles;
  for (const LayerTouch& touch : contact.touches)
    bristles.push_back({touch.vertices, touch.kind == PairKind::edge_edge, vector3d(touch.slip_direction)});
  return bristles;
}

}  // namespace flash::sim
