#include "sysid/infer/bent_student.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

namespace flash::sysid {
namespace {

struct Parabola {
  Eigen::VectorXd along, bend;
  double explained = 0;  ///< variance of all white coordinates together
};

/// Third and fourth moments of white points: what squares along any direction explain.
class Moments {
 public:
  Moments(const Eigen::MatrixXd& white, const Eigen::VectorXd& weights) {
    const Eigen::Index d = white.cols();
    Eigen::MatrixXd products(white.rows(), d * d);
    for (Eigen::Index i = 0; i < d; ++i)
      products.middleCols(i * d, d) = white.array().colwise() * white.col(i).array();
    const Eigen::MatrixXd weighted = weights.asDiagonal() * products;
    third_ = white.transpose() * weighted;
    fourth_ = products.transpose() * weighted;
  }

  /// See fitted_student.
  Parabola along(const Eigen::VectorXd& direction) const {
    // Of s, which is 2 for a Gaussian and 0 for two values of t. Work: rounding.
    constexpr double kLeast = 1e-6;
    const Eigen::VectorXd v = direction.normalized();
    const Eigen::VectorXd square = (v * v.transpose()).reshaped();
    const Eigen::VectorXd g = third_ * square;
    const double skew = g.dot(v), s = square.dot(fourth_ * square) - 1 - skew * skew;
    if (!(s > kLeast)) return {v, Eigen::VectorXd::Zero(v.size())};
    const Eigen::VectorXd bend = (g - skew * v) / s;
    return {v, bend, bend.squaredNorm() * s};
  }

 private:
  Eigen::MatrixXd third_, fourth_;  ///< d x d^2 and d^2 x d^2
};

/// Directions that parabolas are looked for along, a row each: the coordinates, the white ones, and sums and
/// differences of two of these.
Eigen::MatrixXd directions_of(const Eigen::MatrixXd& root) {
  const Eigen::Index d = root.rows();
  Eigen::MatrixXd directions(d * (d + 1), d);
  directions << root, Eigen::MatrixXd::Identity(d, d), Eigen::MatrixXd::Zero(d * (d - 1), d);
  Eigen::Index row = 2 * d;
  for (Eigen::Index i = 0; i < d; ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      for (const double sign : {-1.0, 1.0}) {
        directions(row, i) = 1;
        directions(row++, j) = sign;
      }
  return directions;
}

/// The parabola that explains most, by pattern search from the best of the rows of `starts`.
Parabola best_parabola(const Moments& moments, const Eigen::MatrixXd& starts) {
  // Steps of a unit vector, the first and the last. Work: a search among proposals.
  constexpr double kFirst = 0.4, kLast = 0.01;
  Parabola best = moments.along(starts.row(0).transpose());
  const auto improves = [&](const Eigen::VectorXd& direction) {
    Parabola other = moments.along(direction);
    if (!(other.explained > best.explained)) return false;
    best = std::move(other);
    return true;
  };
  for (const auto& start : starts.rowwise()) improves(start.transpose());
  for (double step = kFirst; step > kLast;) {
    bool better = false;
    for (Eigen::Index k = 0; k < best.along.size(); ++k)
      for (const double by : {-step, step})
        better = improves(best.along + by * Eigen::VectorXd::Unit(best.along.size(), k)) || better;
    if (!better) step /= 2;
  }
  return best;
}

Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& about_mean, const Eigen::VectorXd& weights) {
  return about_mean.transpose() * weights.asDiagonal() * about_mean;
}

/// Bends a straight one along a parabola of its white points, of which `share` stays that of the prior.
void bend(BentStudent& student, const Parabola& parabola, const Eigen::MatrixXd& white,
          const Eigen::VectorXd& weights, double share) {
  Eigen::MatrixXd rest = white - (white * parabola.along).cwiseAbs2() * parabola.bend.transpose();
  const Eigen::RowVectorXd mean = weights.transpose() * rest;
  rest.rowwise() -= mean;
  const auto root = student.root.triangularView<Eigen::Lower>();
  student.mean += root * mean.transpose();
  student.along = student.root.transpose().triangularView<Eigen::Upper>().solve(parabola.along);
  student.bend = root * parabola.bend;
  Eigen::MatrixXd scale = (1 - share) * covariance_of(rest, weights);
  scale.diagonal().array() += share;
  student.root = (root * scale * student.root.transpose()).llt().matrixL();
}

}  // namespace

Eigen::MatrixXd BentStudent::white(const Eigen::MatrixXd& points) const {
  Eigen::MatrixXd r = points.transpose().colwise() - mean;
  const Eigen::RowVectorXd squares = (along.transpose() * r).cwiseAbs2();
  r -= bend * squares;
  root.triangularView<Eigen::Lower>().solveInPlace(r);
  return r.transpose();
}

Eigen::ArrayXd BentStudent::densities(const Eigen::MatrixXd& points) const {
  const auto d = static_cast<double>(mean.size());
  const Eigen::ArrayXd distances = white(points).rowwise().squaredNorm().array();
  const double log_peak = std::lgamma((kFreedom + d) / 2) - std::lgamma(kFreedom / 2.0) -
                          d / 2 * std::log(kFreedom * M_PI) - root.diagonal().array().log().sum();
  return (log_peak - (kFreedom + d) / 2 * (1 + distances / kFreedom).log()).exp();
}

Eigen::VectorXd BentStudent::draw(RandomNumbers& random) const {
  Eigen::VectorXd normals(mean.size());
  for (double& each : normals) each = random.normal();
  double chi_square = 0;
  for (int i = 0; i < kFreedom; ++i) chi_square += std::pow(random.normal(), 2);
  const Eigen::VectorXd r = root.triangularView<Eigen::Lower>() * normals * std::sqrt(kFreedom / chi_square);
  return mean + r + bend * std::pow(along.dot(r), 2);
}

BentStudent fitted_student(const Eigen::MatrixXd& points, const Eigen::VectorXd& weights,
                           const Eigen::MatrixXd& prior) {
  // Times the coordinates: points that the prior of a covariance weighs. Work: a proposal, whose draws are
  // weighted.
  constexpr double kPrior = 2;
  constexpr double kRounding = 1e-12;  // Of the prior. Work: rounding.
  // By chance t^2 explains about d - 1 over the count, more where the best direction is looked for. What of
  // it may be chance, over d, and points by which a bend is shrunk. Work: a proposal, whose draws are
  // weighted.
  constexpr double kChance = 5, kStraight = 10;
  const Eigen::Index d = points.cols();
  const double count = 1 / weights.squaredNorm();  // that the points are worth
  const double share = kPrior * static_cast<double>(d) / (kPrior * static_cast<double>(d) + count);
  BentStudent fitted;
  fitted.mean = points.transpose() * weights;
  fitted.along = fitted.bend = Eigen::VectorXd::Zero(d);
  const Eigen::MatrixXd from = points.rowwise() - fitted.mean.transpose();
  Eigen::MatrixXd scale = (1 - share) * covariance_of(from, weights) + share * prior;
  scale.diagonal() += kRounding * prior.diagonal();
  fitted.root = scale.llt().matrixL();
  const Eigen::MatrixXd white =
      fitted.root.triangularView<Eigen::Lower>().solve(from.transpose()).transpose();
  Parabola parabola = best_parabola(Moments(white, weights), directions_of(fitted.root));
  if (!(parabola.explained * count > kChance * static_cast<double>(d))) return fitted;
  parabola.bend *= count / (count + kStraight);
  bend(fitted, parabola, white, weights, share);
  return fitted;
}

}  // namespace flash::sysid
