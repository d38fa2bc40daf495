#pragma once
#include "sim/cuda/membrane.cuh"

namespace flash::sim::cuda {

/// The rotation R that takes points nearest to others, about their centres, by `moments` = sum m to from^T
/// (sim/step/rigid_turn.h), and the inverse of tr S - S, S = moments R^T.
struct RigidTurn {
  double rotation[3][3], inverse_inertia[3][3];

  __device__ Triple turn(const Triple& x) const { return product(rotation, x); }
  /// The rotation vector that belongs to a torque.
  __device__ Triple respond(const Triple& torque) const { return product(inverse_inertia, torque); }

 private:
  __device__ static Triple product(const double (&m)[3][3], const Triple& x) {
    return {m[0][0] * x.x + m[0][1] * x.y + m[0][2] * x.z, m[1][0] * x.x + m[1][1] * x.y + m[1][2] * x.z,
            m[2][0] * x.x + m[2][1] * x.y + m[2][2] * x.z};
  }
};

/// The unit quaternion of that rotation: the eigenvector of the largest eigenvalue of a symmetric 4 x 4
/// matrix (Horn 1987), by Jacobi's rotations.
__device__ inline void nearest_quaternion(const double (&m)[3][3], double (&q)[4]) {
  const double a = m[2][1] - m[1][2], b = m[0][2] - m[2][0], c = m[1][0] - m[0][1];
  double n[4][4] = {{m[0][0] + m[1][1] + m[2][2], a, b, c},
                    {a, m[0][0] - m[1][1] - m[2][2], m[0][1] + m[1][0], m[2][0] + m[0][2]},
                    {b, m[0][1] + m[1][0], m[1][1] - m[0][0] - m[2][2], m[1][2] + m[2][1]},
                    {c, m[2][0] + m[0][2], m[1][2] + m[2][1], m[2][2] - m[0][0] - m[1][1]}};
  double v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  constexpr int most_sweeps = 30;
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    double off = 0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) off += n[i][j] * n[i][j];
    if (off == 0) break;
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) {
        if (n[i][j] == 0) continue;
        const double theta = 0.5 * (n[j][j] - n[i][i]) / n[i][j];
        const double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
        const double cosine = 1 / sqrt(t * t + 1), sine = t * cosine;
        for (int k = 0; k < 4; ++k) {
          const double x = n[k][i], y = n[k][j];
          n[k][i] = cosine * x - sine * y;
          n[k][j] = sine * x + cosine * y;
        }
        for (int k = 0; k < 4; ++k) {
          const double x = n[i][k], y = n[j][k];
          n[i][k] = cosine * x - sine * y;
          n[j][k] = sine * x + cosine * y;
        }
        n[i][j] = n[j][i] = 0;
        for (int k = 0; k < 4; ++k) {
          const double x = v[k][i], y = v[k][j];
          v[k][i] = cosine * x - sine * y;
          v[k][j] = sine * x + cosine * y;
        }
      }
  }
  int largest = 0;
  for (int i = 1; i < 4; ++i)
    if (n[i][i] > n[largest][largest]) largest = i;
  double length = 0;
  for (int k = 0; k < 4; ++k) length += v[k][largest] * v[k][largest];
  for (int k = 0; k < 4; ++k) q[k] = v[k][largest] / sqrt(length);
}

/// moments[r][c] = sum of m to_r from_c, both from their centres.
__device__ inline RigidTurn rigid_turn(const double (&moments)[3][3]) {
  double q[4];
  nearest_quaternion(moments, q);
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  RigidTurn turn = {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                     {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                     {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}},
                    {}};
  double k[3][3];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      k[r][c] = 0;
      for (int e = 0; e < 3; ++e)
        k[r][c] -= 0.5 * (moments[r][e] * turn.rotation[c][e] + moments[c][e] * turn.rotation[r][e]);
    }
  const double trace = -(k[0][0] + k[1][1] + k[2][2]);
  for (int r = 0; r < 3; ++r) k[r][r] += trace;
  const auto minor = [&](int r, int c) {
    const int a = (r + 1) % 3, b = (r + 2) % 3, d = (c + 1) % 3, e = (c + 2) % 3;
    return k[a][d] * k[b][e] - k[a][e] * k[b][d];
  };
  const double determinant = k[0][0] * minor(0, 0) + k[0][1] * minor(0, 1) + k[0][2] * minor(0, 2);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) turn.inverse_inertia[r][c] = minor(c, r) / determinant;
  return turn;
}

}  // namespace flash::sim::cuda
