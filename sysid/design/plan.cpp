#include "sysid/design/plan.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>

#include "data/error.h"
#include "sysid/emulate/sensitivity.h"
#include "sysid/infer/expected_information.h"
#include "sysid/infer/held.h"
#include "sysid/infer/observed_rows.h"
#include "sysid/infer/solver_check.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

/// From the precision before an experiment and its information.
PlannedExperiment planned(const std::string& name, const Eigen::MatrixXd& before,
                          const Eigen::MatrixXd& information) {
  const Eigen::MatrixXd after = before + information;
  const Eigen::LLT<Eigen::MatrixXd> factor(after);
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(after.rows(), after.cols()));
  PlannedExperiment experiment{name, {}};
  for (Eigen::Index k = 0; k < after.rows(); ++k) experiment.spread.push_back(std::sqrt(covariance(k, k)));
  const auto log_root = [](const Eigen::LLT<Eigen::MatrixXd>& of) {
    return Eigen::MatrixXd(of.matrixL()).diagonal().array().log2().sum();
  };
  experiment.bits = log_root(factor) - log_root(before.llt());
  return experiment;
}

Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix) {
  return matrix.llt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

Eigen::MatrixXd precision_before(const PlanSettings& settings) {
  if (settings.known) {
    constexpr double kSure = 1e-9;  // of a coordinate: what draws do not differ in
    Eigen::MatrixXd covariance = settings.known->covariance;
    covariance.diagonal().array() += kSure * kSure;
    return inverse(covariance);
  }
  Eigen::VectorXd precisions(static_cast<Eigen::Index>(settings.grid.axes.size()));
  const std::vector<double> ranges = spread_of_ranges(settings.grid.axes);
  for (std::size_t k = 0; k < ranges.size(); ++k)
    precisions[static_cast<Eigen::Index>(k)] = 1 / (ranges[k] * ranges[k]);
  return precisions.asDiagonal();
}

/// The search's parameters and, behind them, what is held without a measurement.
struct Asked {
  GridSettings grid;
  std::vector<double> at;
  std::vector<double> held;  ///< standard deviation of each that is held, in the coordinate of its axis
};

Asked with_held(const PlanSettings& settings, const std::vector<Replay>& replays) {
  const std::vector<HeldParameter> all = held_parameters(settings.grid, replays);
  const auto is_held = [&](const Axis& axis) {
    return std::any_of(all.begin(), all.end(), [&](const auto& held) { return held.name == axis.name; });
  };
  Asked asked{settings.grid, {}, {}};
  asked.grid.axes.clear();
  for (std::size_t k = 0; k < settings.at.size(); ++k) {
    const Axis& axis = settings.grid.axes[k];
    if (axis.values.size() > 1) {
      asked.grid.axes.push_back(axis);
      asked.at.push_back(settings.at[k]);
    } else if (!is_held(axis)) {
      asked.grid.fixed.push_back(axis);
    }
  }
  for (const HeldParameter& held : all) {
    std::erase_if(asked.grid.fixed, [&](const Axis& axis) { return axis.name == held.name; });
    const auto [low, high] = held.values;
    const bool logarithmic = low > 0;
    asked.grid.axes.push_back({held.name, {low, high}, logarithmic});
    asked.at.push_back(logarithmic ? std::sqrt(low * high) : 0.5 * (low + high));
    asked.held.push_back(0.5 * (logarithmic ? std::log(high / low) : high - low));
  }
  return asked;
}

/// By what the rows of one recording move with errors of the solution, one standard deviation each, as an
/// answer reckons with them: twice the step from half the cell to cells of no size, half the step of time,
/// more iterations. What diverges or cannot be meshed is left out.
Eigen::MatrixXd errors_of_solution(const Replay& replay, const LinearObservations& places,
                                   const ReplayResult& motion, const ReplayCandidate& candidate,
                                   const MotionStore& store) {
  constexpr double kMesh = 2.0 / 3;  // of the step to half the cell: an error of second order
  const Eigen::VectorXd own = places.displacements(replay, motion.motion);
  std::vector<Eigen::VectorXd> columns;
  const auto add = [&](double share, const Replay& finer, const ReplayResult& there) {
    if (there.finite) columns.push_back(share * (places.displacements(finer, there.motion) - own));
  };
  if (const std::optional<Replay> finer = on_half_the_cell(replay))
    add(kMesh, *finer, store.run(*finer, candidate));
  for (const FinerSolution& finer : finer_solutions(finer_settings({replay}), candidate, store))
    add(1, finer.replays.front(), finer.motions.front());
  Eigen::MatrixXd errors(places.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) errors.col(static_cast<Eigen::Index>(c)) = columns[c];
  return errors;
}

/// What the rows of one recording tell of the first `searched` parameters.
Eigen::MatrixXd information_of(const Replay& replay, const LinearObservations& places,
                               const Eigen::MatrixXd& parameters, const Eigen::MatrixXd& nuisance,
                               const Eigen::MatrixXd& errors, const Asked& asked, const Misfit& misfit) {
  ObservedRows rows = observed_rows(replay, places, {.kind = RobustKind::plain});
  const auto held = static_cast<Eigen::Index>(asked.held.size()), searched = parameters.cols() - held;
  Eigen::VectorXd scale(places.rows());  // from rows of the score to those of the likelihood
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    const auto row = places.row(i);
    scale[i] = scale_of(row, asked.grid.score.objective) / row.weight;
  }
  rows.rates = scale.asDiagonal() * parameters.leftCols(searched);
  rows.known.resize(places.rows(), held + errors.cols());
  rows.known << scale.asDiagonal() * parameters.rightCols(held) *
                    Eigen::VectorXd::Map(asked.held.data(), held).asDiagonal(),
      scale.asDiagonal() * errors;
  rows.free = scale.asDiagonal() * nuisance;
  return expected_information(rows, misfit);
}

}  // namespace

