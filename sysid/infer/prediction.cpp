#include "sysid/infer/prediction.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>

#include "data/error.h"
#include "sysid/infer/estimate_errors.h"
#include "sysid/infer/observed_rows.h"
#include "sysid/infer/solver_check.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

constexpr int kRecordings = 2000;    // expected ones: the ends of a band are known to 0.3 % of them
constexpr double kShortest = 0.125;  // reach of DiscrepancyModel over the sheet

/// The observations as rows, and how each moves with what is unknown; lengths, whatever the term [m].
struct Rows {
  ObservedRows observed;
  std::vector<LinearObservations::Term> terms;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd motions;                              ///< of each draw over the estimate
  Eigen::Matrix<double, Eigen::Dynamic, 5> registered;  ///< by each parameter at its bound
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> registration;
  SheetModes modes;
};

Rows rows_of(const Replay& replay, const std::vector<ReplayResult>& motions, const SheetShifts& correction,
             const Registration& registration, const Objective& objective) {
  const LinearObservations places(replay, motions.front().motion, registration, objective, correction);
  // Displacements are those from the estimate as it was simulated.
  const Eigen::VectorXd corrected =
      correction.empty() ? Eigen::VectorXd::Zero(places.rows()).eval() : places.moved_by(replay, correction);
  Rows rows;
  rows.observed = observed_rows(replay, places, objective.robust);
  Eigen::VectorXd lengths(places.rows());
  rows.residuals.resize(places.rows());
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    const auto row = places.row(i);
    rows.terms.push_back(row.term);
    lengths[i] = scale_of(row, objective) / row.weight;
    rows.residuals[i] = scale_of(row, objective) * row.distance;
  }
  rows.motions.resize(places.rows(), static_cast<Eigen::Index>(motions.size()) - 1);
  for (std::size_t d = 1; d < motions.size(); ++d)
    rows.motions.col(static_cast<Eigen::Index>(d) - 1) =
        lengths.cwiseProduct(places.displacements(replay, motions[d].motion) + corrected);
  const data::NuisanceBounds& bounds = replay.recording.nuisance;
  Eigen::Matrix<double, 5, 1> ends;
  ends << bounds.offset, bounds.yaw, bounds.time;
  rows.registered = lengths.asDiagonal() * places.registration_derivatives() * ends.asDiagonal();
  rows.registration.compute(rows.registered);
  rows.modes = sheet_modes(rows.observed.places);
  return rows;
}

/// Mean distance of each keyframe, over its terms.
std::vector<double> distances_of(const Rows& rows, const Eigen::VectorXd& residuals, const Robust& robust) {
  std::vector<double> sums(rows.observed.times.size()), terms(sums.size()), of_term;
  const auto count = static_cast<std::size_t>(residuals.size());
  for (std::size_t i = 0, next = 0; i < count; i = next) {
    const auto keyframe = static_cast<std::size_t>(rows.observed.keyframe[i]);
    of_term.clear();
    for (next = i; next < count && rows.observed.keyframe[next] == rows.observed.keyframe[i] &&
                   rows.terms[next] == rows.terms[i];
         ++next)
      of_term.push_back(std::abs(residuals[static_cast<Eigen::Index>(next)]));
    sums[keyframe] += robust_mean(of_term, robust);
    terms[keyframe] += 1;
  }
  for (std::size_t k = 0; k < sums.size(); ++k) sums[k] /= terms[k];
  return sums;
}

/// What is left of residuals after the registration that makes them least. A parameter whose bound is zero is
/// held.
Eigen::VectorXd registered_anew(const Rows& rows, const Eigen::VectorXd& residuals) {
  return residuals - rows.registered * rows.registration.solve(residuals);
}

/// Draws errors of a misfit, of the rows. What is rough in the error of the model is neither smooth enough
/// for the discrepancy nor noise that neighbours do not share: a field of the shortest reach along the sheet,
/// anew in each keyframe.
class ErrorDraws {
 public:
  ErrorDraws(const Rows& rows, const Misfit& misfit)
      : smooth_(field(rows, misfit.rms, misfit.reach_sheet)),
        rough_(field(rows,
                     std::sqrt(std::max(0.0, misfit.rough * misfit.rough - misfit.noise * misfit.noise)),
                     kShortest * rows.modes.length)),
        noise_(misfit.noise),
        channels_(1 + *std::max_element(rows.observed.channel.begin(), rows.observed.channel.end())) {
    const auto count = static_cast<Eigen::Index>(rows.observed.times.size());
    Eigen::MatrixXd in_time(count, count);
    for (Eigen::Index k = 0; k < count; ++k)
      for (Eigen::Index l = 0; l < count; ++l)
        in_time(k, l) = correlation_in_time(std::abs(rows.observed.times[static_cast<std::size_t>(k)] -
                                                     rows.observed.times[static_cast<std::size_t>(l)]) /
                                            std::max(misfit.reach_time, 1e-9));
    constexpr double kRounding = 1e-9;  // keyframes that agree leave the matrix singular
    in_time.diagonal().array() += kRounding;
    in_time_ = in_time.llt().matrixL();
  }

