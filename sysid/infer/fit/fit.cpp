#include "sysid/infer/fit/fit.h"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>

#include "data/error.h"
#include "data/parallel.h"
#include "sysid/emulate/sensitivity.h"

namespace flash::sysid {
namespace {

double coordinate(const Axis& axis, double value) { return axis.logarithmic ? std::log(value) : value; }

std::vector<double> values_at(const std::vector<Axis>& axes, const double* x) {
  std::vector<double> values;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const double value = axes[k].logarithmic ? std::exp(x[k]) : x[k];
    values.push_back(std::clamp(value, axes[k].values.front(), axes[k].values.back()));
  }
  return values;
}

Eigen::VectorXd residuals_of(const Sensitivity& sensitivity) {
  Eigen::VectorXd rows(sensitivity.parameters.rows());
  const double share = 1 / std::sqrt(static_cast<double>(sensitivity.places.size()));
  Eigen::Index row = 0;
  for (const LinearObservations& places : sensitivity.places) {
    rows.segment(row, places.rows()) = share * places.residuals();
    row += places.rows();
  }
  return rows;
}

double median_of(Eigen::VectorXd values) {
  double* middle = values.data() + values.size() / 2;
  std::nth_element(values.data(), middle, values.data() + values.size());
  return *middle;
}

/// All residuals of all recordings, with derivatives where they are asked for. Scale and limit are those at
/// `from`.
class Residuals : public ceres::CostFunction {
 public:
  Residuals(const std::vector<Replay>& replays, const FitSettings& settings, const std::vector<double>& from)
      : replays_(replays), settings_(settings) {
    const Sensitivity start = measure_sensitivity(replays, settings.grid, from, false);
    if (start.places.empty()) throw data::InputError("--start: the simulation diverges there");
    const Eigen::VectorXd rows = residuals_of(start);
    limit_ = std::max(median_of(rows.cwiseAbs()), 1e-12);
    double squares = 0;
    for (const double row : rows) squares += std::pow(tamed(row), 2);
    int keyframes = 0;
    for (const Replay& replay : replays)
      for (const Observation& observation : replay.observations)
        keyframes += observation.seen() && observation.weight > 0;
    scale_ = std::sqrt(keyframes / std::max(squares, 1e-24));
    rows_ = rows.size();
    set_num_residuals(static_cast<int>(rows_ + static_cast<Eigen::Index>(settings.priors.size())));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(settings.grid.axes.size()));
  }

