#include "sysid/infer/prediction.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

#include "data/files/error.h"
#include "sysid/infer/agreed_numbers.h"
#include "sysid/infer/estimate_errors.h"
#include "sysid/infer/local_noise.h"
#include "sysid/infer/motion_likelihood.h"
#include "sysid/infer/solver_check.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

constexpr int kRecordings = 4000;  // Expected ones. Work: a half of them tells chances of a thousandth.
constexpr double kLeast = 1e-9;    // Of a distance of which the logarithm is taken [m]. Work: rounding.

/// Mean distance of each keyframe, over its channels.
std::vector<double> distances_of(const ObservedRows& rows, const Eigen::VectorXd& residuals,
                                 const Robust& robust) {
  const auto channels =
      static_cast<std::size_t>(1 + *std::max_element(rows.channel.begin(), rows.channel.end()));
  std::vector<std::vector<double>> parts(rows.times.size() * channels);
  for (std::size_t i = 0; i < rows.keyframe.size(); ++i)
    parts[static_cast<std::size_t>(rows.keyframe[i]) * channels + static_cast<std::size_t>(rows.channel[i])]
        .push_back(std::abs(residuals[static_cast<Eigen::Index>(i)]));
  std::vector<double> distances;
  for (std::size_t k = 0; k < rows.times.size(); ++k) {
    double sum = 0;
    int count = 0;
    for (std::size_t c = 0; c < channels; ++c) {
      std::vector<double>& part = parts[k * channels + c];
      if (part.empty()) continue;
      sum += robust_mean(part, robust);
      ++count;
    }
    distances.push_back(sum / count);
  }
  return distances;
}

/// Draws errors of a misfit with one likely discrepancy, of the rows. What is rough in the error of the model
/// is neither smooth enough for the discrepancy nor noise that neighbours do not share: a field of the
/// shortest reach along the sheet, anew in each keyframe.
class ErrorDraws {
 public:
  ErrorDraws(const ObservedRows& rows, const SheetModes& modes, const Misfit& misfit,
             const DiscrepancyDraw& discrepancy)
      : smooth_(field(modes, discrepancy.size, discrepancy.reach_sheet)),
        rough_(field(modes,
                     std::sqrt(std::max(0.0, misfit.rough * misfit.rough - misfit.noise * misfit.noise)),
                     shortest_reach * modes.length)),
        channels_(1 + *std::max_element(rows.channel.begin(), rows.channel.end())) {
    const auto count = static_cast<Eigen::Index>(rows.times.size());
    Eigen::MatrixXd in_time(count, count);
    for (Eigen::Index k = 0; k < count; ++k)
      for (Eigen::Index l = 0; l < count; ++l)
        in_time(k, l) = correlation_in_time(
            std::abs(rows.times[static_cast<std::size_t>(k)] - rows.times[static_cast<std::size_t>(l)]) /
            std::max(discrepancy.reach_time, 1e-9));
    // Keyframes that agree leave the matrix singular. Work: rounding.
    constexpr double kRounding = 1e-9;
    in_time.diagonal().array() += kRounding;
    in_time_ = in_time.llt().matrixL();
  }

