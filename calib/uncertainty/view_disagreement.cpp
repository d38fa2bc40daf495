#include "calib/uncertainty/view_disagreement.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "data/numbers/jackknife.h"

namespace flash::calib {
namespace {

/// Columns of lenses, warps and edges.
std::vector<int> lens_columns(const SharedColumns& columns) {
  std::vector<int> list;
  const auto take = [&](const std::vector<int>& firsts, int width) {
    for (const int first : firsts)
      for (int i = 0; first >= 0 && i < width; ++i) list.push_back(first + i);
  };
  take(columns.intrinsics, columns.intrinsics_count);
  take(columns.warps, kWarp);
  take(columns.edge_offsets, 1);
  return list;
}

/// The terms of some shared unknowns in a Gram matrix of [own shared residual], own unknowns eliminated.
data::GroupTerms reduced(const Eigen::MatrixXd& gram, int own, const std::vector<int>& unknowns) {
  std::vector<int> kept;
  for (const int column : unknowns) kept.push_back(own + column);
  kept.push_back(static_cast<int>(gram.cols()) - 1);
  const Eigen::MatrixXd cross = gram.topRows(own)(Eigen::all, kept);
  Eigen::MatrixXd left = gram(kept, kept);
  left -= cross.transpose() * gram.topLeftCorner(own, own).ldlt().solve(cross);
  const auto count = static_cast<Eigen::Index>(unknowns.size());
  return {left.topLeftCorner(count, count), left.col(count).head(count)};
}

/// The groups' terms at the unknowns' own least squares, and the information of all.
struct AtLeast {
  std::vector<data::GroupTerms> groups;
  Eigen::MatrixXd information;
};

AtLeast at_least_squares(std::vector<data::GroupTerms> groups, const data::GroupTerms& prior) {
  Eigen::MatrixXd information = prior.information;
  Eigen::VectorXd gradient = prior.gradient;
  for (const data::GroupTerms& group : groups) {
    information += group.information;
    gradient += group.gradient;
  }
  const Eigen::VectorXd step = -information.ldlt().solve(gradient);
  for (data::GroupTerms& group : groups) group.gradient += group.information * step;
  return {std::move(groups), std::move(information)};
}

}  // namespace

double lens_disagreement(const Refinement& refined, const BundleSettings& settings) {
  const SharedColumns columns = shared_columns(refined.bundle, settings.unknowns);
  if (columns.intrinsics_count == 0 || !settings.unknowns.corrections) return 1;
  const std::vector<int> lens = lens_columns(columns);
  const LinearModel model = linearize(refined.bundle, refined.noise, settings);
  std::vector<data::GroupTerms> views;
  for (const GramBlock& block : model.blocks) {
    if (block.component >= static_cast<int>(refined.bundle.cameras.size())) continue;  // no corners
    const double sigma = refined.noise.corner[static_cast<std::size_t>(block.component)];
    views.push_back(reduced(block.gram / (sigma * sigma), model.own, lens));
  }
  const AtLeast fit = at_least_squares(std::move(views), reduced(model.prior, 0, lens));
  return std::max(1.0, data::jackknife_factor(fit.groups, fit.information, fit.information));
}

double camera_disagreement(const Refinement& refined, const BundleSettings& settings) {
  if (!settings.unknowns.corrections) return 1;
  const SharedColumns columns = shared_columns(refined.bundle, settings.unknowns);
  const LinearModel model = linearize(refined.bundle, refined.noise, settings);
  const std::vector<double> sigmas = to_components(refined.noise);
  const Eigen::Index width = model.own + model.shared + 1;
  std::vector<Eigen::MatrixXd> grams(static_cast<std::size_t>(model.groups),
                                     Eigen::MatrixXd::Zero(width, width));
  for (const GramBlock& block : model.blocks)
    grams[static_cast<std::size_t>(block.group)] +=
        block.gram * std::pow(sigmas[static_cast<std::size_t>(block.component)], -2);
  std::vector<int> all;
  for (int i = 0; i < model.shared; ++i) all.push_back(i);
  std::vector<data::GroupTerms> poses;
  for (const Eigen::MatrixXd& gram : grams) poses.push_back(reduced(gram, model.own, all));
  const AtLeast fit = at_least_squares(std::move(poses), reduced(model.prior, 0, all));
  Eigen::MatrixXd metric = Eigen::MatrixXd::Zero(model.shared, model.shared);
  const int camera = columns.cameras.front();
  const Eigen::MatrixXd covariance =
      fit.information.ldlt().solve(Eigen::MatrixXd::Identity(model.shared, model.shared));
  metric.block<6, 6>(camera, camera) = covariance.block<6, 6>(camera, camera).inverse();
  return std::max(1.0, data::jackknife_factor(fit.groups, fit.information, metric));
}

Eigen::MatrixXd with_lens_raised(const Eigen::MatrixXd& covariance, const SharedColumns& columns,
                                 double factor) {
  const std::vector<int> lens = lens_columns(columns);
  if (lens.empty() || factor == 1) return covariance;
  const Eigen::MatrixXd rows = covariance(lens, Eigen::all), own = covariance(lens, lens);
  return covariance + (factor - 1) * rows.transpose() * own.ldlt().solve(rows);
}

}  // namespace flash::calib
