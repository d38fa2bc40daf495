#include "sysid/infer/motion_likelihood.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "data/parallel.h"

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

/// The steps of which positions are read at clocks less than half a step from `time_offset` [s].
std::vector<bool> steps_near(const Replay& replay, const Motion& motion, double time_offset) {
  const double room = replay.recording.nuisance.time > 0 ? 0.5 : 0;
  const auto last = static_cast<double>(motion.positions.size() - 1);
  std::vector<bool> steps(motion.positions.size(), false);
  steps.front() = steps.back() = true;
  for (const Observation& observation : replay.observations) {
    const double at = (observation.t + time_offset - motion.start) / motion.step;
    const double first = std::clamp(std::floor(at - room - kSameStep), 0.0, last),
                 end = std::clamp(std::ceil(at + room + kSameStep), 0.0, last);
    for (double i = first; i <= end; ++i) steps[static_cast<std::size_t>(i)] = true;
  }
  // What the motion itself lacks, nothing reads.
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = steps[i] && motion.positions[i].rows() > 0;
  return steps;
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
  constexpr int kPasses = 2;  // where the nuisance is linear: without known errors, then at those found
  const CandidateResult score = score_motions(replays, reference, settings);
  const Robust& robust = settings.objective.robust;
  recordings_.resize(replays.size());
  data::for_each_in_parallel(replays.size(), replays.front().settings.threads, [&](std::size_t r) {
    const Replay& replay = replays[r];
    const RecordingScore& fit = score.recordings[r];
    Recording& recording = recordings_[r];
    recording.replay = replay;
    recording.objective = settings.objective;
    const data::NuisanceBounds& bounds = replay.recording.nuisance;
    recording.bounds << bounds.offset, bounds.yaw, bounds.time;
    recording.nuisance.registration << fit.offset, fit.yaw, fit.time_offset;
    recording.nuisance.errors = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(errors.size()));
    for (const KnownError& error : errors) {
      SheetShifts shifts = shifts_of(error.terms, r, replay, fit.time_offset);
      if (error.corrects) add(recording.correction, 1, shifts);
      // Errors are independent between the likelihoods of recordings: the mean of so many has the size asked.
      const double size = error.shared ? std::sqrt(static_cast<double>(replays.size())) : 1;
      add(recording.errors.emplace_back(), size, shifts);
      recording.bends.emplace_back();
      if (!error.bend.empty())
        add(recording.bends.back(), size * size, shifts_of(error.bend, r, replay, fit.time_offset));
    }
    std::vector<SheetShifts> by_parameter;
    for (const MotionChange& rate : rates)
      by_parameter.push_back(shifts_of(rate, r, replay, fit.time_offset));
    for (int pass = 0; pass < kPasses; ++pass) {
      linearize(recording, reference[r].motion, by_parameter, repeatability,
                robust.kind == RobustKind::huber ? std::optional<double>(robust.huber_delta) : std::nullopt);
      if (errors.empty()) break;
      if (pass + 1 < kPasses) recording.nuisance = fit_nuisance(recording, reference[r].motion).first;
    }
    recording.steps = steps_near(replay, reference[r].motion, recording.nuisance.registration[4]);
  });
}

void MotionLikelihood::linearize(Recording& recording, const Motion& motion,
                                 const std::vector<SheetShifts>& rates, std::optional<double> repeatability,
                                 std::optional<double> limit) {
  const Replay& replay = recording.replay;
  recording.near = places_at(recording, motion, recording.nuisance);
  const LinearObservations& places = *recording.near;
  const Eigen::Index count = places.rows();
  recording.scale.resize(count);
  Eigen::VectorXd residuals(count), of_rows(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto row = places.row(i);
    recording.scale[i] = scale_of(row, recording.objective);
    residuals[i] = recording.scale[i] * row.distance;
    of_rows[i] = recording.scale[i] / row.weight;  // from the rows of the other functions
  }
  const auto columns_of = [&](const std::vector<SheetShifts>& all) {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(count, static_cast<Eigen::Index>(all.size()));
    for (std::size_t e = 0; e < all.size(); ++e)
      if (!all[e].empty())
        columns.col(static_cast<Eigen::Index>(e)) = of_rows.cwiseProduct(places.moved_by(replay, all[e]));
    return columns;
  };
  recording.registered = of_rows.asDiagonal() * places.registration_derivatives();
  recording.slopes = columns_of(recording.errors);
  recording.curves = columns_of(recording.bends);
  ObservedRows rows = rows_of(replay, places, recording.objective.robust);
  const Nuisance& at = recording.nuisance;
  rows.known = known_at(recording, at.errors);
  rows.free = recording.registered * recording.bounds.asDiagonal();
  rows.rates = columns_of(rates);
  const Eigen::VectorXd left = residuals + recording.registered * at.registration + rows.known * at.errors;
  recording.likelihood.emplace(std::move(rows), left, repeatability, limit);
}

