#pragma once
#include "sim/law/vector3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// Two features of a surface of triangles that may meet: vertex 0 and the face of vertices 1 to 3, or the
/// edges 01 and 23.
enum class PairKind { vertex_face, edge_edge };

/// The nearest points of a pair. Their difference, that of the first less that of the second feature, is
/// sum_i weights[i] x_i = distance * normal. The weights add up to zero. The derivative of the distance by
/// x_i is weights[i] * normal.
struct NearestPoints {
  double distance = 0;  ///< [m]
  Vector3<double> normal{};
  double weights[4] = {};
};

/// Where on the segment from a to b the point nearest to p is, from 0 to 1.
FLASH_HOST_DEVICE inline double share_along(const Vector3<double>& p, const Vector3<double>& a,
                                            const Vector3<double>& b) {
  const Vector3<double> along = b - a;
  const double squared = dot(along, along), share = squared > 0 ? dot(along, p - a) / squared : 0;
  return share < 0 ? 0 : share > 1 ? 1 : share;
}

/// Takes the points that `weights` name where they are nearer than those of `nearest`. Its normal is not yet
/// divided by the distance.
FLASH_HOST_DEVICE inline void take_nearer(const Vector3<double>* x, const double (&weights)[4],
                                          NearestPoints& nearest) {
  // Differences to x_0 alone: far from the origin the sum itself would round.
  Vector3<double> between{};
  for (int i = 1; i < 4; ++i) between = between + weights[i] * (x[i] - x[0]);
  const double squared = dot(between, between);
  if (!(squared < nearest.distance)) return;
  nearest.distance = squared;
  nearest.normal = between;
  for (int i = 0; i < 4; ++i) nearest.weights[i] = weights[i];
}

FLASH_HOST_DEVICE inline void divide_normal(NearestPoints& nearest) {
  nearest.distance = square_root(nearest.distance);
  if (nearest.distance > 0) nearest.normal = (1 / nearest.distance) * nearest.normal;
}

constexpr double no_points_yet = 1e300;

/// Of a vertex x[0] and the face x[1], x[2], x[3]: inside the face, or else on one of its edges.
FLASH_HOST_DEVICE inline NearestPoints nearest_of_vertex_and_face(const Vector3<double>* x) {
  NearestPoints nearest;
  nearest.distance = no_points_yet;
  const Vector3<double> p = x[0] - x[1], u = x[2] - x[1], v = x[3] - x[1], n = cross(u, v);
  const double squared = dot(n, n), beta = dot(cross(p, v), n), gamma = dot(cross(u, p), n);
  if (squared > 0 && beta >= 0 && gamma >= 0 && beta + gamma <= squared) {
    const double b = beta / squared, c = gamma / squared;
    take_nearer(x, {1, b + c - 1, -b, -c}, nearest);
  } else {
    for (int k = 0; k < 3; ++k) {
      const int from = 1 + k, to = 1 + (k + 1) % 3;
      const double share = share_along(x[0], x[from], x[to]);
      double weights[4] = {1, 0, 0, 0};
      weights[from] = share - 1;
      weights[to] = -share;
      take_nearer(x, weights, nearest);
    }
  }
  divide_normal(nearest);
  return nearest;
}

/// Of the edges x[0] x[1] and x[2] x[3]: inside both, or else at an end of one of them.
FLASH_HOST_DEVICE inline NearestPoints nearest_of_edges(const Vector3<double>* x) {
  constexpr double parallel = 1e-12;  // squared sine below which the ends decide
  NearestPoints nearest;
  nearest.distance = no_points_yet;
  const Vector3<double> u = x[1] - x[0], v = x[3] - x[2], r = x[2] - x[0], n = cross(u, v);
  const double squared = dot(n, n);
  if (squared > parallel * dot(u, u) * dot(v, v)) {
    const double s = dot(cross(r, v), n) / squared, t = dot(cross(r, u), n) / squared;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) {
      take_nearer(x, {1 - s, s, t - 1, -t}, nearest);
      divide_normal(nearest);
      return nearest;
    }
  }
  for (int end = 0; end < 2; ++end) {
    const double t = share_along(x[end], x[2], x[3]), s = share_along(x[2 + end], x[0], x[1]);
    take_nearer(x, {end == 0 ? 1.0 : 0.0, end == 0 ? 0.0 : 1.0, t - 1, -t}, nearest);
    take_nearer(x, {1 - s, s, end == 0 ? -1.0 : 0.0, end == 0 ? 0.0 : -1.0}, nearest);
  }
  divide_normal(nearest);
  return nearest;
}