  /// `noises`: of each keyframe [m].
  template <typename Normal>
  void add(const ObservedRows& rows, const Eigen::VectorXd& noises, Normal& normal,
           Eigen::VectorXd& residuals) const {
    const auto draws = [&] { return Eigen::MatrixXd::NullaryExpr(in_time_.rows(), smooth_.cols(), normal); };
    for (int channel = 0; channel < channels_; ++channel) {
      const Eigen::MatrixXd smooth = in_time_ * draws(), rough = draws();
      for (Eigen::Index i = 0; i < residuals.size(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (rows.channel[at] == channel)
          residuals[i] += smooth_.row(i).dot(smooth.row(rows.keyframe[at])) +
                          rough_.row(i).dot(rough.row(rows.keyframe[at])) +
                          noises[rows.keyframe[at]] * normal();
      }
    }
  }

 private:
  /// What each mode is at each row, of a field of standard deviation `size`.
  static Eigen::MatrixXd field(const SheetModes& modes, double size, double reach) {
    return size * modes.values * variances_along(modes, reach).cwiseSqrt().asDiagonal();
  }

  Eigen::MatrixXd smooth_, rough_, in_time_;
  int channels_;
};

/// What is left after registration and errors of known shape are fitted, as ResidualLikelihood fits them
/// where every row counts by its square and no bound is reached.
class LinearFit {
 public:
  /// `spread`: s of the likelihood [m].
  LinearFit(const ObservedRows& rows, double spread) : columns_(rows.weights.size(), 0) {
    columns_.resize(rows.weights.size(), rows.free.cols() + rows.known.cols());
    columns_ << rows.free, rows.known;
    weighed_ = (columns_.transpose() * rows.weights.asDiagonal()) / (spread * spread);
    Eigen::MatrixXd normal = weighed_ * columns_;
    normal.diagonal().head(rows.free.cols()).array() += free_precision;
    normal.diagonal().tail(rows.known.cols()).array() += 1;
    solver_.compute(normal);
  }
  Eigen::VectorXd left(const Eigen::VectorXd& residuals) const {
    return residuals - columns_ * solver_.solve(weighed_ * residuals);
  }

