#include "calib/uncertainty/correlated_pose_errors.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "calib/solve/linearization.h"
#include "data/numbers/chi_square.h"

namespace flash::calib {
namespace {

constexpr int kOwn = PoseModes::kOwn, kModes = PoseModes::kSmooth;
// [rad], and how likely each is of drawn arms (make arm-errors).
struct Reach {
  double length, probability;
};
constexpr Reach kReaches[] = {{1, 0.05}, {2, 0.25}, {4, 0.45}, {8, 0.25}};
// Turns [rad], a factor of two apart: 0.01 to 0.7 deg.
constexpr double kSizes[] = {2e-4, 4e-4, 8e-4, 1.6e-3, 3.2e-3, 6.4e-3, 1.28e-2};
constexpr double kUsualSize = 0.15 * M_PI / 180, kSizeSpread = 1;  // of its logarithm
// Of errors that are smooth against errors that are not, before any view is seen: arms repeat to a tenth of
// their accuracy (ISO 9283 states both), so that nearly every one has them.
constexpr double kOdds = 9;
// Chi-square with 3 degrees of freedom: a size, its reach, and the share of what is independent.
constexpr double kOnceInTwenty = data::chi_square_95_of_3;
constexpr std::size_t kEnough = 30;  // poses from which sizes are estimated

using Columns = PoseModes::Columns;

/// Adds Y (k x I_3) Y^T to `sum` for Y = rows * columns, three columns a pose.
void add_spread(const Eigen::MatrixXd& rows, const std::vector<Columns>& columns, const Eigen::MatrixXd* k,
                Eigen::MatrixXd& sum) {
  const auto count = static_cast<Eigen::Index>(columns.size());
  std::array<Eigen::MatrixXd, 3> Y;
  Y.fill(Eigen::MatrixXd(rows.rows(), count));
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::MatrixXd y = rows.middleCols(kOwn * i, kOwn) * columns[static_cast<std::size_t>(i)];
    for (std::size_t axis = 0; axis < 3; ++axis) Y[axis].col(i) = y.col(static_cast<Eigen::Index>(axis));
  }
  for (const Eigen::MatrixXd& y : Y) sum.noalias() += (k ? Eigen::MatrixXd(y * *k) : y) * y.transpose();
}

template <class Mode>
std::vector<Columns> columns_of(const std::vector<PoseModes>& modes, const Mode& mode) {
  std::vector<Columns> columns;
  columns.reserve(modes.size());
  for (const PoseModes& pose : modes) columns.push_back(mode(pose));
  return columns;
}

/// The errors of a set of poses as the pictures see them, shared unknowns eliminated: beta = G^T xi + e with
/// independent e of unit variance.
struct Seen {
  Eigen::MatrixXd G_transposed;
  Eigen::VectorXd beta;
};

Seen seen_errors(const std::vector<const PoseInformation*>& poses, const Eigen::MatrixXd& prior) {
  const Eigen::Index s = poses.front()->H_ss.rows(), n = kOwn * static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd F = Eigen::MatrixXd::Zero(n, n), H_s(n, s), H_ss = prior.topLeftCorner(s, s);
  Eigen::VectorXd g(n), g_s = prior.col(s).head(s);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Index row = kOwn * static_cast<Eigen::Index>(i);
    F.block<kOwn, kOwn>(row, row) = poses[i]->H;
    H_s.middleRows(row, kOwn) = poses[i]->H_s;
    g.segment<kOwn>(row) = poses[i]->g;
    H_ss += poses[i]->H_ss;
    g_s += poses[i]->g_s;
  }
  // Some shared unknowns may be none of this arm's, or tell the same (its base and the camera).
  const Eigen::VectorXd scale =
      H_ss.diagonal().unaryExpr([](double h) { return h > 0 ? 1 / std::sqrt(h) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * H_ss * scale.asDiagonal());
  const Eigen::VectorXd inverse =
      eigen.eigenvalues().unaryExpr([](double e) { return e > 1e-10 ? 1 / e : 0.0; });
  const Eigen::MatrixXd V = scale.asDiagonal() * eigen.eigenvectors();
  const Eigen::MatrixXd eliminated = V * inverse.asDiagonal() * V.transpose();
  F -= H_s * eliminated * H_s.transpose();
  const Eigen::VectorXd b = -(g - H_s * eliminated * g_s);

  const Eigen::LDLT<Eigen::MatrixXd> ldlt(0.5 * (F + F.transpose()));
  const Eigen::VectorXd D = ldlt.vectorD();
  const Eigen::VectorXd root =
      D.unaryExpr([least = 1e-10 * D.maxCoeff()](double d) { return d > least ? std::sqrt(d) : 0.0; });
  Seen seen;
  const Eigen::MatrixXd P = ldlt.transpositionsP() * Eigen::MatrixXd::Identity(n, n);
  seen.G_transposed = root.asDiagonal() * Eigen::MatrixXd(ldlt.matrixU() * P);
  const Eigen::VectorXd y = ldlt.matrixL().solve(ldlt.transpositionsP() * b);
  seen.beta = root.binaryExpr(y, [](double r, double value) { return r > 0 ? value / r : 0.0; });
  return seen;
}

/// Variances of translation and rotation of errors that are independent.
struct Fit {
  Eigen::Vector2d v = Eigen::Vector2d::Zero();
  Eigen::Vector2d relative_variance = Eigen::Vector2d::Zero();  ///< of each estimate, over its square
  double deviance = 0;
};

double deviance_of(const Eigen::LLT<Eigen::MatrixXd>& llt, const Eigen::VectorXd& beta) {
  return 2 * llt.matrixLLT().diagonal().array().log().sum() + beta.dot(llt.solve(beta));
}

/// beta ~ N(0, W + v_0 M_0 + v_1 M_1) by Newton's method with the average information (Gilmour, Thompson and
/// Cullis 1995), v kept at or above zero; `unit`: their usual sizes.
Fit fit_variances(const Eigen::VectorXd& beta, const Eigen::MatrixXd& W,
                  const std::array<Eigen::MatrixXd, 2>& M, const Eigen::Vector2d& unit) {
  const Eigen::Index n = beta.size();
  const auto covariance = [&](const Eigen::Vector2d& v) -> Eigen::MatrixXd {
    return W + v[0] * M[0] + v[1] * M[1];
  };
  Fit fit;
  fit.v = unit;
  Eigen::LLT<Eigen::MatrixXd> llt(covariance(fit.v));
  fit.deviance = deviance_of(llt, beta);
  for (int iteration = 0; iteration < 100; ++iteration) {
    const Eigen::MatrixXd inverse = llt.solve(Eigen::MatrixXd::Identity(n, n));
    const Eigen::VectorXd y = inverse * beta;
    Eigen::MatrixXd My(n, 2);
    Eigen::Vector2d gradient;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      My.col(i) = M[k] * y;
      gradient[i] = inverse.cwiseProduct(M[k]).sum() - y.dot(My.col(i));
    }
    // Each in units of its own size; what wants below zero stays there.
    gradient = gradient.cwiseProduct(unit).eval();
    Eigen::Matrix2d information = unit.asDiagonal() * (My.transpose() * inverse * My) * unit.asDiagonal();
    for (Eigen::Index k = 0; k < 2; ++k) {
      if (fit.v[k] > 0 || gradient[k] < 0) continue;
      gradient[k] = 0;
      information.row(k).setZero();
      information.col(k).setZero();
      information(k, k) = 1;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(information);
    const Eigen::Vector2d curvature =
        eigen.eigenvalues().cwiseMax(1e-3 * std::max(1e-12, eigen.eigenvalues().maxCoeff()));
    const Eigen::Matrix2d inverse_information =
        eigen.eigenvectors() * curvature.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
    for (Eigen::Index k = 0; k < 2; ++k)
      if (fit.v[k] > 0)
        fit.relative_variance[k] = 2 * inverse_information(k, k) * std::pow(unit[k] / fit.v[k], 2);
    Eigen::Vector2d step = -(inverse_information * gradient).cwiseProduct(unit);
    bool improved = false;
    for (int halving = 0; halving < 12 && !improved; ++halving, step *= 0.5) {
      Fit trial = fit;
      trial.v = (fit.v + step).cwiseMax(0.0);
      const Eigen::LLT<Eigen::MatrixXd> there(covariance(trial.v));
      trial.deviance = deviance_of(there, beta);
      if (!(trial.deviance < fit.deviance)) continue;
      improved = fit.deviance - trial.deviance > 1e-7;
      fit = trial;
      llt = there;
      if (!improved) return fit;
    }
    if (!improved) return fit;
  }
  return fit;
}

/// Poses of one arm that were seen.
std::vector<std::size_t> poses_of(const std::vector<PoseInformation>& all, const Bundle& bundle,
                                  std::size_t arm) {
  std::vector<std::size_t> poses;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (bundle.poses[i].arm == static_cast<int>(arm) && all[i].H.trace() > 0) poses.push_back(i);
  return poses;
}

std::vector<std::size_t> thinned(std::size_t poses) {
  std::vector<std::size_t> result;
  const std::size_t count = std::min(poses, kEnough);
  for (std::size_t i = 0; i < count; ++i) result.push_back(i * poses / count);
  return result;
}

/// Fields of one size and reach, and the independent errors that fit beside them.
struct Candidate {
  double size = 0, reach = 0;
  Fit fit;
  double weight = 0;  ///< probability
};

struct Noise {
  double translation2 = 0, rotation2 = 0;  ///< variances an axis, as the solution has them
};

std::vector<Candidate> candidates(const std::vector<PoseModes>& modes, const Seen& seen, const Noise& noise,
                                  CorrelatedPoseErrors& errors) {
  const Eigen::Index n = seen.beta.size();
  const Eigen::Vector2d unit(noise.translation2, noise.rotation2);
  std::array<Eigen::MatrixXd, 2> M;
  M.fill(Eigen::MatrixXd::Zero(n, n));
  add_spread(seen.G_transposed, columns_of(modes, [](const PoseModes& m) { return m.translation; }), nullptr,
             M[0]);
  add_spread(seen.G_transposed, columns_of(modes, [](const PoseModes& m) { return m.rotation; }), nullptr,
             M[1]);
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(n, n);
  const double independent = fit_variances(seen.beta, I, M, unit).deviance;
  const Eigen::MatrixXd squared = squared_distances(modes);
  std::vector<Candidate> list;
  for (const auto& [reach, probability] : kReaches) {
    const Eigen::MatrixXd k = matern(squared, reach);
    Eigen::MatrixXd fields = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t mode = 0; mode < kModes; ++mode)
      add_spread(seen.G_transposed, columns_of(modes, [mode](const PoseModes& m) { return m.smooth[mode]; }),
                 &k, fields);
    for (const double size : kSizes) {
      Candidate& candidate = list.emplace_back(Candidate{size, reach, {}});
      candidate.fit = fit_variances(seen.beta, I + size * size * fields, M, unit);
      errors.gain = std::max(errors.gain, independent - candidate.fit.deviance);
      const double unusual = std::log(size / kUsualSize) / kSizeSpread;
      candidate.weight =
          std::log(probability) + 0.5 * (independent - candidate.fit.deviance - unusual * unusual);
    }
  }
  double largest = 0;
  for (const Candidate& candidate : list) largest = std::max(largest, candidate.weight);
  double prior = 0, sum = std::exp(-largest);
  for (const double size : kSizes)
    prior += std::exp(-0.5 * std::pow(std::log(size / kUsualSize) / kSizeSpread, 2));
  for (Candidate& candidate : list)
    sum += candidate.weight = kOdds / prior * std::exp(candidate.weight - largest);
  for (Candidate& candidate : list) candidate.weight /= sum;
  return list;
}

