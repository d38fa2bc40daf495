#include "sysid/emulate/sensitivity.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "data/machine/parallel.h"

namespace flash::sysid {
namespace {

/// Of the logarithm of a parameter, to both sides. Chosen: 10 % of the parameter; not varied.
constexpr double kLogStep = 0.1;
/// Share of the searched range of a parameter that is not logarithmic, to both sides. Chosen: not varied.
constexpr double kRangeStep = 0.1;

double coordinate(const Axis& axis, double value) { return axis.logarithmic ? std::log(value) : value; }

/// `value` moved along its axis, kept in the searched range where it is one.
double moved(const Axis& axis, double value, double step) {
  const double there = axis.logarithmic ? std::exp(std::log(value) + step) : value + step;
  if (axis.values.size() < 2) return there;
  return std::clamp(there, axis.values.front(), axis.values.back());
}

double step_of(const Axis& axis, double value) {
  if (axis.logarithmic) return kLogStep;
  if (axis.values.size() > 1) return kRangeStep * (axis.values.back() - axis.values.front());
  return kRangeStep * std::max(std::abs(value), 0.1);
}

/// The values, then each parameter a step lower and higher. spacing: between both, in its coordinate.
std::vector<std::vector<double>> steps_about(const std::vector<double>& values, const std::vector<Axis>& axes,
                                             std::vector<double>& spacing) {
  std::vector<std::vector<double>> wanted = {values};
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const double step = step_of(axes[k], values[k]);
    std::vector<double> low = values, high = values;
    low[k] = moved(axes[k], values[k], -step);
    high[k] = moved(axes[k], values[k], step);
    spacing.push_back(coordinate(axes[k], high[k]) - coordinate(axes[k], low[k]));
    wanted.push_back(low);
    wanted.push_back(high);
  }
  return wanted;
}

}  // namespace

Sensitivity measure_sensitivity(const std::vector<Replay>& replays, const GridSettings& grid,
                                const std::vector<double>& values, bool differentiate,
                                const MotionsAt& motions) {
  const std::size_t parameters = grid.axes.size();
  std::vector<double> spacing;
  const std::vector<std::vector<double>> wanted =
      steps_about(values, differentiate ? grid.axes : std::vector<Axis>(), spacing);
  std::vector<std::vector<ReplayResult>> runs;
  Sensitivity result;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    if (motions) {
      runs.push_back(motions(r, wanted));
    } else {
      std::vector<ReplayCandidate> candidates;
      for (const std::vector<double>& each : wanted) candidates.push_back(candidate_at(each, grid));
      runs.push_back(run(replays[r], candidates));
    }
    result.motions.push_back(runs.back().front());
  }
  if (std::any_of(result.motions.begin(), result.motions.end(), [](const auto& m) { return !m.finite; }))
    return result;
  const std::vector<Registration> registrations = registrations_of(replays, result.motions, grid.score);
  Eigen::Index rows = 0, columns = 0;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    result.places.emplace_back(replays[r], result.motions[r].motion, registrations[r], grid.score.objective);
    rows += result.places.back().rows();
  }
  result.parameters = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(parameters));
  result.nuisance = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(5 * replays.size()));
  const double share = 1 / std::sqrt(static_cast<double>(replays.size()));
  Eigen::Index row = 0;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const LinearObservations& places = result.places[r];
    std::vector<Eigen::VectorXd> moved(runs[r].size());
    data::for_each_in_parallel(moved.size(), grid.threads, [&](std::size_t i) {
      if (i > 0) moved[i] = places.displacements(replays[r], runs[r][i].motion);
    });
    for (std::size_t k = 0; k < parameters && differentiate; ++k)
      result.parameters.block(row, static_cast<Eigen::Index>(k), places.rows(), 1) =
          share / spacing[k] * (moved[2 * k + 2] - moved[2 * k + 1]);
    const data::NuisanceBounds& bounds = replays[r].recording.nuisance;
    const Eigen::Matrix<double, Eigen::Dynamic, 5> derivatives = places.registration_derivatives();
    const double widths[5] = {bounds.offset.x(), bounds.offset.y(), bounds.offset.z(), bounds.yaw,
                              bounds.time};
    for (int k = 0; k < 5; ++k) {
      if (!(widths[k] > 0)) continue;
      result.nuisance.block(row, columns++, places.rows(), 1) = share * widths[k] * derivatives.col(k);
    }
    row += places.rows();
  }
  result.nuisance.conservativeResize(Eigen::NoChange, columns);
  return result;
}

std::vector<Eigen::MatrixXd> keyframe_information(const Sensitivity& sensitivity) {
  Eigen::MatrixXd rates = sensitivity.parameters;
  if (sensitivity.nuisance.cols() > 0)
    rates -= sensitivity.nuisance * sensitivity.nuisance.colPivHouseholderQr().solve(sensitivity.parameters);
  std::vector<Eigen::MatrixXd> information;
  Eigen::Index row = 0;
  for (const LinearObservations& places : sensitivity.places)
    for (const Eigen::Index count : places.rows_of_keyframes()) {
      const auto rows = rates.middleRows(row, count);
      information.emplace_back(rows.transpose() * rows);
      row += count;
    }
  return information;
}

Eigen::VectorXd displacements(const Sensitivity& sensitivity, const std::vector<Replay>& replays,
                              const std::vector<ReplayResult>& motions) {
  Eigen::VectorXd all(sensitivity.parameters.rows());
  const double share = 1 / std::sqrt(static_cast<double>(replays.size()));
  Eigen::Index row = 0;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const LinearObservations& places = sensitivity.places[r];
    all.segment(row, places.rows()) = share * places.displacements(replays[r], motions[r].motion);
    row += places.rows();
  }
  return all;
}

Eigen::VectorXd explain(const Sensitivity& sensitivity, const Eigen::VectorXd& displacement,
                        const Eigen::VectorXd& ranges) {
  // Of a displacement that parameters explain [m]. Work: keeps the problem regular.
  constexpr double kFloor = 1e-6;
  const Eigen::Index parameters = ranges.size(), all = parameters + sensitivity.nuisance.cols();
  Eigen::MatrixXd matrix(displacement.size(), all);
  matrix << sensitivity.parameters * ranges.asDiagonal(), sensitivity.nuisance;
  const Eigen::MatrixXd normal =
      matrix.transpose() * matrix + kFloor * kFloor * Eigen::MatrixXd::Identity(all, all);
  const Eigen::VectorXd shares = normal.ldlt().solve(matrix.transpose() * displacement);
  return ranges.cwiseProduct(shares.head(parameters).cwiseMax(-1).cwiseMin(1));
}

}  // namespace flash::sysid
