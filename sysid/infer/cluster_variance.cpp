#include "sysid/infer/cluster_variance.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace flash::sysid {
namespace {

/// f applied to the eigenvalues of a symmetric matrix.
template <class Function>
Eigen::MatrixXd of_eigenvalues(const Eigen::MatrixXd& matrix, const Function& f) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  return eigen.eigenvectors() * eigen.eigenvalues().unaryExpr(f).asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

std::vector<ClusterVariance> cluster_variance(const Eigen::MatrixXd& slopes,
                                              const std::vector<Eigen::MatrixXd>& information) {
  constexpr double kLeast = 1e-6;  // of the largest eigenvalue, and of what one keyframe leaves to the others
  const Eigen::Index parameters = slopes.cols(), keyframes = slopes.rows();
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(parameters, parameters);
  for (const Eigen::MatrixXd& each : information) total += each;
  const double largest = total.trace();
  std::vector<ClusterVariance> found(static_cast<std::size_t>(parameters));
  if (!(largest > 0)) return found;
  const Eigen::MatrixXd whitening =
      of_eigenvalues(total, [&](double e) { return 1 / std::sqrt(std::max(e, kLeast * largest)); });
  std::vector<Eigen::MatrixXd> shares, corrections;
  for (const Eigen::MatrixXd& each : information) {
    shares.push_back(whitening * each * whitening);
    corrections.push_back(
        of_eigenvalues(shares.back(), [&](double e) { return 1 / std::sqrt(std::max(1 - e, kLeast)); }));
  }
  for (Eigen::Index k = 0; k < parameters; ++k) {
    const Eigen::VectorXd direction = whitening.col(k).normalized();
    std::vector<Eigen::VectorXd> corrected;  // correction times direction
    double plain = 0, reduced = 0;
    for (Eigen::Index i = 0; i < keyframes; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Eigen::VectorXd slope = whitening * slopes.row(i).transpose();
      corrected.push_back(corrections[at] * direction);
      plain += std::pow(direction.dot(slope), 2);
      reduced += std::pow(corrected.back().dot(slope), 2);
    }
    double trace = 0, squares = 0;
    for (std::size_t i = 0; i < corrected.size(); ++i)
      for (std::size_t j = 0; j < corrected.size(); ++j) {
        const Eigen::VectorXd there = shares[j] * corrected[j];
        const double covariance =
            (i == j ? corrected[i].dot(there) : 0) - (shares[i] * corrected[i]).dot(there);
        squares += covariance * covariance;
        if (i == j) trace += covariance;
      }
    ClusterVariance& few = found[static_cast<std::size_t>(k)];
    if (plain > 0) few.variance = reduced / plain;
    if (squares > 0) few.freedom = trace * trace / squares;
  }
  return found;
}

double student_quantile(double freedom) {
  constexpr std::array<double, 4> kFew = {12.706, 4.303, 3.182, 2.776};
  if (freedom < 1) return std::numeric_limits<double>::infinity();
  if (freedom <= 4) {
    const double below = std::min(std::floor(freedom), 3.0), above = below + 1;
    const auto at = static_cast<std::size_t>(below);
    const double share = (1 / below - 1 / freedom) / (1 / below - 1 / above);
    return std::pow(kFew[at - 1], 1 - share) * std::pow(kFew[at], share);
  }
  const double z = 1.959964, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z, n = freedom;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n);
}

}  // namespace flash::sysid
