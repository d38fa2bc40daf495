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
                                   std::optional<double> repeatability, const std::vector<KnownError>& errors,
                                   const std::vector<MotionChange>& rates) {
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
    rows.known.resize(count, static_cast<Eigen::Index>(errors.size()));
    const Eigen::Matrix<double, Eigen::Dynamic, 5> moves =
        of_rows.asDiagonal() * places.registration_derivatives();
    const data::NuisanceBounds& bounds = replay.recording.nuisance;
    Eigen::Matrix<double, 5, 1> widths, found;
    widths << bounds.offset, bounds.yaw, bounds.time;
    found << fit.offset, fit.yaw, fit.time_offset;
    rows.free = moves * widths.asDiagonal();
    const auto moved_by = [&](const MotionChange& change) {
      Eigen::VectorXd moved = Eigen::VectorXd::Zero(count);
      for (const MotionTerm& term : change)
        moved += term.factor * of_rows.cwiseProduct(places.displacements(term.motions->replays[r],
                                                                         term.motions->results[r].motion));
      return moved;
    };
    rows.rates.resize(count, static_cast<Eigen::Index>(rates.size()));
    for (std::size_t k = 0; k < rates.size(); ++k)
      rows.rates.col(static_cast<Eigen::Index>(k)) = moved_by(rates[k]);
    Eigen::VectorXd correction = Eigen::VectorXd::Zero(count);
    for (std::size_t e = 0; e < errors.size(); ++e) {
      const KnownError& error = errors[e];
      const Eigen::VectorXd moved = moved_by(error.terms);
      // Errors are independent between the likelihoods of recordings: the mean of so many has the size asked.
      const double size = error.shared ? std::sqrt(static_cast<double>(replays.size())) : 1;
      rows.known.col(static_cast<Eigen::Index>(e)) = size * moved;
      if (error.corrects) correction += moved;
    }
    const Robust& robust = settings.objective.robust;
    ResidualLikelihood likelihood(
        std::move(rows), residuals + moves * found - correction, repeatability,
        robust.kind == RobustKind::huber ? std::optional<double>(robust.huber_delta) : std::nullopt);
    recordings_.push_back(
        {replay, found, widths, settings.objective, scale, moves, correction, std::move(likelihood)});
  }
}

Eigen::VectorXd MotionLikelihood::residuals(const Recording& recording, const Motion& motion,
                                            const Nuisance& registration) {
  const Registration applied{registration.head<3>(), registration[3], registration[4], recording.replay.pivot,
                             recording.replay.up};
  const LinearObservations places(recording.replay, motion, applied, recording.objective);
  Eigen::VectorXd residuals(places.rows());
  for (Eigen::Index i = 0; i < residuals.size(); ++i)
    residuals[i] = recording.scale[i] * places.row(i).distance;
  return residuals + recording.registered * registration - recording.correction;
}

double MotionLikelihood::deviance(const std::vector<Motion>& motions) const {
  constexpr int kSteps = 3;
  constexpr double kSame = 0.3;  // of the noise: what a registration moves rows by
  double sum = 0;
  for (std::size_t r = 0; r < recordings_.size(); ++r) {
    const Recording& recording = recordings_[r];
    Nuisance registration = recording.registration;
    ResidualLikelihood::Fit fit;
    for (int step = 0; step < kSteps; ++step) {
      fit = recording.likelihood.fit(residuals(recording, motions[r], registration));
      const Nuisance next = recording.bounds.cwiseProduct(fit.free);
      const Eigen::VectorXd moved = recording.registered * (next - registration);
      registration = next;
      if (moved.norm() <
          kSame * recording.likelihood.misfit().noise * std::sqrt(static_cast<double>(moved.size())))
        break;
    }
    sum += fit.deviance;
  }
  return sum;
}

}  // namespace flash::sysid
