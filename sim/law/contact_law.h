#pragma once
#include "sim/law/vector3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// One, two or three equations G x = b, the rest of three unused.
template <typename Real>
struct FewEquations {
  int size = 0;
  Real matrix[3][3] = {};
  Real right[3] = {};
};

/// Solves by Cramer's rule. Returns false where |det G| is less than `least_determinant`.
template <typename Real>
FLASH_HOST_DEVICE inline bool solve(const FewEquations<Real>& equations, Real least_determinant, Real x[3]) {
  // Rows of the identity fill up to three.
  Vector3<Real> column[3], right{};
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      column[c][r] = r < equations.size && c < equations.size ? equations.matrix[r][c] : Real(r == c);
  for (int r = 0; r < equations.size; ++r) right[r] = equations.right[r];
  const Real determinant = dot(column[0], cross(column[1], column[2]));
  if (magnitude(determinant) < least_determinant) return false;
  x[0] = dot(right, cross(column[1], column[2])) / determinant;
  x[1] = dot(column[0], cross(right, column[2])) / determinant;
  x[2] = dot(column[0], cross(column[1], right)) / determinant;
  return true;
}

/// Sine squared of 0.06 degrees, the angle between two faces below which they count as parallel.
inline constexpr double parallel_faces = 1e-6;

/// solve_lcp for one face: b / (n . c) where that is positive, else zero.
template <typename Real>
FLASH_HOST_DEVICE inline Real solve_lcp_of_one(const Vector3<Real>& normal, const Vector3<Real>& direction,
                                               const Real& b) {
  const Real across = dot(normal, direction);
  if (magnitude(across) < Real(parallel_faces)) return Real(0);
  const Real x = b / across;
  if (x < 0) return Real(0);
  const Real violation = larger_of(b - dot(normal, x * direction), Real(0)),
             rounding = Real(1e-12) * larger_of(magnitude(b), Real(0)),
             without = larger_of(b, Real(0)) - rounding;
  return violation >= without ? Real(0) : x;
}

/// Solves a linear complementarity problem: the x >= 0 with y = N^T C x - b >= 0 and x . y = 0. The unit
/// `normals` are the columns of N, the `directions` those of C; all have `count` entries. At most three of x
/// are positive, of independent columns. Where there is none (faces that press against each other), x becomes
/// what comes nearest. As forces, with b = N^T f and C = N: the non-negative ones that come nearest to f. As
/// a displacement N x, with b minus the gaps: the shortest that closes all of them.
template <typename Real>
FLASH_HOST_DEVICE inline void solve_lcp(int count, const Vector3<Real>* normals,
                                        const Vector3<Real>* directions, const Real* b, Real* x) {
  if (count == 1) {
    x[0] = solve_lcp_of_one(normals[0], directions[0], b[0]);
    return;
  }
  Real largest{}, best_violation{};
  for (int k = 0; k < count; ++k) {
    x[k] = 0;
    largest = larger_of(magnitude(b[k]), largest);
    best_violation = larger_of(b[k], best_violation);
  }
  const Real rounding = Real(1e-12) * largest;
  // The solution uses one, two or three faces; in space no more are independent.
  const auto try_faces = [&](int i, int j, int k, int size) {
    const int faces[3] = {i, j, k};
    FewEquations<Real> equations;
    equations.size = size;
    for (int r = 0; r < size; ++r) {
      equations.right[r] = b[faces[r]];
      for (int c = 0; c < size; ++c) equations.matrix[r][c] = dot(normals[faces[r]], directions[faces[c]]);
    }
    Real trial[3];
    // Faces that are parallel give no unique force.
    if (!solve(equations, Real(parallel_faces), trial)) return;
    Vector3<Real> sum{};
    for (int r = 0; r < size; ++r) {
      if (trial[r] < 0) return;
      sum = sum + trial[r] * directions[faces[r]];
    }
    Real violation{};
    for (int each = 0; each < count; ++each)
      violation = larger_of(b[each] - dot(normals[each], sum), violation);
    if (violation >= best_violation - rounding) return;
    best_violation = violation;
    for (int each = 0; each < count; ++each) x[each] = 0;
    for (int r = 0; r < size; ++r) x[faces[r]] = trial[r];
  };
  for (int i = 0; i < count; ++i) {
    try_faces(i, i, i, 1);
    for (int j = i + 1; j < count; ++j) {
      try_faces(i, j, j, 2);
      for (int k = j + 1; k < count; ++k) try_faces(i, j, k, 3);
    }
  }
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
