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

/// Straight motions of the vertices of a pair, less their mean.
struct PairMotion {
  Vector3<double> move[4];
  double approach = 0;  ///< by how much they can bring its features together [m]
};

/// No point of a feature moves farther than its vertices do.
FLASH_HOST_DEVICE inline PairMotion motion_of(PairKind kind, const Vector3<double>* move) {
  const Vector3<double> mean = 0.25 * (move[0] + move[1] + move[2] + move[3]);
  const int split = kind == PairKind::vertex_face ? 1 : 2;
  PairMotion motion;
  double longest[2] = {0, 0};
  for (int i = 0; i < 4; ++i) {
    motion.move[i] = move[i] - mean;
    const double length = norm(motion.move[i]);
    double& own = longest[i < split ? 0 : 1];
    own = length > own ? length : own;
  }
  motion.approach = longest[0] + longest[1];
  return motion;
}

/// A share of a motion in which the distance of a pair, `start` at first, stays above `least`: 1 where it
/// does to the end. It ends where at most twice `least` is left. Additive advancement (Li, Kaufman, Jiang
/// 2021, "Codimensional incremental potential contact").
FLASH_HOST_DEVICE inline double advanced_share(PairKind kind, const Vector3<double>* x,
                                               const PairMotion& motion, double start, double least) {
  constexpr double step_share = 0.9;  // of what surely is free
  constexpr int most_steps = 1000;
  if (motion.approach <= start - least) return 1;
  double share = 0, distance = start;
  for (int step = 0; step < most_steps; ++step) {
    share += step_share * (distance - least) / motion.approach;
    if (share >= 1) return 1;
    Vector3<double> at[4];
    for (int i = 0; i < 4; ++i) at[i] = x[i] + share * motion.move[i];
    distance = nearest_points(kind, at).distance;
    if (distance <= 2 * least) return share;
  }
  return share;
}

/// A share of the straight motions `move` that the vertices of a pair can take while the distance stays above
/// a quarter of that at the start, or of `reach` where that is less: 1 where all of it is free. It is
/// conservative, and ends where at most half is left.
FLASH_HOST_DEVICE inline double free_share(PairKind kind, const Vector3<double>* x,
                                           const Vector3<double>* move, double reach) {
  constexpr double kept_share = 0.25;  // of the distance
  const double start = nearest_points(kind, x).distance;
  return advanced_share(kind, x, motion_of(kind, move), start, kept_share * (start < reach ? start : reach));
}

/// Whether the distance of a pair stays above a hundredth of what it is at either end of straight motions. It
/// is conservative: of what meets it is never said.
FLASH_HOST_DEVICE inline bool stay_apart(PairKind kind, const Vector3<double>* x,
                                         const Vector3<double>* move) {
  constexpr double kept_share = 0.01;  // of the distance
  const PairMotion motion = motion_of(kind, move);
  const double before = nearest_points(kind, x).distance;
  if (motion.approach <= (1 - kept_share) * before) return true;
  Vector3<double> end[4];
  for (int i = 0; i < 4; ++i) end[i] = x[i] + motion.move[i];
  const double after = nearest_points(kind, end).distance;
  const double least = kept_share * (before < after ? before : after);
  return least > 0 && advanced_share(kind, x, motion, before, least) >= 1;
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