  /// No exception passes through Ceres: rethrow() throws it afterwards.
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    if (failure_) return false;
    try {
      return evaluate(parameters, residuals, jacobians);
    } catch (...) {
      failure_ = std::current_exception();
      return false;
    }
  }

  bool failed() const { return failure_ != nullptr; }

  /// Throws what ended an evaluation under Ceres, if something did.
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

  /// (J^T J)^-1 at `x`; empty where a direction is not determined, or where a motion about x diverges.
  Eigen::MatrixXd covariance(const std::vector<double>& x) const {
    const auto count = static_cast<Eigen::Index>(x.size());
    Eigen::VectorXd residuals(num_residuals());
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian(num_residuals(), count);
    const double* const parameters = x.data();
    double* rows = jacobian.data();
    if (!evaluate(&parameters, residuals.data(), &rows)) return {};
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(jacobian, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Eigen::VectorXd& sizes = svd.singularValues();
    if (sizes.size() < count || !(sizes[count - 1] > 1e-7 * sizes[0])) return {};
    return svd.matrixV() * sizes.cwiseAbs2().cwiseInverse().asDiagonal() * svd.matrixV().transpose();
  }

  bool evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
    const std::vector<Axis>& axes = settings_.grid.axes;
    const auto count = static_cast<Eigen::Index>(axes.size());
    const std::vector<double> values = values_at(axes, parameters[0]);
    const bool differentiate = jacobians != nullptr && jacobians[0] != nullptr;
    const Sensitivity here = measure_sensitivity(replays_, settings_.grid, values, differentiate);
    const Eigen::VectorXd rows = here.places.empty() ? Eigen::VectorXd() : residuals_of(here);
    if (rows.size() != rows_) return false;
    fill(rows, parameters[0], residuals);
    if (!differentiate) return true;
    using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Index all = num_residuals();
    Eigen::MatrixXd rates = here.parameters;
    if (here.nuisance.cols() > 0)
      rates -= here.nuisance * here.nuisance.colPivHouseholderQr().solve(here.parameters);
    Jacobian jacobian = Jacobian::Zero(all, count);
    for (Eigen::Index i = 0; i < rows_; ++i) jacobian.row(i) = -scale_ * slope(rows[i]) * rates.row(i);
    for (std::size_t p = 0; p < settings_.priors.size(); ++p) {
      const auto [axis, weight] = prior_row(p);
      jacobian(rows_ + static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(axis)) = weight;
    }
    Eigen::Map<Jacobian>(jacobians[0], all, count) = jacobian;
    return true;
  }

  /// Costs at several coordinates, all simulated in one batch a recording; infinite where they diverge.
  std::vector<double> costs(const std::vector<Eigen::VectorXd>& points) const {
    std::vector<ReplayCandidate> candidates;
    for (const Eigen::VectorXd& x : points)
      candidates.push_back(candidate_at(values_at(settings_.grid.axes, x.data()), settings_.grid));
    std::vector<std::vector<ReplayResult>> motions;
    for (const Replay& replay : replays_) motions.push_back(run(replay, candidates));
    std::vector<double> costs(points.size(), std::numeric_limits<double>::infinity());
    data::for_each_in_parallel(points.size(), replays_.front().settings.threads, [&](std::size_t i) {
      const auto motion_of = [&](std::size_t r, const std::vector<std::vector<double>>&) {
        return std::vector<ReplayResult>{std::move(motions[r][i])};
      };
      const std::vector<double> values = values_at(settings_.grid.axes, points[i].data());
      const Sensitivity here = measure_sensitivity(replays_, settings_.grid, values, false, motion_of);
      if (here.places.empty()) return;
      const Eigen::VectorXd rows = residuals_of(here);
      if (rows.size() != rows_) return;
      Eigen::VectorXd residuals(num_residuals());
      fill(rows, points[i].data(), residuals.data());
      costs[i] = residuals.squaredNorm() / 2;
    });
    return costs;
  }

 private:
  void fill(const Eigen::VectorXd& rows, const double* x, double* residuals) const {
    for (Eigen::Index i = 0; i < rows_; ++i) residuals[i] = scale_ * tamed(rows[i]);
    for (std::size_t p = 0; p < settings_.priors.size(); ++p) {
      const auto [axis, weight] = prior_row(p);
      residuals[rows_ + static_cast<Eigen::Index>(p)] =
          weight * (x[axis] - coordinate(settings_.grid.axes[axis], settings_.priors[p].value));
    }
  }

  /// r up to the limit, beyond it sqrt(limit (2 |r| - limit)): Huber's cost is its square.
  double tamed(double r) const {
    const double size = std::abs(r);
    return size <= limit_ ? r : std::copysign(std::sqrt(limit_ * (2 * size - limit_)), r);
  }
  double slope(double r) const { return std::abs(r) <= limit_ ? 1 : limit_ / std::abs(tamed(r)); }

  std::pair<std::size_t, double> prior_row(std::size_t p) const {
    const std::vector<Axis>& axes = settings_.grid.axes;
    const Prior& prior = settings_.priors[p];
    const auto axis = static_cast<std::size_t>(
        std::find_if(axes.begin(), axes.end(), [&](const Axis& a) { return a.name == prior.name; }) -
        axes.begin());
    const double spread = axes[axis].logarithmic ? std::log(prior.spread)
                          : prior.value > 0      ? prior.value * (prior.spread - 1)
                                                 : prior.spread;
    return {axis, 1 / spread};
  }

  const std::vector<Replay>& replays_;
  const FitSettings& settings_;
  Eigen::Index rows_ = 0;
  double limit_ = 0, scale_ = 1;
  mutable std::exception_ptr failure_;
};

class Path : public ceres::IterationCallback {
 public:
  Path(const Residuals& residuals, const std::vector<Axis>& axes, const std::vector<double>& x,
       const std::function<void(const FitStep&)>& report)
      : residuals_(residuals), axes_(axes), x_(x), report_(report) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (residuals_.failed()) return ceres::SOLVER_ABORT;
    steps.push_back({values_at(axes_, x_.data()), summary.cost, summary.step_is_successful, FitStage::local});
    if (report_) report_(steps.back());
    return ceres::SOLVER_CONTINUE;
  }
  std::vector<FitStep> steps;

 private:
  const Residuals& residuals_;
  const std::vector<Axis>& axes_;
  const std::vector<double>& x_;
  const std::function<void(const FitStep&)>& report_;
};

/// "bending ended at the lower end of its range", for each axis that is there; empty where none is.
std::string at_ends(const std::vector<Axis>& axes, const std::vector<double>& x) {
  std::string text;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const double low = coordinate(axes[k], axes[k].values.front());
    const double high = coordinate(axes[k], axes[k].values.back());
    const double near = 1e-9 * (high - low);
    if (x[k] > low + near && x[k] < high - near) continue;
    text += (text.empty() ? "" : ", ") + axes[k].name + " is at the " +
            (x[k] <= low + near ? "lower" : "upper") + " end of its range";
  }
  return text;
}

