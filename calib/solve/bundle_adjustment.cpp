#include "calib/solve/bundle_adjustment.h"

#include <ceres/ceres.h>
#if __has_include(<glog/logging.h>)
#include <glog/logging.h>
#endif

#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "calib/geometry/projection.h"
#include "calib/solve/correction_error.h"
#include "calib/solve/prior_costs.h"

namespace flash::calib {
namespace {

using Jacobian7 = Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor>;
using PoseBlock = std::array<double, 7>;  // t, then q as x y z w

const Eigen::Vector3d kBehind = Eigen::Vector3d::UnitZ();  // of a target

PoseBlock block_of(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  return {T.translation().x(), T.translation().y(), T.translation().z(), q.x(), q.y(), q.z(), q.w()};
}

Eigen::Isometry3d pose_of(const double* block) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Map<const Eigen::Vector3d>(block);
  T.linear() =
      Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(block + 3)).normalized().toRotationMatrix();
  return T;
}

/// SE(3) under the right perturbation. Cost functions put their derivative with respect to the perturbation
/// into the first six columns of the ambient Jacobian and zero into the last, which PlusJacobian = [I; 0]
/// hands through: what reaches the solver is exact.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* result) const override {
    const PoseBlock block = block_of(moved(pose_of(x), Eigen::Map<const Vector6d>(delta)));
    std::copy(block.begin(), block.end(), result);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* difference) const override {
    Eigen::Map<Vector6d>(difference, 6) = motion_between(pose_of(x), pose_of(y));
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

template <class Rows>
void set_pose_jacobian(double* target, const Rows& rows) {
  if (!target) return;
  Eigen::Map<Jacobian7> jacobian(target, rows.rows(), 7);
  jacobian.leftCols<6>() = rows;
  jacobian.col(6).setZero();
}

/// The chain through one view, made anew only when its links have moved: all corners of a view are evaluated
/// one after the other. Blocks: camera, base, target, correction; time offset.
class ViewChain {
 public:
  ViewChain(Setup setup, const RobotPose& pose) : setup_(setup), pose_(pose) {}

  const Chain& at(double const* const* x, double tau) {
    std::array<double, 29> links;
    for (std::size_t k = 0; k < 4; ++k) std::copy(x[k], x[k] + 7, links.begin() + 7 * k);
    links.back() = tau;
    if (!chain_ || links != links_) {
      chain_.emplace(setup_, pose_of(x[0]), pose_of(x[1]), pose_.T_base_gripper, pose_of(x[3]), pose_of(x[2]),
                     tau, pose_.velocity);
      links_ = links;
    }
    return *chain_;
  }

 private:
  Setup setup_;
  const RobotPose& pose_;
  std::array<double, 29> links_ = {};
  std::optional<Chain> chain_;
};

/// Blocks: camera, base, target, correction, intrinsics, scale, time offset, warp, edge offset.
class CornerCost final : public ceres::SizedCostFunction<2, 7, 7, 7, 7, kIntrinsics, 1, 1, kWarp, 1> {
 public:
  /// corner: of the view.
  CornerCost(std::shared_ptr<ViewChain> chain, const BundleView& view, Eigen::Index corner, double sigma)
      : chain_(std::move(chain)),
        point_(view.points.col(corner)),
        bow_(view.bows.col(corner)),
        pixel_(view.pixels.col(corner)),
        weight_(1 / sigma) {
    if (view.outward.cols() > 0) outward_ = view.outward.col(corner);
  }

  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const Chain& chain = chain_->at(x, *x[6]);
    const Eigen::Vector3d bowed = point_ + bow_.dot(Eigen::Map<const Warp>(x[7])) * kBehind;
    const Eigen::Vector3d p = *x[5] * bowed;
    const Eigen::Vector3d q = chain.target_in_camera() * p;
    if (!(q.z() > 1e-6)) return false;
    Eigen::Matrix<double, 2, 3> d_point;
    Eigen::Matrix<double, 2, kIntrinsics> d_intrinsics;
    const Eigen::Map<const IntrinsicsVector> intrinsics(x[4]);
    const Eigen::Vector2d seen =
        project(intrinsics, q, jacobians ? &d_point : nullptr, jacobians ? &d_intrinsics : nullptr);
    Eigen::Map<Eigen::Vector2d>(residual, 2) = weight_ * (seen + *x[8] * outward_ - pixel_);
    if (!jacobians) return true;
    d_point *= weight_;
    const Chain::Derivative d_correction = chain.d_correction(p);
    set_pose_jacobian(jacobians[0], d_point * chain.d_camera(q));
    set_pose_jacobian(jacobians[1], d_point * chain.d_base(d_correction));
    set_pose_jacobian(jacobians[2], d_point * chain.d_target(p));
    set_pose_jacobian(jacobians[3], d_point * d_correction);
    if (jacobians[4]) {
      Eigen::Map<Eigen::Matrix<double, 2, kIntrinsics, Eigen::RowMajor>> d(jacobians[4]);
      d = weight_ * d_intrinsics;
    }
    if (jacobians[5]) Eigen::Map<Eigen::Vector2d>(jacobians[5], 2) = d_point * chain.d_scale(bowed);
    if (jacobians[6]) Eigen::Map<Eigen::Vector2d>(jacobians[6], 2) = d_point * chain.d_time(d_correction);
    if (jacobians[7]) {
      Eigen::Map<Eigen::Matrix<double, 2, kWarp, Eigen::RowMajor>> d(jacobians[7]);
      d = *x[5] * d_point * chain.d_scale(kBehind) * bow_.transpose();
    }
    if (jacobians[8]) Eigen::Map<Eigen::Vector2d>(jacobians[8], 2) = weight_ * outward_;
    return true;
  }

 private:
  std::shared_ptr<ViewChain> chain_;
  Eigen::Vector3d point_;
  Warp bow_;
  Eigen::Vector2d pixel_, outward_ = Eigen::Vector2d::Zero();
  double weight_;
};

