#pragma once
#include <ceres/ceres.h>

#include <utility>

#include "calib/dataset/edge_offset.h"
#include "calib/dataset/target_shape.h"
#include "calib/solve/lens_prior.h"

namespace flash::calib {

/// What is known of one of the errors of an arm's joints beforehand, without its loss.
class JointErrorPrior final : public ceres::CostFunction {
 public:
  JointErrorPrior(const Eigen::VectorXd& sd, Eigen::Index which) : weight_(1 / sd[which]), which_(which) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(static_cast<int>(sd.size()));
  }
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    *residual = weight_ * x[0][which_];
    if (jacobians && jacobians[0]) {
      Eigen::Map<Eigen::VectorXd> row(jacobians[0], parameter_block_sizes().front());
      row.setZero();
      row[which_] = weight_;
    }
    return true;
  }

 private:
  double weight_;
  Eigen::Index which_;
};

/// What is known of a target's size beforehand.
class ScalePrior final : public ceres::SizedCostFunction<1, 1> {
 public:
  explicit ScalePrior(double sd) : weight_(1 / sd) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    *residual = weight_ * (*x[0] - 1);
    if (jacobians && jacobians[0]) *jacobians[0] = weight_;
    return true;
  }

 private:
  double weight_;
};

/// Likewise of a target's warp.
class WarpPrior final : public ceres::SizedCostFunction<kWarp, kWarp> {
 public:
  explicit WarpPrior(double sd) : weight_(1 / sd) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    Eigen::Map<Warp>(residual, kWarp) = weight_ * Eigen::Map<const Warp>(x[0]);
    if (jacobians && jacobians[0])
      Eigen::Map<Eigen::Matrix<double, kWarp, kWarp>>(jacobians[0], kWarp, kWarp).setIdentity() *= weight_;
    return true;
  }

 private:
  double weight_;
};

/// Likewise of how far edges stand outwards.
class EdgePrior final : public ceres::SizedCostFunction<1, 1> {
 public:
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    *residual = *x[0] / kUsualEdgeOffset;
    if (jacobians && jacobians[0]) *jacobians[0] = 1 / kUsualEdgeOffset;
    return true;
  }
};

/// One part of what is known of a lens.
class LensPart final : public ceres::CostFunction {
 public:
  LensPart(LensPrior::Rows rows, const IntrinsicsVector& stated) : rows_(std::move(rows)), stated_(stated) {
    set_num_residuals(static_cast<int>(rows_.rows()));
    mutable_parameter_block_sizes()->push_back(kIntrinsics);
  }
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd>(residual, rows_.rows()) =
        rows_ * (Eigen::Map<const IntrinsicsVector>(x[0]) - stated_);
    if (jacobians && jacobians[0])
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, kIntrinsics, Eigen::RowMajor>>(
          jacobians[0], rows_.rows(), kIntrinsics) = rows_;
    return true;
  }

 private:
  LensPrior::Rows rows_;
  IntrinsicsVector stated_;
};

}  // namespace flash::calib
