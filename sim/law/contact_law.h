#pragma once
#include <Eigen/Core>
#include <vector>

namespace flash::sim {

/// Solves a linear complementarity problem: the x >= 0 with y = N^T C x - b >= 0 and x . y = 0. The unit
/// `normals` are the columns of N, the `directions` those of C. At most three of x are positive, of
/// independent columns. Where there is none (faces that press against each other), returns what comes
/// nearest. As forces, with b = N^T f and C = N: the non-negative ones that come nearest to f. As a
/// displacement N x, with b minus the gaps: the shortest that closes all of them.
std::vector<double> solve_lcp(const std::vector<Eigen::Vector3d>& normals,
                              const std::vector<Eigen::Vector3d>& directions, const std::vector<double>& b);

}  // namespace flash::sim
