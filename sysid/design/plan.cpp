#include "sysid/design/plan.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "data/files/error.h"
#include "sysid/emulate/sensitivity.h"
#include "sysid/infer/discrepancy_prior.h"
#include "sysid/infer/expected_information.h"
#include "sysid/infer/held.h"
#include "sysid/infer/observed_rows.h"
#include "sysid/infer/posterior.h"
#include "sysid/infer/solver_check.h"
#include "sysid/infer/weight_scale.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix) {
  return matrix.llt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

/// Half the binary logarithm of a determinant.
double half_log_determinant(const Eigen::MatrixXd& matrix) {
  return Eigen::MatrixXd(matrix.llt().matrixL()).diagonal().array().log2().sum();
}

/// Covariance of the parameters before an experiment.
struct Before {
  Eigen::MatrixXd told;    ///< what an experiment can lower
  Eigen::MatrixXd common;  ///< what is the same in all experiments
};

/// `whole`: that of both, `common`: standard deviations, of one error.
Before divided(const Eigen::MatrixXd& whole, Eigen::VectorXd common) {
  // Share of a variance that is common: draws are few, and may show less. Work: keeps what is left positive.
  constexpr double kMost = 0.99;
  const double share = common.dot(whole.llt().solve(common));
  if (share > kMost) common *= std::sqrt(kMost / share);
  const Eigen::MatrixXd of_common = common * common.transpose();
  return {whole - of_common, of_common};
}

PlannedExperiment planned(const std::string& name, const Before& before, const Eigen::MatrixXd& information) {
  const Eigen::MatrixXd after = inverse(inverse(before.told) + information) + before.common;
  PlannedExperiment experiment{name, {}};
  for (Eigen::Index k = 0; k < after.rows(); ++k) experiment.spread.push_back(std::sqrt(after(k, k)));
  experiment.bits = half_log_determinant(before.told + before.common) - half_log_determinant(after);
  return experiment;
}

Eigen::MatrixXd covariance_before(const PlanSettings& settings) {
  if (settings.known) {
    constexpr double kSure = 1e-9;  // Of a coordinate: what draws do not differ in. Work: rounding.
    Eigen::MatrixXd covariance = settings.known->covariance;
    covariance.diagonal().array() += kSure * kSure;
    return covariance;
  }
  const std::vector<double> ranges = spread_of_ranges(settings.grid.axes);
  return Eigen::VectorXd::Map(ranges.data(), static_cast<Eigen::Index>(ranges.size()))
      .cwiseAbs2()
      .asDiagonal();
}

/// The search's parameters and, behind them, what is held without a measurement.
struct Asked {
  GridSettings grid;
  std::vector<double> at;
  std::vector<double> held;  ///< standard deviation of each that is held, in the coordinate of its axis
};

