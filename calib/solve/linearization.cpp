#include "calib/solve/linearization.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/geometry/projection.h"
#include "calib/solve/correction_error.h"

namespace flash::calib {
namespace {

constexpr int kOwn = 6;

/// Rows of [d_correction d_shared residual] for one point.
class RowBuilder {
 public:
  RowBuilder(const Bundle& bundle, const BundleView& view, const Unknowns& unknowns,
             const SharedColumns& columns)
      : columns_(columns),
        own_(unknowns.corrections ? kOwn : 0),
        chain_(chain_of(bundle, view)),
        camera_(static_cast<std::size_t>(view.camera)),
        target_(static_cast<std::size_t>(view.target)),
        arm_(static_cast<std::size_t>(bundle.poses[static_cast<std::size_t>(view.pose)].arm)) {}

  Eigen::Index width() const { return own_ + columns_.count + 1; }
  const Chain& chain() const { return chain_; }
  int first_shared() const { return own_; }

  /// d_q: derivative of the residual with respect to the point in the camera frame.
  template <int Rows>
  void fill(const Eigen::Matrix<double, Rows, 3>& d_q, const Eigen::Vector3d& p, const Eigen::Vector3d& q,
            Eigen::Matrix<double, Rows, Eigen::Dynamic>& rows) const {
    const Chain::Derivative d_correction = chain_.d_correction(p);
    rows.setZero(Rows, width());
    if (own_ > 0) rows.leftCols(kOwn) = d_q * d_correction;
    rows.middleCols(own_ + columns_.cameras[camera_], 6) = d_q * chain_.d_camera(q);
    rows.middleCols(own_ + columns_.targets[target_], 6) = d_q * chain_.d_target(p);
    if (columns_.bases[arm_] >= 0)
      rows.middleCols(own_ + columns_.bases[arm_], 6) = d_q * chain_.d_base(d_correction);
    if (columns_.time_offsets[arm_] >= 0)
      rows.col(own_ + columns_.time_offsets[arm_]) = d_q * chain_.d_time(d_correction);
  }