Eigen::MatrixXd MotionLikelihood::known_at(const Recording& recording, const Eigen::VectorXd& errors) {
  return recording.slopes + 2 * recording.curves * errors.asDiagonal();
}

bool MotionLikelihood::is_read(const Recording& recording, const Motion& motion, double time_offset) {
  const Replay& replay = recording.replay;
  return !(replay.recording.nuisance.time > 0) ||
         std::all_of(replay.observations.begin(), replay.observations.end(),
                     [&](const Observation& observation) {
                       return observation.weight <= 0 || has_surface_at(motion, observation.t + time_offset);
                     });
}

LinearObservations MotionLikelihood::places_at(const Recording& recording, const Motion& motion,
                                               const Nuisance& nuisance) {
  const Registered& found = nuisance.registration;
  const Registration registration{found.head<3>(), found[3], found[4], recording.replay.pivot,
                                  recording.replay.up};
  SheetShifts shifts = recording.correction;
  for (std::size_t e = 0; e < recording.errors.size(); ++e) {
    const double size = nuisance.errors[static_cast<Eigen::Index>(e)];
    add(shifts, size, recording.errors[e]);
    if (!recording.bends[e].empty()) add(shifts, size * size, recording.bends[e]);
  }
  return {recording.replay,    motion, registration,
          recording.objective, shifts, recording.near ? &*recording.near : nullptr};
}

std::pair<MotionLikelihood::Nuisance, double> MotionLikelihood::fit_nuisance(const Recording& recording,
                                                                             const Motion& motion) {
  constexpr int kSteps = 6;
  constexpr double kSame = 0.03;  // of the noise: what a step moves rows by
  Nuisance at = recording.nuisance;
  ResidualLikelihood::Fit fit;
  for (int step = 0; step < kSteps; ++step) {
    if (!is_read(recording, motion, at.registration[4])) return {at, NAN};
    const LinearObservations places = places_at(recording, motion, at);
    Eigen::VectorXd residuals(places.rows());
    for (Eigen::Index i = 0; i < residuals.size(); ++i)
      residuals[i] = recording.scale[i] * places.row(i).distance;
    const Eigen::MatrixXd known = known_at(recording, at.errors);
    fit = recording.likelihood->fit(residuals + recording.registered * at.registration + known * at.errors,
                                    known);
    const Nuisance next{recording.bounds.cwiseProduct(fit.free), fit.known};
    const Eigen::VectorXd moved =
        recording.registered * (next.registration - at.registration) + known * (next.errors - at.errors);
    at = next;
    if (moved.norm() <
        kSame * recording.likelihood->misfit().noise * std::sqrt(static_cast<double>(moved.size())))
      break;
  }
  return {at, fit.deviance};
}

double MotionLikelihood::spread_of(std::size_t error) const {
  double spread = 1;
  for (const Recording& recording : recordings_)
    spread = std::min(spread, recording.likelihood->known_spread()[static_cast<Eigen::Index>(error)]);
  return spread;
}

double MotionLikelihood::deviance(const std::vector<Motion>& motions) const {
  double sum = 0;
  for (std::size_t r = 0; r < recordings_.size(); ++r) sum += fit_nuisance(recordings_[r], motions[r]).second;
  return sum;
}

}  // namespace flash::sysid
