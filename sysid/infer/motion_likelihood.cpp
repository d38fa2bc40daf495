#include "sysid/infer/motion_likelihood.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

namespace flash::sysid {
namespace {

using Term = LinearObservations::Term;

/// Metres of a row's error for a metre of the cloud's, one over; forces become lengths by it.
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

/// Distances beyond this count by less than their square: none without robustness.
double limit_of(std::vector<double> distances, const Robust& robust) {
  constexpr double kSpread = 1.4826;  // standard deviation over the median of normal distances
  if (robust.kind == RobustKind::plain) return INFINITY;
  if (robust.kind == RobustKind::huber) return robust.huber_delta;
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
    const bool huber = robust.kind == RobustKind::huber;
    weights[i] = row.term == Term::force || ratio >= 1 ? 1 : huber ? ratio : ratio * ratio;
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

ObservedRows rows_of(const Replay& replay, const LinearObservations& places, const Robust& robust) {
  ObservedRows rows;
  std::map<std::size_t, int> keyframes;
  std::map<std::pair<Term, int>, int> channels;
  rows.places.resize(places.rows(), 2);
  rows.weights = robust_weights(places, robust);
  const auto [centre, plane] = plane_of(replay.recording.mesh.vertices);
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

}  // namespace

MotionLikelihood::MotionLikelihood(const std::vector<Replay>& replays,
                                   const std::vector<ReplayResult>& reference, const ScoreSettings& settings,
                                   std::optional<double> repeatability,
                                   const std::vector<KnownError>& errors) {
  const CandidateResult score = score_motions(replays, reference, settings);
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const Replay& replay = replays[r];
    const RecordingScore& fit = score.recordings[r];
    const Registration registration{fit.offset, fit.yaw, fit.time_offset, replay.pivot, replay.up};
    const LinearObservations places(replay, reference[r].motion, registration, settings.objective);
    const Eigen::Index count = places.rows();
    Eigen::VectorXd scale(count), residuals(count), of_rows(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto row = places.row(i);
      scale[i] = scale_of(row, settings.objective);
      residuals[i] = scale[i] * row.distance;
      of_rows[i] = scale[i] / row.weight;  // from the rows of the other functions
    }
    ObservedRows rows = rows_of(replay, places, settings.objective.robust);
    rows.known.resize(count, static_cast<Eigen::Index>(5 + errors.size()));
    const Eigen::Matrix<double, Eigen::Dynamic, 5> moves =
        of_rows.asDiagonal() * places.registration_derivatives();
    const data::NuisanceBounds& bounds = replay.recording.nuisance;
    Eigen::Matrix<double, 5, 1> widths, found;
    widths << bounds.offset, bounds.yaw, bounds.time;
    found << fit.offset, fit.yaw, fit.time_offset;
    rows.known.leftCols<5>() = moves * (widths / std::sqrt(3.0)).asDiagonal();
    Eigen::VectorXd correction = Eigen::VectorXd::Zero(count);
    for (std::size_t e = 0; e < errors.size(); ++e) {
      const KnownError& error = errors[e];
      Eigen::VectorXd moved = Eigen::VectorXd::Zero(count);
      for (const MotionTerm& term : error.terms)
        moved += term.factor * of_rows.cwiseProduct(places.displacements(term.motions->replays[r],
                                                                         term.motions->results[r].motion));
      // Errors are independent between the likelihoods of recordings: the mean of so many has the size asked.
      const double size = error.shared ? std::sqrt(static_cast<double>(replays.size())) : 1;
      rows.known.col(static_cast<Eigen::Index>(5 + e)) = size * moved;
      if (error.corrects) correction += moved;
    }
    const Eigen::VectorXd registered = moves * found;
    DiscrepancyModel model(std::move(rows), residuals + registered - correction, repeatability);
    recordings_.push_back(
        {replay, registration, settings.objective, scale, registered, correction, std::move(model)});
  }
}

Eigen::VectorXd MotionLikelihood::residuals(std::size_t r, const Motion& motion) const {
  const Recording& recording = recordings_[r];
  const LinearObservations places(recording.replay, motion, recording.registration, recording.objective);
  Eigen::VectorXd residuals(places.rows());
  for (Eigen::Index i = 0; i < residuals.size(); ++i)
    residuals[i] = recording.scale[i] * places.row(i).distance;
  return residuals + recording.registered - recording.correction;
}

Eigen::VectorXd MotionLikelihood::deviance(const std::vector<Eigen::MatrixXd>& residuals) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(residuals.front().cols());
  for (std::size_t r = 0; r < recordings_.size(); ++r) sum += recordings_[r].model.deviance(residuals[r]);
  return sum;
}

}  // namespace flash::sysid