FLASH_HOST_DEVICE inline NearestPoints nearest_points(PairKind kind, const Vector3<double>* x) {
  return kind == PairKind::vertex_face ? nearest_of_vertex_and_face(x) : nearest_of_edges(x);
}

/// How the nearest points of a pair move along their features as its vertices move by m: up to two unit
/// `along`, orthogonal to each other and to the normal, each with the derivatives of the weights by the place
/// along it. With the turns r_a = sum_i turns[a][i] normal . m_i and what lies between the nearest points,
/// y = sum_i weights[i] m_i, the changes are
///
///   of the normal:      -sum_a along_a r_a + (y less its parts along the normal and along_a) / distance
///   of the weights:     -sum_a turns[a] (along_a . y + distance r_a)
struct PairTurns {
  int count = 0;
  Vector3<double> along[2]{};
  double turns[2][4] = {};  ///< [1/m]
};

/// Of the nearest points as nearest_points gives them: a weight of zero is that of a vertex that they do not
/// depend on.
FLASH_HOST_DEVICE inline PairTurns turns_of(PairKind kind, const Vector3<double>* x,
                                            const NearestPoints& nearest) {
  constexpr double parallel = 1e-12;  // squared sine below which two ways along the features are one
  const int split = kind == PairKind::vertex_face ? 1 : 2;
  PairTurns all;
  for (int feature = 0; feature < 2; ++feature) {
    const int begin = feature == 0 ? 0 : split, end = feature == 0 ? split : 4;
    int first = begin;
    while (first < end && nearest.weights[first] == 0) ++first;
    for (int i = first + 1; i < end && all.count < 2; ++i) {
      if (nearest.weights[i] == 0) continue;
      // The weight of vertex i grows on account of the first one's.
      const double sign = feature == 0 ? 1 : -1;
      Vector3<double> way = sign * (x[i] - x[first]);
      double turns[4] = {};
      turns[i] = sign;
      turns[first] = -sign;
      const double whole = dot(way, way);
      if (all.count == 1) {
        const double share = dot(way, all.along[0]);
        way = way - share * all.along[0];
        for (int k = 0; k < 4; ++k) turns[k] -= share * all.turns[0][k];
      }
      const double left = dot(way, way);
      if (!(left > parallel * whole)) continue;
      const double length = square_root(left);
      all.along[all.count] = (1 / length) * way;
      for (int k = 0; k < 4; ++k) all.turns[all.count][k] = turns[k] / length;
      ++all.count;
    }
  }
  return all;
}

/// A share of the straight motions `move` that the vertices of a pair can take while the distance stays above
/// a quarter of that at the start, or of `reach` where that is less: 1 where all of it is free. It is
/// conservative, and ends where at most half is left. Additive advancement (Li, Kaufman, Jiang 2021,
/// "Codimensional incremental potential contact"): no point of a feature moves farther than its vertices do.
FLASH_HOST_DEVICE inline double free_share(PairKind kind, const Vector3<double>* x,
                                           const Vector3<double>* move, double reach) {
  constexpr double kept_share = 0.25, step_share = 0.9;  // of the distance; of what surely is free
  constexpr int most_steps = 1000;
  const Vector3<double> mean = 0.25 * (move[0] + move[1] + move[2] + move[3]);
  const int split = kind == PairKind::vertex_face ? 1 : 2;
  double first = 0, second = 0;
  for (int i = 0; i < 4; ++i) {
    const double length = norm(move[i] - mean);
    double& longest = i < split ? first : second;
    longest = length > longest ? length : longest;
  }
  const double approach = first + second;
  const double start = nearest_points(kind, x).distance;
  const double least = kept_share * (start < reach ? start : reach);
  if (approach <= start - least) return 1;
  double share = 0, distance = start;
  for (int step = 0; step < most_steps; ++step) {
    share += step_share * (distance - least) / approach;
    if (share >= 1) return 1;
    Vector3<double> at[4];
    for (int i = 0; i < 4; ++i) at[i] = x[i] + share * (move[i] - mean);
    distance = nearest_points(kind, at).distance;
    if (distance <= 2 * least) return share;
  }
  return share;
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