/// `at`: of every axis. `scales`: an error of the weight is the same factor of every stiffness.
Asked with_held(const PlanSettings& settings, const std::vector<double>& at,
                const std::vector<Replay>& replays, bool scales) {
  std::vector<HeldParameter> all = held_parameters(settings.grid, replays, at);
  if (scales) std::erase_if(all, [](const HeldParameter& held) { return held.name.ends_with("density"); });
  const auto is_held = [&](const Axis& axis) {
    return std::any_of(all.begin(), all.end(), [&](const auto& held) { return held.name == axis.name; });
  };
  Asked asked{settings.grid, {}, {}};
  asked.grid.axes.clear();
  for (std::size_t k = 0; k < at.size(); ++k) {
    const Axis& axis = settings.grid.axes[k];
    if (axis.values.size() > 1) {
      asked.grid.axes.push_back(axis);
      asked.at.push_back(at[k]);
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
  // Of the step to half the cell. Theory: an error of second order ends at 4/3 of it, half of which is
  // unsure.
  constexpr double kMesh = 2.0 / 3;
  const Eigen::VectorXd own = places.displacements(replay, motion.motion);
  std::vector<Eigen::VectorXd> columns;
  const auto add = [&](double share, const Replay& finer, const ReplayResult& there) {
    if (there.finite) columns.push_back(share * (places.displacements(finer, there.motion) - own));
  };
  const Replay finer_mesh = on_half_the_cell(replay);
  add(kMesh, finer_mesh, store.run(finer_mesh, candidate));
  for (const FinerSolution& finer : finer_solutions(finer_settings({replay}), candidate, store))
    add(1, finer.replays.front(), finer.motions.front());
  Eigen::MatrixXd errors(places.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) errors.col(static_cast<Eigen::Index>(c)) = columns[c];
  return errors;
}

/// The rows of one recording that tell of the first `searched` parameters.
ObservedRows rows_of(const Replay& replay, const LinearObservations& places,
                     const Eigen::MatrixXd& parameters, const Eigen::MatrixXd& nuisance,
                     const Eigen::MatrixXd& errors, const Asked& asked) {
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
  return rows;
}

/// What the discrepancy of a recording to come may be, and how likely: that of the search's recordings, or
/// one of its own beside it, by the middles of the quarters of an exponential distribution.
std::vector<std::pair<Misfit, double>> misfits_to_come(const Misfit& found) {
  std::vector<std::pair<Misfit, double>> all = {{found, 0.5}};
  constexpr int kParts = 4;  // Of an exponential distribution. Work: points of a quadrature.
  for (int part = 0; part < kParts; ++part) {
    const double beyond = -std::log(1 - (part + 0.5) / kParts) * usual_discrepancy * found.rough;
    all.emplace_back(found, 0.5 / kParts);
    all.back().first.rms = std::hypot(found.rms, beyond);
  }
  return all;
}

/// One standard deviation to both sides of the estimate along the direction that is known least.
std::vector<std::vector<double>> points_about(const PlanSettings& settings) {
  std::vector<std::size_t> searched;
  for (std::size_t k = 0; k < settings.grid.axes.size(); ++k)
    if (settings.grid.axes[k].values.size() > 1) searched.push_back(k);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(settings.known->covariance);
  const Eigen::Index last = eigen.eigenvalues().size() - 1;
  const Eigen::VectorXd step =
      std::sqrt(std::max(0.0, eigen.eigenvalues()[last])) * eigen.eigenvectors().col(last);
  std::vector<std::vector<double>> points;
  for (const double side : {-1, 1}) {
    points.push_back(settings.at);
    for (std::size_t i = 0; i < searched.size(); ++i) {
      const Axis& axis = settings.grid.axes[searched[i]];
      double& value = points.back()[searched[i]];
      value = value_of(axis, coordinate_of(axis, value) + side * step[static_cast<Eigen::Index>(i)]);
    }
  }
  return points;
}

/// Standard deviation that an error of the weight gives to the searched parameters, each in its coordinate.
Eigen::VectorXd common_of(const PlanSettings& settings, double spread) {
  std::vector<double> common;
  for (std::size_t k = 0; k < settings.grid.axes.size(); ++k) {
    const Axis& axis = settings.grid.axes[k];
    if (axis.values.size() > 1)
      common.push_back(!is_stiffness(axis.name) ? 0 : axis.logarithmic ? spread : spread * settings.at[k]);
  }
  return Eigen::VectorXd::Map(common.data(), static_cast<Eigen::Index>(common.size()));
}

/// What recordings that may have several misfits tell with each.
std::vector<Eigen::MatrixXd> informations_of(const std::vector<Replay>& replays,
                                             const Sensitivity& sensitivity, const Asked& asked,
                                             const KnownSoFar& known,
                                             const std::vector<std::pair<Misfit, double>>& misfits,
                                             const MotionStore* store) {
  const Eigen::Index searched = sensitivity.parameters.cols() - static_cast<Eigen::Index>(asked.held.size());
  std::vector<Eigen::MatrixXd> informations(misfits.size(), Eigen::MatrixXd::Zero(searched, searched));
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
    const ObservedRows rows =
        rows_of(replays[r], places, part(sensitivity.parameters), part(sensitivity.nuisance), errors, asked);
    for (std::size_t m = 0; m < misfits.size(); ++m) {
      Misfit misfit = misfits[m].first;
      if (known.duration > 0) misfit.reach_time *= mean_duration({replays[r]}) / known.duration;
      informations[m] += expected_information(rows, misfit);
    }
    row += places.rows();
  }
  return informations;
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
  const auto measured = [&](const Asked& asked) {
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
    Sensitivity sensitivity = measure_sensitivity(replays, asked.grid, asked.at, true, motions);
    if (sensitivity.places.empty()) throw data::InputError(name + ": the simulation diverges");
    return sensitivity;
  };
  const Eigen::MatrixXd covariance = covariance_before(settings);
  if (!settings.known) {
    const Sensitivity sensitivity = measured({settings.grid, settings.at, {}});
    Eigen::MatrixXd rates = sensitivity.parameters;
    if (sensitivity.nuisance.cols() > 0)
      rates -=
          sensitivity.nuisance * sensitivity.nuisance.colPivHouseholderQr().solve(sensitivity.parameters);
    return planned(name, {covariance, Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols())},
                   settings.keyframes / (settings.error * settings.error) * (rates.transpose() * rates));
  }
  const double scale = spread_of_scale(settings.grid, replays);
  const Before before = divided(covariance, common_of(settings, scale));
  const std::vector<std::pair<Misfit, double>> misfits = misfits_to_come(settings.known->misfit);
  const std::vector<std::vector<double>> points = points_about(settings);
  PlannedExperiment expected{name, std::vector<double>(static_cast<std::size_t>(covariance.rows()), 0.0)};
  for (const std::vector<double>& point : points) {
    const Asked asked = with_held(settings, point, replays, scale > 0);
    const std::vector<Eigen::MatrixXd> informations =
        informations_of(replays, measured(asked), asked, *settings.known, misfits, store);
    for (std::size_t m = 0; m < misfits.size(); ++m) {
      const double likely = misfits[m].second / static_cast<double>(points.size());
      const PlannedExperiment each = planned(name, before, informations[m]);
      for (std::size_t k = 0; k < each.spread.size(); ++k)
        expected.spread[k] += likely * std::log(each.spread[k]);
      expected.bits += likely * each.bits;
    }
  }
  for (double& spread : expected.spread) spread = std::exp(spread);
  return expected;
}

}  // namespace flash::sysid