/// Covariance of the errors of these poses over all candidates; independent ones are widened by how well they
/// are known.
Eigen::MatrixXd field_covariance(const std::vector<PoseModes>& modes, const std::vector<Candidate>& list,
                                 CorrelatedPoseErrors& errors) {
  const auto n = static_cast<Eigen::Index>(modes.size());
  const Eigen::MatrixXd squared = squared_distances(modes);
  Eigen::Vector2d independent = Eigen::Vector2d::Zero();
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(n, n);  // times the squares of the sizes
  double squares = 0;
  for (const auto& [reach, probability] : kReaches) {
    double size2 = 0;
    for (const Candidate& candidate : list) {
      if (candidate.reach != reach) continue;
      size2 += candidate.weight * candidate.size * candidate.size;
      errors.share += candidate.weight;
      errors.reach += candidate.weight * reach;
      // The mean of sigma^2 over log sigma, to second order and at most half a unit wide.
      independent.array() += candidate.weight * candidate.fit.v.array() *
                             (1 + (0.5 * candidate.fit.relative_variance.array()).min(0.5));
    }
    squares += size2;
    k += size2 * matern(squared, reach);
  }
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(kOwn * n, kOwn * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const PoseModes& a = modes[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < n; ++j)
      for (std::size_t mode = 0; mode < kModes; ++mode)
        K.block<kOwn, kOwn>(kOwn * i, kOwn * j) +=
            k(i, j) * a.smooth[mode] * modes[static_cast<std::size_t>(j)].smooth[mode].transpose();
    K.block<kOwn, kOwn>(kOwn * i, kOwn * i) += independent[0] * a.translation * a.translation.transpose() +
                                               independent[1] * a.rotation * a.rotation.transpose();
  }
  errors.reach /= errors.share;
  errors.rotation = std::sqrt(squares / errors.share);
  errors.translation = errors.rotation * modes.front().smooth[2](0, 0);
  return K;
}

}  // namespace

