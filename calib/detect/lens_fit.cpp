#include "calib/detect/lens_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/dataset/edge_offset.h"
#include "calib/dataset/target_shape.h"
#include "calib/geometry/pose.h"
#include "data/numbers/jackknife.h"

namespace flash::calib {
namespace {

constexpr Eigen::Index kExtra = kWarp + 1;  // the warp and the edges' offset

/// Of one view: information of the shared unknowns, of its pose and of both, and their gradients.
struct ViewTerms {
  Eigen::MatrixXd shared, cross;  // s x s, s x 6
  Matrix6d pose = Matrix6d::Zero();
  Eigen::VectorXd g_shared;
  Vector6d g_pose = Vector6d::Zero();
};

ViewTerms terms_of(const LensFit& fit, std::size_t view, const std::vector<int>& unknowns,
                   const Eigen::Matrix3Xd& points, const Bows& bows, const Observation& seen) {
  const Eigen::Index count = static_cast<Eigen::Index>(unknowns.size()), s = count + kExtra;
  ViewTerms terms{.shared = Eigen::MatrixXd::Zero(s, s),
                  .cross = Eigen::MatrixXd::Zero(s, 6),
                  .g_shared = Eigen::VectorXd::Zero(s)};
  const Eigen::Isometry3d& pose = fit.poses[view];
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    const Warp bow = bows.col(seen.points[i]);
    const Eigen::Vector3d p = points.col(seen.points[i]) + fit.warp.dot(bow) * Eigen::Vector3d::UnitZ();
    Eigen::Matrix<double, 2, 3> by_point;
    Eigen::Matrix<double, 2, kIntrinsics> by_all;
    const auto column = static_cast<Eigen::Index>(i);
    const Eigen::Vector2d outward =
        seen.outward.cols() > 0 ? Eigen::Vector2d(seen.outward.col(column)) : Eigen::Vector2d::Zero();
    const Eigen::Vector2d residual =
        project(fit.lens, pose * p, &by_point, &by_all) + fit.edge_offset * outward - seen.pixels.col(column);
    Eigen::MatrixXd by_shared(2, s);
    by_shared << by_all(Eigen::all, unknowns), by_point * pose.linear().col(2) * bow.transpose(), outward;
    Eigen::Matrix<double, 3, 6> motion;
    motion << pose.linear(), -pose.linear() * skew(p);
    const Eigen::Matrix<double, 2, 6> by_pose = by_point * motion;
    terms.shared += by_shared.transpose() * by_shared;
    terms.cross += by_shared.transpose() * by_pose;
    terms.pose += by_pose.transpose() * by_pose;
    terms.g_shared += by_shared.transpose() * residual;
    terms.g_pose += by_pose.transpose() * residual;
  }
  return terms;
}

double squares(const LensFit& fit, const Eigen::Matrix3Xd& points,
               const std::vector<const Observation*>& views) {
  double sum = 0;
  for (std::size_t v = 0; v < views.size(); ++v) sum += residuals(fit, v, points, *views[v]).squaredNorm();
  return sum;
}

}  // namespace

Eigen::Matrix2Xd residuals(const LensFit& fit, std::size_t view, const Eigen::Matrix3Xd& points,
                           const Observation& seen) {
  const Eigen::Matrix3Xd bent = shaped(points, target_bows(points), {.warp = fit.warp});
  Eigen::Matrix2Xd result = seen.pixels;
  if (seen.outward.cols() > 0) result -= fit.edge_offset * seen.outward;
  for (Eigen::Index i = 0; i < result.cols(); ++i)
    result.col(i) -= project(fit.lens, fit.poses[view] * bent.col(seen.points[static_cast<std::size_t>(i)]));
  return result;
}

LensFit fit_lens(LensFit fit, const std::vector<int>& unknowns, const Eigen::Matrix3Xd& points,
                 const std::vector<const Observation*>& views) {
  constexpr int kSteps = 30;
  constexpr double kStill = 1e-6;  // of a step, in standard deviations
  const Bows bows = target_bows(points);
  const Eigen::Index count = static_cast<Eigen::Index>(unknowns.size()), s = count + kExtra;
  double freedom = -static_cast<double>(s);
  for (const Observation* view : views) freedom += 2 * static_cast<double>(view->points.size()) - 6;
  freedom = std::max(1.0, freedom);
  double damping = 0;
  for (int step = 0; step < kSteps; ++step) {
    // Exact corners would leave the priors without a weight.
    const double before = squares(fit, points, views);
    fit.variance = std::max(1e-12, before / freedom);
    using Extra = Eigen::Matrix<double, kExtra, 1>;
    Extra prior = Extra::Constant(fit.variance / std::pow(usual_warp_sd(points), 2));
    prior[kWarp] = fit.variance / (kUsualEdgeOffset * kUsualEdgeOffset);
    const auto extra = [](const LensFit& of) { return (Extra() << of.warp, of.edge_offset).finished(); };
    const auto held = [&](const LensFit& of) { return prior.dot(extra(of).cwiseAbs2()); };
    Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(s, s);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(s);
    reduced.bottomRightCorner<kExtra, kExtra>().diagonal() = prior;
    gradient.tail<kExtra>() = prior.cwiseProduct(extra(fit));
    std::vector<ViewTerms> terms;
    std::vector<data::GroupTerms> of_views;  // their poses eliminated
    for (std::size_t v = 0; v < views.size(); ++v) {
      const ViewTerms& own = terms.emplace_back(terms_of(fit, v, unknowns, points, bows, *views[v]));
      const Eigen::LDLT<Matrix6d> pose(own.pose);
      of_views.push_back({own.shared - own.cross * pose.solve(own.cross.transpose()),
                          own.g_shared - own.cross * pose.solve(own.g_pose)});
      reduced += of_views.back().information;
      gradient += of_views.back().gradient;
    }
    fit.covariance = fit.variance * reduced.ldlt().solve(Eigen::MatrixXd::Identity(s, s));
    fit.view_factor = std::max(1.0, data::jackknife_factor(of_views, reduced, reduced) / fit.variance);
    fit.covariance *= fit.view_factor;
    Eigen::MatrixXd damped = reduced;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd move = -damped.ldlt().solve(gradient);
    LensFit next = fit;
    next.lens(unknowns) += move.head(count);
    next.warp += move.segment<kWarp>(count);
    next.edge_offset += move[count + kWarp];
    for (std::size_t v = 0; v < views.size(); ++v)
      next.poses[v] = moved(fit.poses[v],
                            -terms[v].pose.ldlt().solve(terms[v].g_pose + terms[v].cross.transpose() * move));
    const double worth = before + held(fit), cost = squares(next, points, views) + held(next);
    if (!(cost <= worth * (1 + 1e-12))) {
      damping = std::max(1e-3, 10 * damping);
      continue;
    }
    const bool still = move.dot(reduced * move) < kStill * kStill * fit.variance;
    fit.lens = next.lens;
    fit.warp = next.warp;
    fit.edge_offset = next.edge_offset;
    fit.poses = std::move(next.poses);
    if (still) break;
    damping = damping > 1e-3 ? 0.1 * damping : 0;
  }
  return fit;
}

}  // namespace flash::calib
