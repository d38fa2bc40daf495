#include "sysid/infer/motion_likelihood.h"

#include <algorithm>
#include <cmath>

#include "data/machine/parallel.h"
#include "sysid/infer/observed_rows.h"

namespace flash::sysid {

MotionLikelihood::MotionLikelihood(const std::vector<Replay>& replays,
                                   const std::vector<ReplayResult>& reference, const ScoreSettings& settings,
                                   std::optional<double> repeatability, const std::vector<KnownError>& errors,
                                   const std::vector<MotionChange>& rates, std::size_t first) {
  // Where the nuisance is linear: without known errors, then at those found. Chosen: not varied.
  constexpr int kPasses = 2;
  const std::vector<Registration> registrations = registrations_of(replays, reference, settings);
  const Robust& robust = settings.objective.robust;
  recordings_.resize(replays.size());
  data::for_each_in_parallel(replays.size(), replays.front().settings.threads, [&](std::size_t r) {
    const Replay& replay = replays[r];
    const Registration& fit = registrations[r];
    Recording& recording = recordings_[r];
    recording.replay = replay;
    recording.objective = settings.objective;
    const data::NuisanceBounds& bounds = replay.recording.nuisance;
    recording.bounds << bounds.offset, bounds.yaw, bounds.time;
    recording.nuisance.registration << fit.offset, fit.yaw, fit.time_offset;
    recording.nuisance.errors = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(errors.size()));
    // Errors are independent between the likelihoods of recordings: the mean of so many has the size asked.
    for (const KnownError& error : errors)
      recording.sizes.push_back(error.spread *
                                (error.shared ? std::sqrt(static_cast<double>(replays.size())) : 1));
    add_errors(recording, errors, first + r, fit.time_offset);
    std::vector<SheetShifts> by_parameter;
    for (const MotionChange& rate : rates)
      by_parameter.push_back(shifts_of(rate, r, replay, fit.time_offset));
    for (int pass = 0; pass < kPasses; ++pass) {
      linearize(recording, reference[r].motion, by_parameter, repeatability,
                robust.kind == RobustKind::huber ? std::optional<double>(robust.huber_delta) : std::nullopt);
      if (errors.empty()) break;
      if (pass + 1 < kPasses)
        recording.nuisance =
            fit_nuisance(
                recording, recording.nuisance, [&](double) -> const Motion& { return reference[r].motion; },
                replay.settings.threads)
                .first;
    }
    recording.errors = recording.bends = {};  // from here on their shapes side by side do
  });
}

void MotionLikelihood::add_errors(Recording& recording, const std::vector<KnownError>& errors,
                                  std::size_t index, double time_offset) {
  const Replay& replay = recording.replay;
  const int threads = replay.settings.threads;
  std::vector<SheetShifts>&shifts = recording.errors, &bends = recording.bends;
  std::vector<SheetShifts> corrections(errors.size());
  shifts.resize(errors.size());
  bends.resize(errors.size());
  data::for_each_in_parallel(errors.size(), threads, [&](std::size_t e) {
    const double size = recording.sizes[e];
    SheetShifts one = shifts_of(errors[e].terms, index, replay, time_offset);
    add(shifts[e], size, one);
    if (errors[e].corrects) corrections[e] = std::move(one);
    if (!errors[e].bend.empty())
      add(bends[e], size * size, shifts_of(errors[e].bend, index, replay, time_offset));
  });
  SheetShifts correction;
  for (const SheetShifts& each : corrections)
    if (!each.empty()) add(correction, 1, each);
  std::vector<const SheetShifts*> shapes = {&correction};
  for (const SheetShifts& error : shifts) shapes.push_back(&error);
  for (std::size_t e = 0; e < errors.size(); ++e) {
    if (bends[e].empty()) continue;
    shapes.push_back(&bends[e]);
    recording.bent.push_back(static_cast<Eigen::Index>(e));
  }
  recording.shapes = side_by_side(shapes, threads);
}