 private:
  const SharedColumns& columns_;
  int own_;
  Chain chain_;
  std::size_t camera_, target_, arm_;
};

double huber_weight(double norm, double sigma, double huber) {
  return huber > 0 && norm > huber * sigma ? huber * sigma / norm : 1.0;
}

Eigen::MatrixXd depth_gram(const Bundle& bundle, const BundleView& view, const Unknowns& unknowns,
                           const SharedColumns& columns, double sigma, double huber, double& count) {
  const RowBuilder builder(bundle, view, unknowns, columns);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(builder.width(), builder.width());
  Eigen::Matrix<double, 1, Eigen::Dynamic> row;
  const auto camera = static_cast<std::size_t>(view.camera);
  const double scale = depth_scale(bundle, camera);
  for (Eigen::Index i = 0; i < view.depth_points.cols(); ++i) {
    const Eigen::Vector3d point = view.depth_points.col(i) / scale;
    const DepthResidual depth = depth_residual(builder.chain(), point);
    builder.fill<1>(-depth.d_material, depth.material, point, row);
    if (columns.depth_scales[camera] >= 0)
      row[builder.first_shared() + columns.depth_scales[camera]] = -point.z() / scale;
    row[builder.width() - 1] = depth.value;
    const double weight = huber_weight(std::abs(depth.value), sigma, huber);
    gram += weight * row.transpose() * row;
    count += weight;
  }
  return gram;
}

/// The prior of a correction, linearised: its rotation and its translation. errors: column of the first
/// error of its joints among all, or none.
std::pair<Eigen::MatrixXd, Eigen::MatrixXd> prior_grams(const Bundle& bundle, const RobotPose& pose,
                                                        Eigen::Index width,
                                                        std::optional<Eigen::Index> errors) {
  const Eigen::Vector3d& pivot = bundle.pivots[static_cast<std::size_t>(pose.arm)];
  const CorrectionError error =
      correction_error(pose.correction, usual_correction(bundle, pose), pivot, pose.joint_motions);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(6, width);
  rows.leftCols<6>() = error.by_correction;
  if (errors) rows.middleCols(*errors, error.by_errors.cols()) = error.by_errors;
  rows.col(width - 1) = error.value;
  const Eigen::MatrixXd translation = rows.topRows<3>(), rotation = rows.bottomRows<3>();
  return {rotation.transpose() * rotation, translation.transpose() * translation};
}

/// Of what is known of the shared unknowns beforehand, in unit variance.
Eigen::MatrixXd shared_prior(const Bundle& bundle, const SharedColumns& columns) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(columns.count + 1, columns.count + 1);
  for (std::size_t target = 0; target < bundle.targets.size(); ++target) {
    if (columns.scales[target] < 0) continue;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(columns.count + 1);
    const double sd = prior_scale_sd(bundle.priors, target);
    row[columns.scales[target]] = 1 / sd;
    row[columns.count] = (bundle.scales[target] - 1) / sd;
    gram += row * row.transpose();
  }
  for (std::size_t target = 0; target < bundle.targets.size(); ++target) {
    if (columns.warps[target] < 0) continue;
    const double weight = std::pow(bundle.priors.warp_sd[target], -2);
    for (Eigen::Index axis = 0; axis < kWarp; ++axis) {
      const Eigen::Index column = columns.warps[target] + axis;
      const double warp = bundle.warps[target][axis];
      gram(column, column) += weight;
      gram(column, columns.count) += weight * warp;
      gram(columns.count, column) += weight * warp;
      gram(columns.count, columns.count) += weight * warp * warp;
    }
  }
  for (std::size_t camera = 0; camera < bundle.cameras.size(); ++camera) {
    if (columns.edge_offsets[camera] < 0) continue;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(columns.count + 1);
    row[columns.edge_offsets[camera]] = 1 / kUsualEdgeOffset;
    row[columns.count] = edge_offset(bundle, camera) / kUsualEdgeOffset;
    gram += row * row.transpose();
  }
  for (std::size_t arm = 0; arm < columns.joint_errors.size(); ++arm) {
    if (columns.joint_errors[arm] < 0) continue;
    const Eigen::VectorXd& errors = bundle.joint_errors[arm];
    const Eigen::VectorXd weights = joint_error_weights(bundle, arm), weighted = weights.cwiseProduct(errors);
    const Eigen::Index first = columns.joint_errors[arm], count = errors.size();
    gram.diagonal().segment(first, count) += weights;
    gram.col(columns.count).segment(first, count) += weighted;
    gram.row(columns.count).segment(first, count) += weighted.transpose();
    gram(columns.count, columns.count) += weighted.dot(errors);
  }
  if (const std::optional<AlongPrior>& along = bundle.priors.along) {
    const AlongResidual residual =
        along_residual(*along, (along->target ? bundle.targets : bundle.cameras).front());
    Eigen::VectorXd row = Eigen::VectorXd::Zero(columns.count + 1);
    row.segment<6>((along->target ? columns.targets : columns.cameras).front()) =
        residual.by_pose.transpose();
    row[columns.count] = residual.value;
    gram += row * row.transpose();
  }
  for (std::size_t camera = 0; camera < bundle.priors.lenses.size(); ++camera) {
    const int first = columns.intrinsics[camera], count = columns.intrinsics_count;
    if (first < 0) continue;
    std::vector<int> places;
    for (int i = 0; i < count; ++i) places.push_back(first + i);
    places.push_back(columns.count);
    gram(places, places) +=
        lens_prior_gram(bundle.priors.lenses[camera], to_vector(bundle.intrinsics[camera]), count);
  }
  return gram;
}

}  // namespace