  template <typename Normal>
  void add(const Rows& rows, Normal& normal, Eigen::VectorXd& residuals) const {
    const auto draws = [&] { return Eigen::MatrixXd::NullaryExpr(in_time_.rows(), smooth_.cols(), normal); };
    for (int channel = 0; channel < channels_; ++channel) {
      const Eigen::MatrixXd smooth = in_time_ * draws(), rough = draws();
      for (Eigen::Index i = 0; i < residuals.size(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (rows.observed.channel[at] == channel)
          residuals[i] += smooth_.row(i).dot(smooth.row(rows.observed.keyframe[at])) +
                          rough_.row(i).dot(rough.row(rows.observed.keyframe[at])) + noise_ * normal();
      }
    }
  }

 private:
  /// What each mode is at each row, of a field of standard deviation `size`.
  static Eigen::MatrixXd field(const Rows& rows, double size, double reach) {
    return size * rows.modes.values * variances_along(rows.modes, reach).cwiseSqrt().asDiagonal();
  }

  Eigen::MatrixXd smooth_, rough_, in_time_;
  double noise_;
  int channels_;
};

/// The distances of each keyframe (rows) in each expected recording (columns).
Eigen::MatrixXd expected_distances(const Rows& rows, const std::vector<Misfit>& misfits, const Robust& robust,
                                   unsigned seed) {
  std::vector<ErrorDraws> draws;
  for (const Misfit& misfit : misfits) draws.emplace_back(rows, misfit);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  const auto normal = [&] { return gauss(random); };
  Eigen::MatrixXd distances(static_cast<Eigen::Index>(rows.observed.times.size()), kRecordings);
  for (Eigen::Index recording = 0; recording < kRecordings; ++recording) {
    const auto m = static_cast<std::size_t>(random() % misfits.size());
    Eigen::VectorXd residuals = Eigen::VectorXd::Zero(rows.residuals.size());
    if (rows.motions.cols() > 0)
      residuals += rows.motions.col(
          static_cast<Eigen::Index>(random() % static_cast<std::uint64_t>(rows.motions.cols())));
    draws[m].add(rows, normal, residuals);
    const std::vector<double> found = distances_of(rows, registered_anew(rows, residuals), robust);
    distances.col(recording) = Eigen::Map<const Eigen::VectorXd>(found.data(), distances.rows());
  }
  return distances;
}

}  // namespace

MotionChange correction_of(const Replay& replay, const ReplayCandidate& candidate, const MotionStore& store) {
  const std::optional<Replay> half = on_half_the_cell(replay);
  std::vector<FinerSettings> finer = finer_settings({replay});
  std::vector<WantedMotion> wanted = {{&replay, candidate}};
  if (half) wanted.push_back({&*half, candidate});
  for (const FinerSettings& each : finer) wanted.push_back({each.replays.data(), candidate});
  store.prepare(wanted);
  const auto simulated = [&](const Replay& of) {
    return std::make_shared<const Motions>(Motions{{of}, {store.run(of, candidate)}});
  };
  const std::shared_ptr<const Motions> own = simulated(replay);
  MotionChange correction;
  const auto add = [&](double times, std::shared_ptr<const Motions> to) {
    correction.push_back({-times, own});
    correction.push_back({times, std::move(to)});
  };
  if (half) add(no_cells, simulated(*half));
  for (FinerSolution& each : finer_solutions(std::move(finer), candidate, store))
    add(1, std::make_shared<const Motions>(Motions{std::move(each.replays), std::move(each.motions)}));
  const bool finite = std::all_of(correction.begin(), correction.end(), [](const MotionTerm& term) {
    return term.motions->results.front().finite;
  });
  return finite ? correction : MotionChange{};
}

Prediction predict(const Replay& replay, const std::vector<ReplayResult>& motions,
                   const MotionChange& correction, const std::vector<Misfit>& misfits,
                   const ScoreSettings& settings, unsigned seed) {
  Prediction prediction;
  prediction.fit = register_motions({registration_problem(replay, motions.front().motion)},
                                    settings.objective, settings.registration)
                       .front();
  const Registration& registration = prediction.fit.registration;
  const SheetShifts shifts =
      correction.empty() ? SheetShifts() : shifts_of(correction, 0, replay, registration.time_offset);
  const Rows rows = rows_of(replay, motions, shifts, registration, settings.objective);
  if (rows.residuals.size() == 0)
    throw data::InputError(replay.recording.source + ": no keyframe has points to predict");
  const Robust& robust = settings.objective.robust;
  const std::vector<double> observed = distances_of(rows, registered_anew(rows, rows.residuals), robust);
  const Eigen::MatrixXd expected = expected_distances(rows, misfits, robust, seed);
  Eigen::VectorXi left = Eigen::VectorXi::Zero(expected.cols());  // bands, by each expected recording
  int left_by_observed = 0;
  for (Eigen::Index k = 0; k < expected.rows(); ++k) {
    Eigen::VectorXd sorted = expected.row(k).transpose();
    std::sort(sorted.begin(), sorted.end());
    const auto at = [&](double share) {
      return sorted[static_cast<Eigen::Index>(std::lround(share * static_cast<double>(sorted.size() - 1)))];
    };
    const auto i = static_cast<std::size_t>(k);
    const PredictedKeyframe keyframe{rows.observed.times[i], observed[i], {at(0.025), at(0.975)}};
    left_by_observed += keyframe.holds() ? 0 : 1;
    for (Eigen::Index r = 0; r < expected.cols(); ++r)
      left[r] += expected(k, r) < keyframe.band[0] || expected(k, r) > keyframe.band[1] ? 1 : 0;
    prediction.keyframes.push_back(keyframe);
  }
  prediction.chance =
      static_cast<double>((left.array() >= left_by_observed).count()) / static_cast<double>(expected.cols());
  return prediction;
}

}  // namespace flash::sysid