 private:
  Eigen::MatrixXd columns_, weighed_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
};

/// Noise of each keyframe [m] and the standard deviation of its logarithm: noise along the view differs with
/// the slope of what is seen.
struct KeyframeNoise {
  Eigen::VectorXd sizes, spreads;
};

/// By what neighbours differ in, each keyframe drawn to the mean of all as far as it is not known better
/// (empirical Bayes; Efron and Morris 1973).
KeyframeNoise noise_of_keyframes(const ObservedRows& rows, const Eigen::VectorXd& residuals, double all) {
  const auto count = static_cast<Eigen::Index>(rows.times.size());
  Eigen::VectorXd logarithms(count), variances(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    ObservedRows alone = rows;
    for (Eigen::Index i = 0; i < residuals.size(); ++i)
      if (alone.keyframe[static_cast<std::size_t>(i)] != k) alone.weights[i] = 0;
    const double between = noise_between_neighbours(alone, residuals);
    const auto seen = static_cast<double>(std::max<Eigen::Index>(1, (alone.weights.array() > 0).count()));
    logarithms[k] = std::log(between > 0 ? between : all);
    // A median of absolute values has 1.36 / n; a third of the differences is that of two which are each
    // other's nearest and counts twice.
    variances[k] = 2 / seen;
  }
  const double mean = logarithms.mean();
  const double scatter =
      count > 1 ? (logarithms.array() - mean).square().sum() / static_cast<double>(count - 1) : 0;
  const double beyond = std::max(0.0, scatter - variances.mean());
  KeyframeNoise noise{Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    const double own = beyond / (beyond + variances[k]);
    noise.sizes[k] = std::exp(mean + own * (logarithms[k] - mean));
    noise.spreads[k] =
        std::sqrt(own * variances[k] + (1 - own) * variances.mean() / static_cast<double>(count));
  }
  return noise;
}

/// The distances of each keyframe (rows) in each expected recording (columns). `motions`: of draws, a column
/// each, over the estimate.
Eigen::MatrixXd expected_distances(const ObservedRows& rows, const Eigen::MatrixXd& motions,
                                   const std::vector<Misfit>& misfits, const LinearFit& fit,
                                   const KeyframeNoise& noise, const Robust& robust, unsigned seed) {
  const SheetModes modes = sheet_modes(rows.places);
  std::vector<std::vector<ErrorDraws>> draws(misfits.size());  // of each misfit
  for (std::size_t m = 0; m < misfits.size(); ++m)
    for (const DiscrepancyDraw& discrepancy : misfits[m].draws)
      draws[m].emplace_back(rows, modes, misfits[m], discrepancy);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  const auto normal = [&] { return gauss(random); };
  Eigen::MatrixXd distances(static_cast<Eigen::Index>(rows.times.size()), kRecordings);
  for (Eigen::Index recording = 0; recording < kRecordings; ++recording) {
    const std::vector<ErrorDraws>& of_misfit = draws[random() % draws.size()];
    const ErrorDraws& errors = of_misfit[random() % of_misfit.size()];
    Eigen::VectorXd residuals = rows.known * Eigen::VectorXd::NullaryExpr(rows.known.cols(), normal);
    if (motions.cols() > 0)
      residuals +=
          motions.col(static_cast<Eigen::Index>(random() % static_cast<std::uint64_t>(motions.cols())));
    const Eigen::VectorXd noises =
        noise.sizes.array() *
        (noise.spreads.array() * Eigen::VectorXd::NullaryExpr(noise.sizes.size(), normal).array()).exp();
    errors.add(rows, noises, normal, residuals);
    const std::vector<double> found = distances_of(rows, fit.left(residuals), robust);
    distances.col(recording) = Eigen::Map<const Eigen::VectorXd>(found.data(), distances.rows());
  }
  return distances;
}

/// Share of the second half of the columns that are as far from the mean of the first half as `observed` is.
double chance_of(const Eigen::MatrixXd& expected, const Eigen::VectorXd& observed) {
  const auto log = [](const auto& distances) { return distances.array().max(kLeast).log().matrix().eval(); };
  const Eigen::Index half = expected.cols() / 2;
  const Eigen::MatrixXd first = log(expected.leftCols(half));
  const Eigen::VectorXd mean = first.rowwise().mean();
  const Eigen::MatrixXd from_mean = first.colwise() - mean;
  Eigen::MatrixXd covariance = from_mean * from_mean.transpose() / static_cast<double>(half - 1);
  // Of many keyframes so many draws hardly tell the correlations (Ledoit and Wolf 2004, with a fixed share).
  const double shrunk =
      std::min(1.0, static_cast<double>(expected.rows()) / static_cast<double>(half)) + 1e-9;
  const Eigen::VectorXd variances = covariance.diagonal();
  covariance *= 1 - std::min(shrunk, 1.0);
  covariance.diagonal() += std::min(shrunk, 1.0) * variances;
  const Eigen::LDLT<Eigen::MatrixXd> solver(covariance);
  const auto distance = [&](const Eigen::VectorXd& from) { return from.dot(solver.solve(from)); };
  const double there = distance(log(observed) - mean);
  int as_far = 0;
  for (Eigen::Index r = half; r < expected.cols(); ++r)
    as_far += distance(log(expected.col(r)) - mean) >= there ? 1 : 0;
  return static_cast<double>(as_far) / static_cast<double>(expected.cols() - half);
}

/// How the motion changes from the estimate to some draws: by these the likelihood decides how much a row
/// counts, and so how much of a misfit errors of known shape may take.
std::vector<MotionChange> rates_by_draws(const Replay& replay, const std::vector<ReplayResult>& motions) {
  // Of the posterior, for the rates by which rows are weighed. Chosen: not varied.
  constexpr std::size_t kDraws = 4;
  const auto of = [&](const ReplayResult& motion) {
    return std::make_shared<const Motions>(Motions{{replay}, {motion}});
  };
  std::vector<MotionChange> rates;
  const std::shared_ptr<const Motions> estimate = of(motions.front());
  for (std::size_t d = 1; d < motions.size() && d <= kDraws; ++d)
    rates.push_back({{-1, estimate}, {1, of(motions[d])}});
  return rates;
}

}  // namespace

