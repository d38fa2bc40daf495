#include "calib/uncertainty/correlated_pose_errors.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "calib/solve/linearization.h"

namespace flash::calib {
namespace {

constexpr int kOwn = 6;
constexpr int kIndependent = 2, kComponents = 5;  // translation, rotation; and three fields
constexpr double kReaches[] = {1, 2, 4};          // of the rms distance between two poses
// Chi-square with 3 degrees of freedom, a size each. Sizes cannot fall below zero, which alone would make it
// 5.4 (Self and Liang 1987); what is above that is for the choice of a reach.
constexpr double kOnceInTwenty = 7.815;
constexpr std::size_t kEnough = 30;  // poses from which sizes are estimated

using Rows6 = Eigen::Matrix<double, kOwn, Eigen::Dynamic>;
using Columns = Eigen::Matrix<double, kOwn, 3>;
using Variances = Eigen::Matrix<double, kComponents, 1>;

/// What the pictures say of one pose's error xi (base axes, at the gripper) and of the shared unknowns s:
/// half of xi^T H xi + 2 xi^T H_s s + s^T H_ss s + 2 xi^T g + 2 s^T g_s.
struct PoseInformation {
  Matrix6d H = Matrix6d::Zero();
  Rows6 H_s;
  Eigen::MatrixXd H_ss;
  Vector6d g = Vector6d::Zero();
  Eigen::VectorXd g_s;
  Matrix6d prior = Matrix6d::Zero();  ///< information of the prior that the solution was made with
};

/// The ways in which an error moves the gripper, as columns of (dt, dtheta) in base axes. What is wrong at
/// the wrist turns with the gripper, what is wrong at the base does not.
struct PoseModes {
  Eigen::Vector3d place;
  Eigen::Matrix3d attitude;
  Columns translation, rotation, about_base;
};

std::vector<PoseInformation> informations(const Refinement& refined, const BundleSettings& settings) {
  const LinearModel model = linearize(refined.bundle, refined.noise, settings);
  const std::vector<double> sigmas = to_components(refined.noise);
  const int seen = 2 * static_cast<int>(refined.bundle.cameras.size());  // corners and depths come first
  const Eigen::Index s = model.shared;
  std::vector<Eigen::MatrixXd> joint(static_cast<std::size_t>(model.groups),
                                     Eigen::MatrixXd::Zero(kOwn + s + 1, kOwn + s + 1));
  std::vector<PoseInformation> result(joint.size());
  for (const GramBlock& block : model.blocks) {
    const auto pose = static_cast<std::size_t>(block.group);
    const double weight = std::pow(sigmas[static_cast<std::size_t>(block.component)], -2);
    if (block.component < seen)
      joint[pose] += weight * block.gram;
    else
      result[pose].prior += weight * block.gram.topLeftCorner<kOwn, kOwn>();
  }
  for (std::size_t i = 0; i < joint.size(); ++i) {
    const RobotPose& pose = refined.bundle.poses[i];
    Vector6d xi;
    xi << pose.correction.translation(), rotation_log(pose.correction.linear());
    Matrix6d turn = Matrix6d::Zero();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = pose.T_base_gripper.linear();
    const Eigen::MatrixXd& G = joint[i];
    PoseInformation& info = result[i];
    info.H = turn * G.topLeftCorner<kOwn, kOwn>() * turn.transpose();
    info.H_s = turn * G.block(0, kOwn, kOwn, s);
    info.H_ss = G.block(kOwn, kOwn, s, s);
    // Linearised at the correction found, asked of the whole error.
    info.g = turn * (G.block(0, kOwn + s, kOwn, 1) - G.topLeftCorner<kOwn, kOwn>() * xi);
    info.g_s = G.block(kOwn, kOwn + s, s, 1) - G.block(kOwn, 0, s, kOwn) * xi;
    info.prior = (turn * info.prior * turn.transpose()).eval();
  }
  return result;
}

PoseModes modes_of(const Bundle& bundle, std::size_t i) {
  const RobotPose& pose = bundle.poses[i];
  PoseModes modes{pose.T_base_gripper.translation(), pose.T_base_gripper.linear(), {}, {}, {}};
  const Eigen::Vector3d pivot = modes.attitude * bundle.pivots[static_cast<std::size_t>(pose.arm)];
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  modes.translation << I, Eigen::Matrix3d::Zero();
  modes.rotation << skew(pivot) * modes.attitude, modes.attitude;
  modes.about_base << skew(-modes.place), I;
  return modes;
}

/// Squared distances of places and of attitudes (chordal, so that a kernel of both is positive), each over
/// its mean. The places are those reported, errors and all: spreads of less than ten times the noise
/// (variances an axis) tell nothing of where the robot was, as those of a head that only turns.
Eigen::MatrixXd squared_distances(const std::vector<PoseModes>& modes, double place_noise,
                                  double attitude_noise) {
  constexpr double kLeast = 100 * 6;  // of the variance; two places differ by six of them
  const auto count = static_cast<Eigen::Index>(modes.size());
  Eigen::MatrixXd place = Eigen::MatrixXd::Zero(count, count), attitude = place;
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j) {
      const PoseModes &a = modes[static_cast<std::size_t>(i)], &b = modes[static_cast<std::size_t>(j)];
      place(i, j) = (a.place - b.place).squaredNorm();
      attitude(i, j) = 0.5 * (a.attitude - b.attitude).squaredNorm();
    }
  const double pairs = static_cast<double>(count) * static_cast<double>(count - 1);
  return place / std::max({place.sum() / pairs, kLeast * place_noise, 1e-12}) +
         attitude / std::max({attitude.sum() / pairs, kLeast * attitude_noise, 1e-12});
}

/// Matern 5/2.
Eigen::MatrixXd kernel(const Eigen::MatrixXd& squared, double reach) {
  return squared.unaryExpr([reach](double d2) {
    const double x = std::sqrt(5 * d2) / reach;
    return (1 + x + x * x / 3) * std::exp(-x);
  });
}

/// Y (k x I_3) Y^T for Y = rows * modes, three columns a pose.
Eigen::MatrixXd spread(const Eigen::MatrixXd& rows, const std::vector<PoseModes>& modes,
                       Columns PoseModes::*mode, const Eigen::MatrixXd* k) {
  const auto count = static_cast<Eigen::Index>(modes.size());
  std::array<Eigen::MatrixXd, 3> Y;
  Y.fill(Eigen::MatrixXd(rows.rows(), count));
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::MatrixXd y = rows.middleCols(kOwn * i, kOwn) * (modes[static_cast<std::size_t>(i)].*mode);
    for (std::size_t axis = 0; axis < 3; ++axis) Y[axis].col(i) = y.col(static_cast<Eigen::Index>(axis));
  }
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rows.rows(), rows.rows());
  for (const Eigen::MatrixXd& y : Y) sum.noalias() += (k ? Eigen::MatrixXd(y * *k) : y) * y.transpose();
  return sum;
}