/// A depth along its ray against the target's plane. Blocks: camera, base, target, correction, time offset,
/// scale of the depth.
class DepthCost final : public ceres::SizedCostFunction<1, 7, 7, 7, 7, 1, 1> {
 public:
  DepthCost(std::shared_ptr<ViewChain> chain, const Eigen::Vector3d& point, double sigma)
      : chain_(std::move(chain)), point_(point), weight_(1 / sigma) {}

  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const Chain& chain = chain_->at(x, *x[4]);
    const Eigen::Vector3d point = point_ / *x[5];
    const DepthResidual depth = depth_residual(chain, point);
    *residual = weight_ * depth.value;
    if (!jacobians) return true;
    const Eigen::RowVector3d d_point = -weight_ * depth.d_material;
    const Chain::Derivative d_correction = chain.d_correction(depth.material);
    set_pose_jacobian(jacobians[0], d_point * chain.d_camera(point));
    set_pose_jacobian(jacobians[1], d_point * chain.d_base(d_correction));
    set_pose_jacobian(jacobians[2], d_point * chain.d_target(depth.material));
    set_pose_jacobian(jacobians[3], d_point * d_correction);
    if (jacobians[4]) *jacobians[4] = d_point.dot(chain.d_time(d_correction));
    if (jacobians[5]) *jacobians[5] = -weight_ * point.z() / *x[5];
    return true;
  }

 private:
  std::shared_ptr<ViewChain> chain_;
  Eigen::Vector3d point_;
  double weight_;
};