void MotionLikelihood::linearize(Recording& recording, const Motion& motion,
                                 const std::vector<SheetShifts>& rates, std::optional<double> repeatability,
                                 std::optional<double> limit) {
  const Replay& replay = recording.replay;
  const LinearObservations* const near = recording.near ? &*recording.near : nullptr;
  SheetShifts shifts;
  set_shifts(recording, recording.nuisance, shifts);
  recording.near = LinearObservations(replay, motion, registration_of(recording, recording.nuisance),
                                      recording.objective, shifts, near);
  const LinearObservations& places = *recording.near;
  const Eigen::Index count = places.rows();
  recording.linear.scale.resize(count);
  Eigen::VectorXd residuals(count), of_rows(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto row = places.row(i);
    recording.linear.scale[i] = scale_of(row, recording.objective);
    residuals[i] = recording.linear.scale[i] * row.distance;
    of_rows[i] = recording.linear.scale[i] / row.weight;  // from the rows of the other functions
  }
  const auto columns_of = [&](const std::vector<SheetShifts>& all) {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(count, static_cast<Eigen::Index>(all.size()));
    data::for_each_in_parallel(all.size(), replay.settings.threads, [&](std::size_t e) {
      if (!all[e].empty())
        columns.col(static_cast<Eigen::Index>(e)) = of_rows.cwiseProduct(places.moved_by(replay, all[e]));
    });
    return columns;
  };
  recording.registered = of_rows.asDiagonal() * places.registration_derivatives();
  recording.slopes = columns_of(recording.errors);
  recording.curves = columns_of(recording.bends);
  ObservedRows rows = observed_rows(replay, places, recording.objective.robust);
  const Nuisance& at = recording.nuisance;
  rows.known = known_at(recording, at.errors);
  rows.free = recording.registered * recording.bounds.asDiagonal();
  rows.rates = columns_of(rates);
  const Eigen::VectorXd left = residuals + recording.registered * at.registration + rows.known * at.errors;
  recording.linear.rows = rows;
  recording.linear.residuals = left;
  recording.likelihood.emplace(std::move(rows), left, repeatability, limit, replay.settings.threads);
}