/// Covariance of rows * xi for unit variance of each component.
std::array<Eigen::MatrixXd, kComponents> spreads(const Eigen::MatrixXd& rows,
                                                 const std::vector<PoseModes>& modes,
                                                 const Eigen::MatrixXd& k) {
  return {spread(rows, modes, &PoseModes::translation, nullptr),
          spread(rows, modes, &PoseModes::rotation, nullptr),
          spread(rows, modes, &PoseModes::translation, &k), spread(rows, modes, &PoseModes::rotation, &k),
          spread(rows, modes, &PoseModes::about_base, &k)};
}

/// The errors of a set of poses as the pictures see them, shared unknowns eliminated: beta = G^T xi + e with
/// independent e of unit variance.
struct Seen {
  Eigen::MatrixXd G_transposed;
  Eigen::VectorXd beta;
};

Seen seen_errors(const std::vector<const PoseInformation*>& poses) {
  const Eigen::Index s = poses.front()->H_ss.rows(), n = kOwn * static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd F = Eigen::MatrixXd::Zero(n, n), H_s(n, s), H_ss = Eigen::MatrixXd::Zero(s, s);
  Eigen::VectorXd g(n), g_s = Eigen::VectorXd::Zero(s);
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

struct Fit {
  Variances v = Variances::Zero();
  Variances relative_variance = Variances::Zero();  ///< of each variance's estimate, over its square
  double deviance = 0;
};

double deviance_of(const Eigen::LLT<Eigen::MatrixXd>& llt, const Eigen::VectorXd& beta) {
  return 2 * llt.matrixLLT().diagonal().array().log().sum() + beta.dot(llt.solve(beta));
}

/// beta ~ N(0, I + sum_k v_k M_k) by Newton's method with the average information (Gilmour, Thompson and
/// Cullis 1995), kept at or above zero. Components from `free` on stay zero.
Fit fit_variances(const Seen& seen, const std::array<Eigen::MatrixXd, kComponents>& M, Variances start,
                  int free) {
  const Eigen::Index n = seen.beta.size();
  const auto covariance = [&](const Variances& v) {
    Eigen::MatrixXd W = Eigen::MatrixXd::Identity(n, n);
    for (int k = 0; k < free; ++k)
      if (v[k] > 0) W += v[k] * M[static_cast<std::size_t>(k)];
    return W;
  };
  Fit fit;
  fit.v = start;
  fit.v.tail(kComponents - free).setZero();
  Eigen::LLT<Eigen::MatrixXd> llt(covariance(fit.v));
  fit.deviance = deviance_of(llt, seen.beta);
  for (int iteration = 0; iteration < 200; ++iteration) {
    const Eigen::MatrixXd inverse = llt.solve(Eigen::MatrixXd::Identity(n, n));
    const Eigen::VectorXd y = inverse * seen.beta;
    Eigen::MatrixXd My(n, free);
    Eigen::VectorXd gradient(free);
    for (int k = 0; k < free; ++k) {
      const Eigen::MatrixXd& M_k = M[static_cast<std::size_t>(k)];
      My.col(k) = M_k * y;
      gradient[k] = inverse.cwiseProduct(M_k).sum() - y.dot(My.col(k));
    }
    Eigen::MatrixXd information =
        My.transpose() * inverse * My;  // of half the deviance, doubled: its Hessian
    // Each in units of its own size; what wants below zero stays there.
    const Eigen::VectorXd unit = start.head(free).cwiseMax(1e-300);
    gradient = gradient.cwiseProduct(unit).eval();
    information = (unit.asDiagonal() * information * unit.asDiagonal()).eval();
    for (int k = 0; k < free; ++k) {
      if (fit.v[k] > 0 || gradient[k] < 0) continue;
      gradient[k] = 0;
      information.row(k).setZero();
      information.col(k).setZero();
      information(k, k) = 1;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
    const Eigen::VectorXd curvature =
        eigen.eigenvalues().cwiseMax(1e-3 * std::max(1e-12, eigen.eigenvalues().maxCoeff()));
    const Eigen::MatrixXd inverse_information =
        eigen.eigenvectors() * curvature.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
    for (int k = 0; k < free; ++k)
      if (fit.v[k] > 0)
        fit.relative_variance[k] = 2 * inverse_information(k, k) * std::pow(unit[k] / fit.v[k], 2);
    Eigen::VectorXd step = -(inverse_information * gradient).cwiseProduct(unit);
    bool improved = false;
    for (int halving = 0; halving < 12 && !improved; ++halving, step *= 0.5) {
      Fit trial = fit;
      trial.v.head(free) = (fit.v.head(free) + step).cwiseMax(0.0);
      const Eigen::LLT<Eigen::MatrixXd> there(covariance(trial.v));
      trial.deviance = deviance_of(there, seen.beta);
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
std::vector<std::size_t> poses_of(const std::vector<PoseInformation>& all, const Bundle& bundle, int arm) {
  std::vector<std::size_t> poses;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (bundle.poses[i].arm == arm && all[i].H.trace() > 0) poses.push_back(i);
  return poses;
}

std::vector<std::size_t> thinned(const std::vector<std::size_t>& poses) {
  if (poses.size() <= kEnough) return poses;
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < kEnough; ++i) result.push_back(poses[i * poses.size() / kEnough]);
  return result;
}

struct Reach {
  double reach = 0;
  Fit fit;
};

/// The fields of one arm for each reach; `errors` says whether they are worth their parameters.
std::vector<Reach> fit_fields(const std::vector<PoseInformation>& all, const Refinement& refined, int arm,
                              const std::vector<std::size_t>& poses, CorrelatedPoseErrors& errors) {
  std::vector<const PoseInformation*> parts;
  std::vector<PoseModes> modes;
  for (const std::size_t i : thinned(poses)) {
    parts.push_back(&all[i]);
    modes.push_back(modes_of(refined.bundle, i));
  }
  const Seen seen = seen_errors(parts);
  const double t = std::pow(refined.noise.translation[static_cast<std::size_t>(arm)], 2),
               r = std::pow(refined.noise.rotation[static_cast<std::size_t>(arm)], 2);
  const Eigen::MatrixXd squared = squared_distances(modes, t, r);
  // What turns the gripper may be at the wrist or at the base: the likelihood has a maximum for each.
  std::array<Variances, 2> starts;
  starts[0] << 0.5 * t, 0.5 * r, 0.5 * t, 0.5 * r, 0.02 * r;
  starts[1] << 0.5 * t, 0.5 * r, 0.1 * t, 0.1 * r, 0.5 * r;
  std::vector<Reach> reaches;
  double independent = 0, least = 0;
  for (const double reach : kReaches) {
    const auto M = spreads(seen.G_transposed, modes, kernel(squared, reach));
    if (reaches.empty()) independent = least = fit_variances(seen, M, 2 * starts[0], kIndependent).deviance;
    for (const Variances& start : starts) {
      reaches.push_back({reach, fit_variances(seen, M, start, kComponents)});
      least = std::min(least, reaches.back().fit.deviance);
    }
  }
  errors.gain = independent - least;
  errors.found = errors.gain > kOnceInTwenty;
  return reaches;
}

}  // namespace

SystematicUncertainty systematic_uncertainty(const Refinement& refined, const BundleSettings& settings) {
  SystematicUncertainty result{refined.covariance,
                               std::vector<CorrelatedPoseErrors>(refined.bundle.bases.size())};
  const std::vector<PoseInformation> all = informations(refined, settings);
  const Eigen::Index s = refined.covariance.rows();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(s, s);
  std::vector<Eigen::MatrixXd> gains;  // of the shared unknowns by what the prior says of a pose
  for (const PoseInformation& pose : all) {
    const Eigen::LDLT<Matrix6d> ldlt(pose.H + pose.prior);
    information += pose.H_ss - pose.H_s.transpose() * ldlt.solve(pose.H_s);
    gains.push_back(pose.H_s.transpose() * ldlt.solve(pose.prior));
  }
  const Eigen::LDLT<Eigen::MatrixXd> shared(information);
  for (int arm = 0; arm < static_cast<int>(result.arms.size()); ++arm) {
    CorrelatedPoseErrors& errors = result.arms[static_cast<std::size_t>(arm)];
    const std::vector<std::size_t> poses = poses_of(all, refined.bundle, arm);
    if (poses.size() < 8) continue;
    const std::vector<Reach> reaches = fit_fields(all, refined, arm, poses, errors);
    if (!errors.found) continue;
    std::vector<PoseModes> modes;
    Eigen::MatrixXd rows(s, kOwn * static_cast<Eigen::Index>(poses.size()));
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Eigen::MatrixXd A = shared.solve(gains[poses[i]]);
      rows.middleCols(kOwn * static_cast<Eigen::Index>(i), kOwn) = A;
      modes.push_back(modes_of(refined.bundle, poses[i]));
      // In place of the independent errors that the solution was made with.
      result.covariance -= A * all[poses[i]].prior.ldlt().solve(A.transpose());
    }
    const auto index = static_cast<std::size_t>(arm);
    const Eigen::MatrixXd squared = squared_distances(modes, std::pow(refined.noise.translation[index], 2),
                                                      std::pow(refined.noise.rotation[index], 2));
    const double least = std::min_element(reaches.begin(), reaches.end(), [](const Reach& a, const Reach& b) {
                           return a.fit.deviance < b.fit.deviance;
                         })->fit.deviance;
    double weights = 0;
    for (const Reach& reach : reaches) weights += std::exp(0.5 * (least - reach.fit.deviance));
    Variances mean = Variances::Zero();
    for (const Reach& reach : reaches) {
      const double weight = std::exp(0.5 * (least - reach.fit.deviance)) / weights;
      const auto parts = spreads(rows, modes, kernel(squared, reach.reach));
      // Sizes are estimates: the mean of sigma^2 over log sigma, to second order and at most half a unit
      // wide.
      const Variances size = reach.fit.v.array() * (1 + (0.5 * reach.fit.relative_variance.array()).min(0.5));
      for (std::size_t k = 0; k < parts.size(); ++k)
        result.covariance += weight * size[static_cast<Eigen::Index>(k)] * parts[k];
      mean += weight * reach.fit.v;
      errors.reach += weight * reach.reach;
    }
    errors.translation = std::sqrt(mean[kIndependent]);
    errors.rotation = std::sqrt(mean[kIndependent + 1]);
    errors.about_base = std::sqrt(mean[kIndependent + 2]);
  }
  return result;
}

}  // namespace flash::calib