SharedColumns shared_columns(const Bundle& bundle, const Unknowns& unknowns) {
  SharedColumns columns;
  const auto take = [&columns](std::vector<int>& list, std::size_t size, int width, std::size_t first = 0) {
    list.assign(size, -1);
    for (std::size_t i = first; i < size && width > 0; ++i) {
      list[i] = columns.count;
      columns.count += width;
    }
  };
  take(columns.cameras, bundle.cameras.size(), 6);
  take(columns.targets, bundle.targets.size(), 6);
  take(columns.bases, bundle.bases.size(), 6, 1);
  take(columns.intrinsics, bundle.cameras.size(), unknowns.intrinsics);
  columns.intrinsics_count = unknowns.intrinsics;
  take(columns.scales, bundle.targets.size(), unknowns.scales ? 1 : 0);
  take(columns.warps, bundle.targets.size(), unknowns.warps ? kWarp : 0);
  columns.edge_offsets.assign(bundle.cameras.size(), -1);
  for (std::size_t camera = 0; unknowns.edge_offsets && camera < bundle.cameras.size(); ++camera)
    if (sees_edges(bundle, camera)) columns.edge_offsets[camera] = columns.count++;
  columns.joint_errors.assign(bundle.joint_errors.size(), -1);
  for (std::size_t arm = 0; unknowns.joint_errors && arm < bundle.joint_errors.size(); ++arm) {
    if (bundle.joint_errors[arm].size() == 0) continue;
    columns.joint_errors[arm] = columns.count;
    columns.count += static_cast<int>(bundle.joint_errors[arm].size());
  }
  take(columns.time_offsets, bundle.bases.size(), unknowns.time_offsets ? 1 : 0);
  columns.depth_scales.assign(bundle.cameras.size(), -1);
  for (const BundleView& view : bundle.views) {
    int& column = columns.depth_scales[static_cast<std::size_t>(view.camera)];
    if (unknowns.depth_scales && view.depth_points.cols() > 0 && column < 0) column = columns.count++;
  }
  return columns;
}

void move_shared(Bundle& bundle, const SharedColumns& columns, const Eigen::VectorXd& step) {
  const auto move_poses = [&](std::vector<Eigen::Isometry3d>& poses, const std::vector<int>& list) {
    for (std::size_t i = 0; i < poses.size(); ++i)
      if (list[i] >= 0) poses[i] = moved(poses[i], step.segment<6>(list[i]));
  };
  const auto move_numbers = [&](std::vector<double>& numbers, const std::vector<int>& list) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      if (list[i] >= 0) numbers[i] += step[list[i]];
  };
  move_poses(bundle.cameras, columns.cameras);
  move_poses(bundle.targets, columns.targets);
  move_poses(bundle.bases, columns.bases);
  move_numbers(bundle.scales, columns.scales);
  bundle.warps.resize(bundle.targets.size(), Warp::Zero());
  for (std::size_t i = 0; i < bundle.warps.size(); ++i)
    if (columns.warps[i] >= 0) bundle.warps[i] += step.segment<kWarp>(columns.warps[i]);
  bundle.edge_offsets.resize(bundle.cameras.size(), 0);
  move_numbers(bundle.edge_offsets, columns.edge_offsets);
  for (std::size_t arm = 0; arm < bundle.joint_errors.size(); ++arm)
    if (columns.joint_errors[arm] >= 0)
      bundle.joint_errors[arm] += step.segment(columns.joint_errors[arm], bundle.joint_errors[arm].size());
  move_numbers(bundle.time_offsets, columns.time_offsets);
  bundle.depth_scales.resize(bundle.cameras.size(), 1);
  move_numbers(bundle.depth_scales, columns.depth_scales);
  for (std::size_t camera = 0; camera < bundle.intrinsics.size(); ++camera) {
    if (columns.intrinsics[camera] < 0) continue;
    IntrinsicsVector intrinsics = to_vector(bundle.intrinsics[camera]);
    intrinsics.head(columns.intrinsics_count) +=
        step.segment(columns.intrinsics[camera], columns.intrinsics_count);
    bundle.intrinsics[camera] = with_vector(bundle.intrinsics[camera], intrinsics);
  }
}

std::vector<double> to_components(const NoiseLevels& noise) {
  std::vector<double> components;
  for (const auto* list : {&noise.corner, &noise.depth, &noise.rotation, &noise.translation})
    components.insert(components.end(), list->begin(), list->end());
  return components;
}

NoiseLevels to_noise(const std::vector<double>& components, const NoiseLevels& like) {
  NoiseLevels noise = like;
  auto next = components.begin();
  for (auto* list : {&noise.corner, &noise.depth, &noise.rotation, &noise.translation})
    for (double& sigma : *list) sigma = *next++;
  return noise;
}