Eigen::VectorXd MotionLikelihood::away(std::size_t r, const Motion& reference, const Motion& motion) const {
  const Recording& recording = recordings_[r];
  const LinearObservations& places = *recording.near;
  Eigen::VectorXd rows =
      places.displacements(recording.replay, motion) - places.displacements(recording.replay, reference);
  for (Eigen::Index i = 0; i < rows.size(); ++i) rows[i] *= recording.linear.scale[i] / places.row(i).weight;
  return rows;
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

Registration MotionLikelihood::registration_of(const Recording& recording, const Nuisance& nuisance) {
  const Registered& found = nuisance.registration;
  return {found.head<3>(), found[3], found[4], recording.replay.pivot, recording.replay.up};
}

void MotionLikelihood::set_shifts(const Recording& recording, const Nuisance& nuisance, SheetShifts& shifts) {
  const Eigen::VectorXd& errors = nuisance.errors;
  Eigen::VectorXd sizes(1 + errors.size() + static_cast<Eigen::Index>(recording.bent.size()));
  sizes << 1, errors, errors(recording.bent).cwiseAbs2();
  mix(recording.shapes, sizes, shifts);
}

std::pair<MotionLikelihood::Nuisance, double> MotionLikelihood::fit_nuisance(
    const Recording& recording, const Nuisance& start,
    const std::function<const Motion&(double time_offset)>& motion_at, int threads) {
  // Of a fit. Work: a cap; six, whether they fell or not, cut profiles of D off.
  constexpr int kSteps = 30;
  // Of s: what a last step may move all rows by, a quarter of a unit of deviance. Measured: with steps that
  // moved them by seven the intervals of equal searches by two routes differed by 12 %, now by 6 %.
  constexpr double kSame = 0.5;
  const auto is_same = [&](const Nuisance& a, const Nuisance& b) {
    const Eigen::VectorXd moved = recording.registered * (b.registration - a.registration) +
                                  known_at(recording, a.errors) * (b.errors - a.errors);
    return moved.norm() < kSame * recording.likelihood->spread();
  };
  // Beyond its bounds a registration costs nothing, and no step back within them would fall.
  Nuisance at = start;
  at.registration = at.registration.cwiseMax(-recording.bounds).cwiseMin(recording.bounds).eval();
  Nuisance next = at;
  double here = INFINITY;  // at `at`
  SheetDistance sheet = sheet_of(recording.replay);
  std::vector<int> triangles;
  SheetShifts shifts;
  for (int step = 0; step < kSteps; ++step) {
    const Motion& motion = motion_at(next.registration[4]);
    const bool read = is_read(recording, motion, next.registration[4]);
    if (!read && step == 0) return {next, NAN};
    Eigen::VectorXd residuals;
    double there = INFINITY;
    if (read) {
      set_shifts(recording, next, shifts);
      residuals = recording.linear.scale.cwiseProduct(recording.near->distances(
          recording.replay, motion, registration_of(recording, next), shifts, sheet, triangles, threads));
      there = recording.likelihood->deviance_of(
          residuals, next.registration.cwiseQuotient(recording.bounds.cwiseMax(1e-300)), next.errors);
    }
    // Errors that bend, and surfaces that are left for another, make a step too long.
    if (!(there <= here)) {
      if (is_same(at, next)) return {at, here};
      next.registration = 0.5 * (at.registration + next.registration);
      next.errors = 0.5 * (at.errors + next.errors);
      continue;
    }
    at = next;
    here = there;
    const Eigen::MatrixXd known = known_at(recording, at.errors);
    const ResidualLikelihood::Fit fit = recording.likelihood->fit(
        residuals + recording.registered * at.registration + known * at.errors, known);
    next = {recording.bounds.cwiseProduct(fit.free), fit.known};
    if (is_same(at, next)) return {next, fit.deviance};
  }
  return {at, here};
}

double MotionLikelihood::spread_of(std::size_t error) const {
  double spread = 1;
  for (const Recording& recording : recordings_)
    spread = std::min(spread, recording.likelihood->known_spread()[static_cast<Eigen::Index>(error)]);
  return spread;
}

Eigen::Matrix<double, 5, 1> MotionLikelihood::registration_spread(std::size_t r) const {
  return recordings_[r].bounds.cwiseProduct(recordings_[r].likelihood->free_spread());
}

double MotionLikelihood::asked_of(std::size_t error) const {
  double sum = 0;
  for (const Recording& recording : recordings_)
    sum += recording.nuisance.errors[static_cast<Eigen::Index>(error)] * recording.sizes[error];
  return sum / static_cast<double>(recordings_.size());
}

double MotionLikelihood::deviance(const MotionAtClock& motions, std::vector<Nuisance>& fitted,
                                  int threads) const {
  double sum = 0;
  std::vector<Nuisance> found;
  for (std::size_t r = 0; r < recordings_.size(); ++r) {
    auto [nuisance, deviance] = fit_nuisance(
        recordings_[r], fitted.empty() ? recordings_[r].nuisance : fitted[r],
        [&](double time_offset) -> const Motion& { return motions(r, time_offset); }, threads);
    found.push_back(std::move(nuisance));
    sum += deviance;
  }
  fitted = std::move(found);
  return sum;
}

double MotionLikelihood::deviance(const MotionAtClock& motions) const {
  std::vector<Nuisance> fitted;
  return deviance(motions, fitted);
}

double MotionLikelihood::deviance(const std::vector<Motion>& motions, int threads) const {
  std::vector<Nuisance> fitted;
  return deviance([&](std::size_t r, double) -> const Motion& { return motions[r]; }, fitted, threads);
}

}  // namespace flash::sysid