std::vector<double> spread_of_ranges(const std::vector<Axis>& axes) {
  std::vector<double> spreads;
  for (const Axis& axis : axes) {
    const double low = axis.values.front(), high = axis.values.back();
    spreads.push_back((axis.logarithmic ? std::log(high / low) : high - low) / std::sqrt(12.0));
  }
  return spreads;
}

std::vector<double> spread_before(const PlanSettings& settings) {
  if (!settings.known) return spread_of_ranges(settings.grid.axes);
  const Eigen::VectorXd spreads = settings.known->covariance.diagonal().cwiseSqrt();
  return {spreads.begin(), spreads.end()};
}

double mean_duration(const std::vector<Replay>& replays) {
  double sum = 0;
  for (const Replay& replay : replays) {
    double first = INFINITY, last = -INFINITY;
    for (const Observation& observation : replay.observations) {
      if (observation.weight <= 0) continue;
      first = std::min(first, observation.t);
      last = std::max(last, observation.t);
    }
    sum += std::max(0.0, last - first);
  }
  return sum / static_cast<double>(replays.size());
}

Misfit expected_misfit(const std::vector<Misfit>& misfits) {
  Misfit expected;
  const auto count = static_cast<double>(misfits.size());
  for (const Misfit& misfit : misfits) {
    expected.noise += misfit.noise * misfit.noise / count;
    expected.rough += misfit.rough * misfit.rough / count;
    expected.size += misfit.size * misfit.size / count;
    expected.rms += misfit.rms * misfit.rms / count;
    expected.reach_time += misfit.reach_time / count;
    expected.reach_sheet += misfit.reach_sheet / count;
  }
  for (double Misfit::*const each : {&Misfit::noise, &Misfit::rough, &Misfit::size, &Misfit::rms})
    expected.*each = std::sqrt(expected.*each);
  return expected;
}

PlannedExperiment plan_experiment(const std::string& name, const std::vector<Replay>& replays,
                                  const PlanSettings& settings, const MotionStore* store) {
  const Eigen::MatrixXd before = precision_before(settings);
  const Asked asked = settings.known ? with_held(settings, replays) : Asked{settings.grid, settings.at, {}};
  MotionsAt motions;
  if (store != nullptr)
    motions = [&](std::size_t r, const std::vector<std::vector<double>>& values) {
      std::vector<ReplayCandidate> candidates;
      for (const std::vector<double>& each : values) candidates.push_back(candidate_at(each, asked.grid));
      std::vector<ReplayResult> results(candidates.size());
      store->run(replays[r], candidates,
                 [&](std::size_t i, ReplayResult result) { results[i] = std::move(result); });
      return results;
    };
  const Sensitivity sensitivity = measure_sensitivity(replays, asked.grid, asked.at, true, motions);
  if (sensitivity.places.empty()) throw data::InputError(name + ": the simulation diverges");
  if (!settings.known) {
    Eigen::MatrixXd rates = sensitivity.parameters;
    if (sensitivity.nuisance.cols() > 0)
      rates -=
          sensitivity.nuisance * sensitivity.nuisance.colPivHouseholderQr().solve(sensitivity.parameters);
    return planned(name, before,
                   settings.keyframes / (settings.error * settings.error) * (rates.transpose() * rates));
  }
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(before.rows(), before.cols());
  const double root = std::sqrt(static_cast<double>(replays.size()));  // see Sensitivity
  Eigen::Index row = 0;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const LinearObservations& places = sensitivity.places[r];
    const auto part = [&](const Eigen::MatrixXd& all) {
      return Eigen::MatrixXd(root * all.middleRows(row, places.rows()));
    };
    Eigen::MatrixXd errors(places.rows(), 0);
    if (store != nullptr)
      errors = errors_of_solution(replays[r], places, sensitivity.motions[r],
                                  candidate_at(asked.at, asked.grid), *store);
    Misfit misfit = settings.known->misfit;
    if (settings.known->duration > 0)
      misfit.reach_time *= mean_duration({replays[r]}) / settings.known->duration;
    information += information_of(replays[r], places, part(sensitivity.parameters),
                                  part(sensitivity.nuisance), errors, asked, misfit);
    row += places.rows();
  }
  return planned(name, before, information);
}

}  // namespace flash::sysid