/// Blocks: correction, errors of the joints where they are unknowns.
class CorrectionPrior final : public ceres::CostFunction {
 public:
  CorrectionPrior(double translation, double rotation, Eigen::Vector3d pivot, const RobotPose& pose,
                  bool errors)
      : translation_(1 / translation), rotation_(1 / rotation), pivot_(std::move(pivot)), pose_(pose) {
    set_num_residuals(6);
    mutable_parameter_block_sizes()->push_back(7);
    if (errors) mutable_parameter_block_sizes()->push_back(static_cast<int>(pose.joint_motions.cols()));
  }

  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const bool errors = parameter_block_sizes().size() > 1;
    Eigen::Isometry3d usual = Eigen::Isometry3d::Identity();
    if (errors)
      usual = moved(
          usual, pose_.joint_motions * Eigen::Map<const Eigen::VectorXd>(x[1], pose_.joint_motions.cols()));
    const CorrectionError error = correction_error(pose_of(x[0]), usual, pivot_, pose_.joint_motions);
    const auto weighted = [&](auto rows) {
      rows.template topRows<3>() *= translation_;
      rows.template bottomRows<3>() *= rotation_;
      return rows;
    };
    Eigen::Map<Vector6d>(residual, 6) = weighted(error.value);
    if (!jacobians) return true;
    set_pose_jacobian(jacobians[0], weighted(error.by_correction));
    if (errors && jacobians[1])
      Eigen::Map<Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[1], 6, pose_.joint_motions.cols()) = weighted(error.by_errors);
    return true;
  }

 private:
  double translation_, rotation_;
  Eigen::Vector3d pivot_;
  const RobotPose& pose_;
};

/// What is known beforehand of the place of a camera, or a target, along a line.
class AlongCost final : public ceres::SizedCostFunction<1, 7> {
 public:
  explicit AlongCost(const AlongPrior& prior) : prior_(prior) {}
  bool Evaluate(double const* const* x, double* residual, double** jacobians) const override {
    const AlongResidual along = along_residual(prior_, pose_of(x[0]));
    *residual = along.value;
    if (jacobians) set_pose_jacobian(jacobians[0], along.by_pose);
    return true;
  }

 private:
  AlongPrior prior_;
};

/// The bundle as blocks of numbers, as Ceres wants it.
struct Blocks {
  std::vector<PoseBlock> cameras, bases, targets, corrections;
  std::vector<IntrinsicsVector> intrinsics;
  std::vector<Warp> warps;
  std::vector<Eigen::VectorXd> joint_errors;
  std::vector<double> scales, edge_offsets, time_offsets, depth_scales;

  explicit Blocks(const Bundle& bundle)
      : warps(bundle.warps),
        joint_errors(bundle.joint_errors),
        scales(bundle.scales),
        edge_offsets(bundle.edge_offsets),
        time_offsets(bundle.time_offsets),
        depth_scales(bundle.depth_scales) {
    warps.resize(bundle.targets.size(), Warp::Zero());
    edge_offsets.resize(bundle.cameras.size(), 0);
    depth_scales.resize(bundle.cameras.size(), 1);
    for (const Eigen::Isometry3d& T : bundle.cameras) cameras.push_back(block_of(T));
    for (const Eigen::Isometry3d& T : bundle.bases) bases.push_back(block_of(T));
    for (const Eigen::Isometry3d& T : bundle.targets) targets.push_back(block_of(T));
    for (const RobotPose& pose : bundle.poses) corrections.push_back(block_of(pose.correction));
    for (const data::CameraIntrinsics& camera : bundle.intrinsics) intrinsics.push_back(to_vector(camera));
  }

  void write_to(Bundle& bundle) const {
    for (std::size_t i = 0; i < cameras.size(); ++i) bundle.cameras[i] = pose_of(cameras[i].data());
    for (std::size_t i = 0; i < bases.size(); ++i) bundle.bases[i] = pose_of(bases[i].data());
    for (std::size_t i = 0; i < targets.size(); ++i) bundle.targets[i] = pose_of(targets[i].data());
    for (std::size_t i = 0; i < corrections.size(); ++i)
      bundle.poses[i].correction = pose_of(corrections[i].data());
    for (std::size_t i = 0; i < intrinsics.size(); ++i)
      bundle.intrinsics[i] = with_vector(bundle.intrinsics[i], intrinsics[i]);
    bundle.scales = scales;
    bundle.warps = warps;
    bundle.edge_offsets = edge_offsets;
    bundle.joint_errors = joint_errors;
    bundle.time_offsets = time_offsets;
    bundle.depth_scales = depth_scales;
  }
};

