#include "calib/uncertainty/motion_evidence.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <numeric>

#include "calib/solve/linearization.h"
#include "calib/uncertainty/pose_error_modes.h"

namespace flash::calib {
namespace {

constexpr Eigen::Index kOwn = PoseModes::kOwn;

double log_determinant(const Eigen::LLT<Eigen::MatrixXd>& llt) {
  return 2 * llt.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

MotionEvidence::MotionEvidence(const Refinement& refined, const BundleSettings& settings)
    : seen_(pose_informations(refined, settings)),
      prior_(linearize(refined.bundle, refined.noise, settings).prior) {
  const SharedColumns columns = shared_columns(refined.bundle, settings.unknowns);
  columns_[0] = columns.cameras.front();
  columns_[1] = columns.targets.front();
  const Eigen::Index n = poses(), s = columns.count;
  if (prior_.size() == 0) prior_.setZero(s + 1, s + 1);
  std::vector<std::size_t> all(seen_.size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<PoseModes> modes = modes_of(refined.bundle, all);
  squared_ = squared_distances(modes);
  root_.resize(kOwn * n, kOwn);
  rotation_ = translation_ = root_;
  fields_.setZero(kOwn * n, kOwn * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto pose = static_cast<std::size_t>(i);
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(0.5 * (seen_[pose].H + seen_[pose].H.transpose()));
    root_.middleRows<kOwn>(kOwn * i) =
        eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    rotation_.middleRows<kOwn>(kOwn * i) = modes[pose].rotation * modes[pose].rotation.transpose();
    translation_.middleRows<kOwn>(kOwn * i) = modes[pose].translation * modes[pose].translation.transpose();
    for (Eigen::Index j = 0; j < n; ++j)
      for (std::size_t k = 0; k < modes[pose].smooth.size(); ++k)
        fields_.block<kOwn, kOwn>(kOwn * i, kOwn * j) +=
            modes[pose].smooth[k] * modes[static_cast<std::size_t>(j)].smooth[k].transpose();
  }
}

/// With the errors xi ~ N(0, K) integrated out, what is left of the unknowns u is H_uu - H_xu^T W H_xu, where
/// W = (K^-1 + H_xx)^-1 = K - K L (I + L^T K L)^-1 L^T K and H_xx = L L^T; then the shared ones go.
MotionTerms MotionEvidence::at(const ArmErrorLevel& level) const {
  const Eigen::Index n = poses(), s = prior_.rows() - 1, size = kOwn * n;
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(size, size);
  if (level.smooth > 0) {
    const Eigen::MatrixXd k = level.smooth * level.smooth * matern(squared_, level.reach);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j)
        K.block<kOwn, kOwn>(kOwn * i, kOwn * j) = k(i, j) * fields_.block<kOwn, kOwn>(kOwn * i, kOwn * j);
  }
  Eigen::MatrixXd KL(size, size), M(size, size);
  for (Eigen::Index i = 0; i < n; ++i)
    K.block<kOwn, kOwn>(kOwn * i, kOwn * i) +=
        level.rotation * level.rotation * rotation_.middleRows<kOwn>(kOwn * i) +
        level.translation * level.translation * translation_.middleRows<kOwn>(kOwn * i);
  for (Eigen::Index i = 0; i < n; ++i)
    KL.middleCols<kOwn>(kOwn * i).noalias() = K.middleCols<kOwn>(kOwn * i) * root_.middleRows<kOwn>(kOwn * i);
  for (Eigen::Index i = 0; i < n; ++i)
    M.middleRows<kOwn>(kOwn * i).noalias() =
        root_.middleRows<kOwn>(kOwn * i).transpose() * KL.middleRows<kOwn>(kOwn * i);
  M.diagonal().array() += 1;
  const Eigen::LLT<Eigen::MatrixXd> llt(M);
  const Eigen::MatrixXd Y = llt.matrixL().solve(KL.transpose());
  K.selfadjointView<Eigen::Lower>().rankUpdate(Y.transpose(), -1);
  const Eigen::MatrixXd W = K.selfadjointView<Eigen::Lower>();

  Eigen::MatrixXd H_s(size, s), H_ss = prior_.topLeftCorner(s, s);
  Eigen::VectorXd g(size), g_s = prior_.col(s).head(s);
  for (Eigen::Index i = 0; i < n; ++i) {
    const PoseInformation& pose = seen_[static_cast<std::size_t>(i)];
    H_s.middleRows<kOwn>(kOwn * i) = pose.H_s;
    g.segment<kOwn>(kOwn * i) = pose.g;
    H_ss += pose.H_ss;
    g_s += pose.g_s;
  }
  const Eigen::MatrixXd WH = W * H_s;
  const Eigen::VectorXd Wg = W * g;
  H_ss -= H_s.transpose() * WH;
  g_s -= H_s.transpose() * Wg;
  // Each unknown in units of what is known of it: lenses in pixels stand beside turns.
  const Eigen::VectorXd unit = H_ss.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = unit.asDiagonal() * H_ss * unit.asDiagonal();
  scaled.diagonal().array() += 1e-12;
  const Eigen::LLT<Eigen::MatrixXd> shared(scaled);
  const Eigen::VectorXd y_s = shared.matrixL().solve(unit.cwiseProduct(g_s));

  MotionTerms terms;
  terms.deviance = log_determinant(llt) - g.dot(Wg) + log_determinant(shared) - 2 * unit.array().log().sum() -
                   y_s.squaredNorm();
  for (int mover = 0; mover < 2; ++mover) {
    const int column = columns_[mover];
    Eigen::MatrixXd& J = terms.information[mover];
    J.resize(size, size);
    Eigen::MatrixXd cross(s, size);
    Eigen::VectorXd pull(size);
    for (Eigen::Index i = 0; i < n; ++i) {
      const PoseInformation& pose = seen_[static_cast<std::size_t>(i)];
      const Matrix6d own = pose.H_s.middleCols<kOwn>(column);
      J.middleCols<kOwn>(kOwn * i).noalias() = W.middleCols<kOwn>(kOwn * i) * own;
      cross.middleCols<kOwn>(kOwn * i) =
          pose.H_ss.middleCols<kOwn>(column) - WH.middleRows<kOwn>(kOwn * i).transpose() * own;
      pull.segment<kOwn>(kOwn * i) =
          own.transpose() * Wg.segment<kOwn>(kOwn * i) - pose.g_s.segment<kOwn>(column);
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      const PoseInformation& pose = seen_[static_cast<std::size_t>(i)];
      const Matrix6d own = pose.H_s.middleCols<kOwn>(column);
      J.middleRows<kOwn>(kOwn * i) = (-own.transpose() * J.middleRows<kOwn>(kOwn * i)).eval();
      J.block<kOwn, kOwn>(kOwn * i, kOwn * i) += pose.H_ss.block<kOwn, kOwn>(column, column);
    }
    const Eigen::MatrixXd reduced = shared.matrixL().solve(unit.asDiagonal() * cross);
    J.noalias() -= reduced.transpose() * reduced;
    terms.pull[mover] = pull + reduced.transpose() * y_s;
  }
  return terms;
}

}  // namespace flash::calib
