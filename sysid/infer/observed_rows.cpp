#include "sysid/infer/observed_rows.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

namespace flash::sysid {
namespace {

using Term = LinearObservations::Term;

/// Distances beyond this count by less than their square: none without robustness.
double limit_of(std::vector<double> distances, const Robust& robust) {
  // Standard deviation over the median of normal distances. Theory: 1 over the normal quantile of 75 %.
  constexpr double kSpread = 1.4826;
  if (robust.kind != RobustKind::trimmed) return INFINITY;
  const auto at = [&](double share) {
    const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(distances.size() - 1));
    std::nth_element(distances.begin(), distances.begin() + k, distances.end());
    return distances[static_cast<std::size_t>(k)];
  };
  return std::max(3 * kSpread * at(0.5), at(1 - robust.trim_fraction));
}

/// What counts less: of each keyframe and term, distances that are larger than its others.
Eigen::VectorXd robust_weights(const LinearObservations& places, const Robust& robust) {
  std::map<std::pair<std::size_t, Term>, std::vector<double>> distances;
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    const auto row = places.row(i);
    distances[{row.observation, row.term}].push_back(std::abs(row.distance));
  }
  std::map<std::pair<std::size_t, Term>, double> limits;
  for (const auto& [key, values] : distances) limits[key] = limit_of(values, robust);
  Eigen::VectorXd weights(places.rows());
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    const auto row = places.row(i);
    const double ratio = limits[{row.observation, row.term}] / std::max(std::abs(row.distance), 1e-15);
    weights[i] = row.term == Term::force || ratio >= 1 ? 1 : ratio * ratio;
  }
  return weights;
}

/// The two directions in which the sheet at rest extends most, and its centre.
std::pair<Eigen::Vector3d, Eigen::Matrix<double, 3, 2>> plane_of(const data::Points& vertices) {
  const Eigen::RowVector3d centre = vertices.colwise().mean();
  const Eigen::MatrixXd from_centre = vertices.rowwise() - centre;
  const Eigen::Matrix3d spread = from_centre.transpose() * from_centre;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(spread);
  return {centre.transpose(), eigen.eigenvectors().rightCols<2>()};
}

}  // namespace

double scale_of(const LinearObservations::Row& row, const Objective& objective) {
  switch (row.term) {
    case Term::surface:
      break;
    case Term::border:
      return objective.cloud_sigma / objective.contour_sigma;
    case Term::mark:
      return objective.cloud_sigma / objective.marker_sigma;
    case Term::force:
      return objective.cloud_sigma / objective.force_sigma;
  }
  return 1;
}

ObservedRows observed_rows(const Replay& replay, const LinearObservations& places, const Robust& robust) {
  ObservedRows rows;
  std::map<std::size_t, int> keyframes;
  std::map<std::pair<Term, int>, int> channels;
  rows.places.resize(places.rows(), 2);
  rows.weights = robust_weights(places, robust);
  const auto [centre, plane] = plane_of(replay.surface.vertices);
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    const auto row = places.row(i);
    const auto [keyframe, is_new] =
        keyframes.try_emplace(row.observation, static_cast<int>(keyframes.size()));
    if (is_new) rows.times.push_back(replay.observations[row.observation].t);
    const auto channel = channels.try_emplace({row.term, row.axis}, static_cast<int>(channels.size())).first;
    rows.keyframe.push_back(keyframe->second);
    rows.channel.push_back(channel->second);
    rows.weights[i] *= replay.observations[row.observation].weight;
    const Eigen::Vector3d rest = row.term == Term::force ? centre : row.rest;
    rows.places.row(i) = (plane.transpose() * (rest - centre)).transpose();
  }
  return rows;
}

}  // namespace flash::sysid