ArmErrorFit fit_arm_errors(const std::vector<PoseModes>& modes, const std::vector<PoseInformation>& seen,
                           const Eigen::MatrixXd& prior, const Eigen::Vector2d& noise) {
  std::vector<const PoseInformation*> parts;
  std::vector<PoseModes> some;
  for (const std::size_t i : thinned(modes.size())) {
    parts.push_back(&seen[i]);
    some.push_back(modes[i]);
  }
  ArmErrorFit fit;
  const std::vector<Candidate> list =
      candidates(some, seen_errors(parts, prior), {noise[0], noise[1]}, fit.errors);
  fit.errors.found = fit.errors.gain > kOnceInTwenty;
  fit.covariance = field_covariance(modes, list, fit.errors);
  return fit;
}

PoseErrorModel fit_pose_errors(const Refinement& refined, const BundleSettings& settings) {
  const std::vector<PoseInformation> all = pose_informations(refined, settings);
  const Eigen::MatrixXd prior = linearize(refined.bundle, refined.noise, settings).prior;
  PoseErrorModel model;
  model.arms.resize(refined.bundle.bases.size());
  model.poses.resize(model.arms.size());
  model.covariance.resize(model.arms.size());
  if (settings.unknowns.joint_errors) return model;
  for (std::size_t arm = 0; arm < model.arms.size(); ++arm) {
    model.poses[arm] = poses_of(all, refined.bundle, arm);
    if (model.poses[arm].empty()) continue;
    std::vector<PoseInformation> seen;
    for (const std::size_t i : model.poses[arm]) seen.push_back(all[i]);
    ArmErrorFit fit = fit_arm_errors(
        modes_of(refined.bundle, model.poses[arm]), seen, prior,
        {std::pow(refined.noise.translation[arm], 2), std::pow(refined.noise.rotation[arm], 2)});
    model.arms[arm] = fit.errors;
    model.covariance[arm] = std::move(fit.covariance);
  }
  return model;
}

}  // namespace flash::calib