std::string words_of(const ceres::Solver::Summary& summary, bool refined, const std::string& ends) {
  const std::string steps = std::to_string(summary.num_successful_steps) + " steps";
  std::string text;
  if (!refined && summary.termination_type == ceres::FAILURE)
    text = "nothing was refined: the simulation diverges about the start";
  else if (!refined && !ends.empty())
    return "nothing was refined: at the start " + ends +
           ", and the cost falls only beyond; search a wider range first";
  else if (!refined)
    text = "nothing was refined: no step from the start lowers the cost";
  else if (summary.termination_type == ceres::CONVERGENCE)
    text = "the cost stands still after " + steps;
  else if (summary.termination_type == ceres::NO_CONVERGENCE)
    text = "stopped after " + steps + ", the most that --steps allows, before the cost stood still";
  else
    text = "stopped after " + steps + ": the simulation diverges about the values reached";
  return text + (ends.empty() ? "" : "; " + ends);
}

/// The best of each generation; the last accepted one is the best of all.
std::vector<FitStep> search_globally(const std::vector<Replay>& replays, const FitSettings& settings,
                                     const std::function<void(const FitStep&)>& report) {
  const std::vector<Axis>& axes = settings.grid.axes;
  const auto count = static_cast<Eigen::Index>(axes.size());
  Eigen::VectorXd low(count), high(count), start(count);
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    low[i] = coordinate(axes[k], axes[k].values.front());
    high[i] = coordinate(axes[k], axes[k].values.back());
    start[i] = coordinate(axes[k], settings.start[k]);
  }
  const Residuals residuals(replays, settings, settings.start);
  std::vector<FitStep> steps;
  global_search([&](const std::vector<Eigen::VectorXd>& points) { return residuals.costs(points); }, low,
                high, start, settings.global,
                [&](const Generation& generation) {
                  steps.push_back({values_at(axes, generation.point.data()), generation.cost,
                                   generation.improved, FitStage::global});
                  if (report) report(steps.back());
                });
  return steps;
}

}  // namespace

FitResult fit(const std::vector<Replay>& replays, const FitSettings& settings,
              const std::function<void(const FitStep&)>& report) {
  const std::vector<Axis>& axes = settings.grid.axes;
  FitResult result;
  std::vector<double> from = settings.start;
  if (settings.global.generations > 0) result.path = search_globally(replays, settings, report);
  for (const FitStep& generation : result.path)
    if (generation.accepted) from = generation.values;
  std::vector<double> x;
  for (std::size_t k = 0; k < axes.size(); ++k) x.push_back(coordinate(axes[k], from[k]));
  Residuals residuals(replays, settings, from);
  ceres::Problem::Options borrow;
  borrow.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(borrow);
  problem.AddResidualBlock(&residuals, nullptr, x.data());
  for (std::size_t k = 0; k < axes.size(); ++k) {
    problem.SetParameterLowerBound(x.data(), static_cast<int>(k),
                                   coordinate(axes[k], axes[k].values.front()));
    problem.SetParameterUpperBound(x.data(), static_cast<int>(k), coordinate(axes[k], axes[k].values.back()));
  }
  ceres::Solver::Options options;
  options.max_num_iterations = settings.iterations;
  options.function_tolerance = settings.tolerance;
  options.parameter_tolerance = 1e-5;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  FLAGS_minloglevel = google::GLOG_FATAL;  // SILENT leaves the warning of a failed evaluation
  options.update_state_every_iteration = true;
  Path path(residuals, axes, x, report);
  options.callbacks.push_back(&path);
  ceres::Solver::Summary summary;
  const std::vector<double> start = x;
  ceres::Solve(options, &problem, &summary);
  residuals.rethrow();

  result.values = values_at(axes, x.data());
  result.path.insert(result.path.end(), path.steps.begin(), path.steps.end());
  result.refined = x != start;
  const std::string ends = at_ends(axes, x);
  result.stuck = !result.refined && (!ends.empty() || summary.termination_type == ceres::FAILURE);
  result.termination = words_of(summary, result.refined, ends);
  result.covariance = residuals.covariance(x);
  std::vector<ReplayResult> motions;
  for (const Replay& replay : replays)
    motions.push_back(std::move(run(replay, {candidate_at(result.values, settings.grid)}).front()));
  result.best = score_motions(replays, motions, settings.grid.score);
  result.best.values = result.values;
  return result;
}

}  // namespace flash::sysid