void add_views(ceres::Problem& problem, Blocks& blocks, const Bundle& bundle, const NoiseLevels& noise,
               const BundleSettings& settings) {
  for (const BundleView& view : bundle.views) {
    const RobotPose& pose = bundle.poses[static_cast<std::size_t>(view.pose)];
    const auto camera = static_cast<std::size_t>(view.camera), arm = static_cast<std::size_t>(pose.arm),
               target = static_cast<std::size_t>(view.target);
    double* correction = blocks.corrections[static_cast<std::size_t>(view.pose)].data();
    const auto chain = std::make_shared<ViewChain>(bundle.setup, pose);
    for (Eigen::Index i = 0; i < view.points.cols(); ++i) {
      problem.AddResidualBlock(new CornerCost(chain, view, i, view.corner_noise * noise.corner[camera]),
                               settings.huber > 0 ? new ceres::HuberLoss(settings.huber) : nullptr,
                               blocks.cameras[camera].data(), blocks.bases[arm].data(),
                               blocks.targets[target].data(), correction, blocks.intrinsics[camera].data(),
                               &blocks.scales[target], &blocks.time_offsets[arm], blocks.warps[target].data(),
                               &blocks.edge_offsets[camera]);
    }
    for (Eigen::Index i = 0; i < view.depth_points.cols(); ++i) {
      problem.AddResidualBlock(new DepthCost(chain, view.depth_points.col(i), noise.depth[camera]),
                               settings.huber > 0 ? new ceres::HuberLoss(settings.huber) : nullptr,
                               blocks.cameras[camera].data(), blocks.bases[arm].data(),
                               blocks.targets[target].data(), correction, &blocks.time_offsets[arm],
                               &blocks.depth_scales[camera]);
    }
  }
}

void hold(ceres::Problem& problem, double* block) {
  if (problem.HasParameterBlock(block)) problem.SetParameterBlockConstant(block);
}

/// Ceres lists blocks, and orders those of a group, by their addresses; rounding goes with the order. Each of
/// the shared blocks has a group of its own, so that a solution is the same bit by bit in every run.
void order_shared(const ceres::Problem& problem, Blocks& blocks, ceres::ParameterBlockOrdering& order) {
  int group = 1;
  const auto take = [&](double* block) {
    if (problem.HasParameterBlock(block) && !order.IsMember(block)) order.AddElementToGroup(block, group++);
  };
  for (auto* list : {&blocks.cameras, &blocks.bases, &blocks.targets, &blocks.corrections})
    for (PoseBlock& block : *list) take(block.data());
  for (IntrinsicsVector& block : blocks.intrinsics) take(block.data());
  for (Warp& block : blocks.warps) take(block.data());
  for (Eigen::VectorXd& block : blocks.joint_errors) take(block.data());
  for (auto* list : {&blocks.scales, &blocks.edge_offsets, &blocks.time_offsets, &blocks.depth_scales})
    for (double& block : *list) take(&block);
}