Eigen::MatrixXd corner_gram(const Bundle& bundle, const BundleView& view, const Unknowns& unknowns,
                            const SharedColumns& columns, double sigma, double huber, double& count) {
  const RowBuilder builder(bundle, view, unknowns, columns);
  const auto camera = static_cast<std::size_t>(view.camera), target = static_cast<std::size_t>(view.target);
  const IntrinsicsVector intrinsics = to_vector(bundle.intrinsics[camera]);
  const double scale = bundle.scales[target];
  const Eigen::Matrix3Xd points = true_points(bundle, view);
  const Eigen::Matrix2Xd pixels = true_pixels(bundle, view);
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(builder.width(), builder.width());
  Eigen::Matrix<double, 2, Eigen::Dynamic> rows;
  Eigen::Matrix<double, 2, 3> d_q;
  Eigen::Matrix<double, 2, kIntrinsics> d_intrinsics;
  for (Eigen::Index i = 0; i < view.points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i);
    const Eigen::Vector3d q = builder.chain().target_in_camera() * p;
    const Eigen::Vector2d residual = project(intrinsics, q, &d_q, &d_intrinsics) - pixels.col(i);
    builder.fill<2>(d_q, p, q, rows);
    if (columns.intrinsics[camera] >= 0)
      rows.middleCols(builder.first_shared() + columns.intrinsics[camera], unknowns.intrinsics) =
          d_intrinsics.leftCols(unknowns.intrinsics);
    if (columns.scales[target] >= 0)
      rows.col(builder.first_shared() + columns.scales[target]) = d_q * builder.chain().d_scale(p / scale);
    if (columns.warps[target] >= 0)
      rows.middleCols<kWarp>(builder.first_shared() + columns.warps[target]) =
          scale * d_q * builder.chain().d_scale(Eigen::Vector3d::UnitZ()) * view.bows.col(i).transpose();
    if (columns.edge_offsets[camera] >= 0 && view.outward.cols() > 0)
      rows.col(builder.first_shared() + columns.edge_offsets[camera]) = view.outward.col(i);
    rows.col(builder.width() - 1) = residual;
    const double weight = huber_weight(residual.norm(), view.corner_noise * sigma, huber);
    gram += weight * rows.transpose() * rows;
    count += 2 * weight;
  }
  return gram / (view.corner_noise * view.corner_noise);
}

LinearModel linearize(const Bundle& bundle, const NoiseLevels& noise, const BundleSettings& settings) {
  const SharedColumns columns = shared_columns(bundle, settings.unknowns);
  const int cameras = static_cast<int>(bundle.cameras.size()), arms = static_cast<int>(bundle.bases.size());
  LinearModel model;
  model.groups = static_cast<int>(bundle.poses.size());
  model.components = 2 * cameras + 2 * arms;
  model.own = settings.unknowns.corrections ? kOwn : 0;
  model.shared = columns.count;
  model.prior = shared_prior(bundle, columns);
  for (const BundleView& view : bundle.views) {
    const auto camera = static_cast<std::size_t>(view.camera);
    GramBlock corners{.group = view.pose, .component = view.camera, .gram = {}};
    corners.gram = corner_gram(bundle, view, settings.unknowns, columns, noise.corner[camera], settings.huber,
                               corners.count);
    model.blocks.push_back(std::move(corners));
    if (view.depth_points.cols() == 0) continue;
    GramBlock depths{.group = view.pose, .component = cameras + view.camera, .gram = {}};
    depths.gram = depth_gram(bundle, view, settings.unknowns, columns, noise.depth[camera], settings.huber,
                             depths.count);
    model.blocks.push_back(std::move(depths));
  }
  if (!settings.unknowns.corrections) return model;
  for (int i = 0; i < model.groups; ++i) {
    // A pose that nothing saw still needs its prior to be determined; it then tells nothing of the noise.
    const RobotPose& pose = bundle.poses[static_cast<std::size_t>(i)];
    std::optional<Eigen::Index> errors;
    if (!columns.joint_errors.empty() && columns.joint_errors[static_cast<std::size_t>(pose.arm)] >= 0)
      errors = model.own + columns.joint_errors[static_cast<std::size_t>(pose.arm)];
    auto [rotation, translation] = prior_grams(bundle, pose, model.own + model.shared + 1, errors);
    const double count = 3;
    model.blocks.push_back({i, 2 * cameras + pose.arm, count, std::move(rotation)});
    model.blocks.push_back({i, 2 * cameras + arms + pose.arm, count, std::move(translation)});
  }
  return model;
}

}  // namespace flash::calib
