#pragma once
#include <Eigen/Core>
#include <vector>

namespace flash::sim {

/// The x >= 0 with y = N^T C x - b >= 0 and x . y = 0 (a linear complementarity problem), N the unit
/// `normals` as columns and C the `directions`: of at most three of them that are independent. Where there is
/// none (faces that press against each other), what comes nearest. As forces, with b = N^T f and C = N: the
/// non-negative ones that come nearest to f. As a displacement N x, with b minus the gaps: the shortest that
/// closes all of them.
std::vector<double> solve_lcp(const std::vector<Eigen::Vector3d>& normals,
                              const std::vector<Eigen::Vector3d>& directions, const std::vector<double>& b);

}  // namespace flash::sim