void set_unknowns(ceres::Problem& problem, Blocks& blocks, const Bundle& bundle, const NoiseLevels& noise,
                  const Unknowns& unknowns, ceres::ParameterBlockOrdering& order) {
  auto* const manifold = new PoseManifold;  // the problem owns it
  for (auto* list : {&blocks.cameras, &blocks.bases, &blocks.targets, &blocks.corrections})
    for (PoseBlock& block : *list)
      if (problem.HasParameterBlock(block.data())) problem.SetManifold(block.data(), manifold);
  hold(problem, blocks.bases.front().data());
  for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
    double* correction = blocks.corrections[i].data();
    if (!problem.HasParameterBlock(correction)) continue;
    if (unknowns.corrections) {
      const auto arm = static_cast<std::size_t>(bundle.poses[i].arm);
      const bool errors =
          unknowns.joint_errors && !blocks.joint_errors.empty() && blocks.joint_errors[arm].size() > 0;
      auto* const prior = new CorrectionPrior(noise.translation[arm], noise.rotation[arm], bundle.pivots[arm],
                                              bundle.poses[i], errors);
      if (errors)
        problem.AddResidualBlock(prior, nullptr, correction, blocks.joint_errors[arm].data());
      else
        problem.AddResidualBlock(prior, nullptr, correction);
      order.AddElementToGroup(correction, 0);
    } else {
      hold(problem, correction);
    }
  }
  for (std::size_t camera = 0; camera < blocks.intrinsics.size(); ++camera) {
    IntrinsicsVector& block = blocks.intrinsics[camera];
    if (!problem.HasParameterBlock(block.data())) continue;
    if (unknowns.intrinsics > 0 && !bundle.priors.lenses.empty()) {
      const LensPrior& prior = bundle.priors.lenses[camera];
      for (const LensPrior::Rows& part : prior.parts)
        problem.AddResidualBlock(new LensPart(part, prior.stated),
                                 new ceres::CauchyLoss(std::sqrt(kLensTail)), block.data());
    }
    std::vector<int> constant;
    for (int i = unknowns.intrinsics; i < kIntrinsics; ++i) constant.push_back(i);
    if (unknowns.intrinsics == 0)
      hold(problem, block.data());
    else if (!constant.empty())
      problem.SetManifold(block.data(), new ceres::SubsetManifold(kIntrinsics, constant));
  }
  for (std::size_t target = 0; target < blocks.scales.size(); ++target) {
    double* scale = &blocks.scales[target];
    if (!unknowns.scales)
      hold(problem, scale);
    else if (problem.HasParameterBlock(scale))
      problem.AddResidualBlock(new ScalePrior(prior_scale_sd(bundle.priors, target)), nullptr, scale);
  }
  for (std::size_t target = 0; target < blocks.warps.size(); ++target) {
    double* warp = blocks.warps[target].data();
    if (!unknowns.warps)
      hold(problem, warp);
    else if (problem.HasParameterBlock(warp))
      problem.AddResidualBlock(new WarpPrior(bundle.priors.warp_sd[target]), nullptr, warp);
  }
  for (std::size_t camera = 0; camera < blocks.edge_offsets.size(); ++camera) {
    double* offset = &blocks.edge_offsets[camera];
    if (!unknowns.edge_offsets || !sees_edges(bundle, camera))
      hold(problem, offset);
    else
      problem.AddResidualBlock(new EdgePrior, nullptr, offset);
  }
  for (std::size_t arm = 0; arm < blocks.joint_errors.size(); ++arm) {
    double* const block = blocks.joint_errors[arm].data();
    for (Eigen::Index i = 0; problem.HasParameterBlock(block) && i < bundle.joint_error_sd[arm].size(); ++i)
      problem.AddResidualBlock(new JointErrorPrior(bundle.joint_error_sd[arm], i),
                               new ceres::CauchyLoss(std::sqrt(kJointErrorTail)), block);
  }
  if (const std::optional<AlongPrior>& along = bundle.priors.along) {
    double* const block = (along->target ? blocks.targets : blocks.cameras).front().data();
    if (problem.HasParameterBlock(block)) problem.AddResidualBlock(new AlongCost(*along), nullptr, block);
  }
  for (double& tau : blocks.time_offsets)
    if (!unknowns.time_offsets) hold(problem, &tau);
  for (double& scale : blocks.depth_scales)
    if (!unknowns.depth_scales) hold(problem, &scale);

  order_shared(problem, blocks, order);
}

}  // namespace

namespace {

/// Ceres warns of singular steps on stderr, whatever its logging type; here they are an answer like others.
void silence_ceres() {
#if __has_include(<glog/logging.h>)
  static const bool silent = [] {
    FLAGS_minloglevel = google::GLOG_FATAL;
    return true;
  }();
  static_cast<void>(silent);
#endif
}

}  // namespace

BundleSummary solve_bundle(Bundle& bundle, const NoiseLevels& noise, const BundleSettings& settings) {
  silence_ceres();
  Blocks blocks(bundle);
  ceres::Problem problem;
  add_views(problem, blocks, bundle, noise, settings);
  ceres::Solver::Options options;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  set_unknowns(problem, blocks, bundle, noise, settings.unknowns, *options.linear_solver_ordering);
  options.linear_solver_type = settings.unknowns.corrections ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
  options.max_num_iterations = settings.iterations;
  options.function_tolerance = settings.tolerance;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  blocks.write_to(bundle);
  return {summary.final_cost, static_cast<int>(summary.iterations.size()),
          summary.termination_type == ceres::CONVERGENCE};
}

}  // namespace flash::calib