std::vector<KnownError> errors_of_prediction(const Replay& replay, const GridSettings& grid,
                                             const std::vector<double>& values, const ReplayResult& own,
                                             const SolvedAs& solved, const MotionStore& store) {
  const std::vector<Replay> replays = {replay}, none;
  const AnswerSettings settings;
  const TellWork untold;
  const Task task{replays, none, grid, grid.axes, settings, store, untold};
  const ReplayCandidate candidate = candidate_at(values, grid);
  std::vector<KnownError> errors = errors_of_held(task, values, {own});
  const auto from = std::make_shared<const Motions>(Motions{replays, {own}});
  const auto add = [&](const std::string& name, double times, std::shared_ptr<const Motions> to) {
    if (to->results.front().finite)
      errors.push_back({{{-times, from}, {times, std::move(to)}}, true, true, {}, name});
  };
  if (solved.no_cells) {
    const Replay half = on_half_the_cell(replay);
    const auto to = std::make_shared<const Motions>(Motions{{half}, {store.run(half, candidate)}});
    // Equal parts of the step to cells of no size: they correct by all of it, and leave half of it unsure.
    // Theory: twice the last third, as in an answer.
    constexpr int kParts = 4;
    for (int part = 0; part < kParts; ++part) add("double_mesh", no_cells / kParts, to);
  }
  if (solved.checked)
    for (FinerSolution& finer : finer_solutions(finer_settings(replays), candidate, store))
      add(finer.what, 1,
          std::make_shared<const Motions>(Motions{std::move(finer.replays), std::move(finer.motions)}));
  return errors;
}

Prediction predict(const Replay& replay, const std::vector<ReplayResult>& motions,
                   const std::vector<KnownError>& errors, const std::vector<Misfit>& misfits,
                   const ScoreSettings& settings, unsigned seed) {
  if (std::none_of(
          replay.observations.begin(), replay.observations.end(),
          [](const Observation& observation) { return observation.weight > 0 && observation.seen(); }))
    throw data::InputError(
        replay.recording.source +
        ": no keyframe counts, expected one with enough points between --from and --until");
  Prediction prediction;
  prediction.fit = register_motions({registration_problem(replay, motions.front().motion)},
                                    settings.objective, settings.registration)
                       .front();
  const MotionLikelihood likelihood({replay}, {motions.front()}, settings, {}, errors,
                                    rates_by_draws(replay, motions));
  const MotionLikelihood::Linear& linear = likelihood.linear(0);
  Eigen::MatrixXd draws(linear.residuals.size(), static_cast<Eigen::Index>(motions.size()) - 1);
  for (std::size_t d = 1; d < motions.size(); ++d)
    draws.col(static_cast<Eigen::Index>(d) - 1) =
        likelihood.away(0, motions.front().motion, motions[d].motion);
  const Robust& robust = settings.objective.robust;
  const Eigen::VectorXd left = likelihood.of_recording(0).fit(linear.residuals).left;
  const std::vector<double> observed = distances_of(linear.rows, left, robust);
  const double noise = likelihood.of_recording(0).misfit().noise;
  const LinearFit fit(linear.rows, likelihood.of_recording(0).spread());
  const Eigen::MatrixXd expected = expected_distances(
      linear.rows, draws, misfits, fit, noise_of_keyframes(linear.rows, left, noise), robust, seed);
  for (Eigen::Index k = 0; k < expected.rows(); ++k) {
    Eigen::VectorXd sorted = expected.row(k).transpose();
    std::sort(sorted.begin(), sorted.end());
    const auto at = [&](double share) {
      return sorted[static_cast<Eigen::Index>(std::lround(share * static_cast<double>(sorted.size() - 1)))];
    };
    const auto i = static_cast<std::size_t>(k);
    prediction.keyframes.push_back({linear.rows.times[i], observed[i], {at(0.025), at(0.975)}});
  }
  prediction.chance = chance_of(expected, Eigen::Map<const Eigen::VectorXd>(
                                              observed.data(), static_cast<Eigen::Index>(observed.size())));
  return prediction;
}

}  // namespace flash::sysid
