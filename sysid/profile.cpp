#include "sysid/profile.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "data/text.h"

namespace flash::sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// 95 % quantiles of chi^2 for 1 to 8 degrees of freedom.
constexpr std::array<double, 8> kQuantile95 = {3.841, 5.991, 7.815, 9.488, 11.070, 12.592, 14.067, 15.507};

double coordinate(const Axis& axis, double value) { return axis.logarithmic ? std::log(value) : value; }
double value_at(const Axis& axis, double coordinate) {
  return axis.logarithmic ? std::exp(coordinate) : coordinate;
}

/// chi^2 of a score over the best one; a score is known to `score_error` only.
double misfit(double score, const GridVerdict& verdict) {
  const double least = std::max(score - verdict.score_error, verdict.score);
  return verdict.keyframes * (least * least - verdict.score * verdict.score) /
         (verdict.sigma * verdict.sigma);
}

std::size_t index_of(const Axis& axis, double value) {
  const auto nearer = [&](double a, double b) { return std::abs(a - value) < std::abs(b - value); };
  return static_cast<std::size_t>(std::min_element(axis.values.begin(), axis.values.end(), nearer) -
                                  axis.values.begin());
}

/// Vertex of the parabola through the best value and its neighbours, kept between them.
double refined_estimate(const Axis& axis, const std::vector<double>& scores, std::size_t best) {
  const double here = axis.values[best];
  if (best == 0 || best + 1 == axis.values.size()) return here;
  const double x0 = coordinate(axis, axis.values[best - 1]), x1 = coordinate(axis, here),
               x2 = coordinate(axis, axis.values[best + 1]);
  const double y0 = scores[best - 1], y1 = scores[best], y2 = scores[best + 1];
  if (!std::isfinite(y0) || !std::isfinite(y2)) return here;
  const double left = (y1 - y0) / (x1 - x0), right = (y2 - y1) / (x2 - x1);
  const double curvature = (right - left) / (x2 - x0);
  if (curvature <= 0) return here;
  const double vertex = 0.5 * (x0 + x1) - left / (2 * curvature);
  return value_at(axis, std::clamp(vertex, 0.5 * (x0 + x1), 0.5 * (x1 + x2)));
}

/// Where chi^2 passes `limit` between an included and an excluded value.
double crossing(const Axis& axis, const std::vector<double>& chi2, std::size_t inside, std::size_t outside,
                double limit) {
  const double a = coordinate(axis, axis.values[inside]), b = coordinate(axis, axis.values[outside]);
  // The root of chi^2 is straight where chi^2 is a parabola.
  const double from = std::sqrt(chi2[inside]), to = std::sqrt(chi2[outside]);
  const double s = std::isfinite(to) ? (std::sqrt(limit) - from) / (to - from) : 0.5;
  return value_at(axis, a + s * (b - a));
}

std::string note_of(const ParameterFinding& finding, bool touched_unconverged) {
  std::string note;
  const auto add = [&](const std::string& sentence) { note += (note.empty() ? "" : "; ") + sentence; };
  switch (finding.identifiable) {
    case Identifiable::no:
      add("no value searched is excluded: not identifiable from these recordings");
      break;
    case Identifiable::lower_bound:
      add("only values below " + data::format_short((*finding.interval95)[0]) + " are excluded");
      break;
    case Identifiable::upper_bound:
      add("only values above " + data::format_short((*finding.interval95)[1]) + " are excluded");
      break;
    case Identifiable::yes:
      break;
  }
  if (finding.edge == RangeEdge::low) add("the best value is the lowest searched: search lower");
  if (finding.edge == RangeEdge::high) add("the best value is the highest searched: search higher");
  if (touched_unconverged) add("the profile rests on candidates whose simulation did not converge");
  return note;
}

ParameterFinding find_parameter(const GridResults& results, std::size_t k, const GridVerdict& verdict,
                                double limit) {
  const Axis& axis = results.axes[k];
  ParameterFinding finding;
  finding.name = axis.name;
  finding.logarithmic = axis.logarithmic;
  finding.values = axis.values;
  finding.scores.assign(axis.values.size(), kInfinity);
  std::vector<bool> unconverged(axis.values.size(), false);
  for (const CandidateResult& candidate : results.candidates) {
    const std::size_t i = index_of(axis, candidate.values[k]);
    if (!(candidate.score < finding.scores[i])) continue;
    finding.scores[i] = candidate.score;
    unconverged[i] = candidate.status != CandidateStatus::ok;
  }
  std::vector<double> chi2;
  for (const double score : finding.scores) {
    chi2.push_back(std::isfinite(score) ? misfit(score, verdict) : kInfinity);
  }

  const std::size_t last = axis.values.size() - 1;
  const std::size_t best = index_of(axis, results.candidates[verdict.best].values[k]);
  std::size_t low = best, high = best;
  for (std::size_t i = 0; i <= last; ++i) {
    if (chi2[i] > limit) continue;
    low = std::min(low, i);
    high = std::max(high, i);
  }
  const bool closed_below = low > 0, closed_above = high < last;
  finding.estimate = refined_estimate(axis, finding.scores, best);
  finding.interval95 = {closed_below ? crossing(axis, chi2, low, low - 1, limit) : axis.values.front(),
                        closed_above ? crossing(axis, chi2, high, high + 1, limit) : axis.values.back()};
  // On a coarse grid the vertex may lie where no candidate stands: it belongs to the interval all the same.
  finding.interval95 = {std::min((*finding.interval95)[0], *finding.estimate),
                        std::max((*finding.interval95)[1], *finding.estimate)};
  if (axis.values.size() > 1) {
    finding.identifiable = closed_below && closed_above ? Identifiable::yes
                           : closed_above               ? Identifiable::upper_bound
                           : closed_below               ? Identifiable::lower_bound
                                                        : Identifiable::no;
    finding.edge = best == 0 ? RangeEdge::low : best == last ? RangeEdge::high : RangeEdge::none;
  }
  finding.note = note_of(finding, unconverged[best]);
  return finding;
}

/// Least squares of chi^2 = c + g.x + x.H x / 2 over candidates near the best, x the log of the parameters;
/// covariance = 2 H^-1 because chi^2 of a Gaussian is (x - m)^T C^-1 (x - m).
Eigen::MatrixXd covariance_of(const GridResults& results, const GridVerdict& verdict) {
  constexpr double kReach = 12;
  const auto parameters = static_cast<Eigen::Index>(results.axes.size());
  for (const Axis& axis : results.axes) {
    if (axis.values.front() <= 0 || axis.values.size() < 3) return {};
  }
  const Eigen::Index unknowns = 1 + parameters + parameters * (parameters + 1) / 2;
  std::vector<Eigen::VectorXd> rows;
  std::vector<double> rises;
  const CandidateResult& best = results.candidates[verdict.best];
  for (const CandidateResult& candidate : results.candidates) {
    const double rise = misfit(candidate.score, verdict);
    if (!(rise < kReach)) continue;
    Eigen::VectorXd row(unknowns);
    Eigen::Index column = 0;
    row[column++] = 1;
    const auto x = [&](Eigen::Index i) { return std::log(candidate.values[i] / best.values[i]); };
    for (Eigen::Index i = 0; i < parameters; ++i) row[column++] = x(i);
    for (Eigen::Index i = 0; i < parameters; ++i) {
      for (Eigen::Index j = i; j < parameters; ++j) row[column++] = i == j ? 0.5 * x(i) * x(i) : x(i) * x(j);
    }
    rows.push_back(row);
    rises.push_back(rise);
  }
  const auto count = static_cast<Eigen::Index>(rows.size());
  if (count <= unknowns) return {};
  Eigen::MatrixXd matrix(count, unknowns);
  for (Eigen::Index i = 0; i < count; ++i) matrix.row(i) = rows[i].transpose();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(matrix);
  if (qr.rank() < unknowns) return {};
  const Eigen::VectorXd solution = qr.solve(Eigen::Map<const Eigen::VectorXd>(rises.data(), count));
  Eigen::MatrixXd hessian(parameters, parameters);
  Eigen::Index column = 1 + parameters;
  for (Eigen::Index i = 0; i < parameters; ++i) {
    for (Eigen::Index j = i; j < parameters; ++j) hessian(i, j) = hessian(j, i) = solution[column++];
  }
  const Eigen::LLT<Eigen::MatrixXd> llt(hessian);
  if (llt.info() != Eigen::Success) return {};
  return 2 * llt.solve(Eigen::MatrixXd::Identity(parameters, parameters));
}

}  // namespace

GridVerdict profile_grid(const GridResults& results, std::optional<double> repeatability,
                         double score_error) {
  GridVerdict verdict;
  verdict.score_error = score_error;
  verdict.score = kInfinity;
  for (std::size_t i = 0; i < results.candidates.size(); ++i) {
    if (!(results.candidates[i].score < verdict.score)) continue;
    verdict.score = results.candidates[i].score;
    verdict.best = static_cast<int>(i);
  }
  if (verdict.best < 0) return verdict;

  for (const RecordingScore& recording : results.candidates[verdict.best].recordings) {
    for (const KeyframeScore& keyframe : recording.keyframes) {
      verdict.keyframes += keyframe.points > 0 && keyframe.weight > 0;
    }
  }
  verdict.sigma = std::max(repeatability.value_or(0.0), verdict.score);
  verdict.sigma_source = repeatability && *repeatability >= verdict.score ? "repeatability" : "residual";
  const std::size_t freedom = std::clamp<std::size_t>(results.axes.size(), 1, kQuantile95.size());
  const double variance_share = kQuantile95[freedom - 1] / std::max(verdict.keyframes, 1);
  verdict.level95 =
      score_error + std::sqrt(verdict.score * verdict.score + variance_share * verdict.sigma * verdict.sigma);
  for (std::size_t k = 0; k < results.axes.size(); ++k) {
    verdict.parameters.push_back(find_parameter(results, k, verdict, kQuantile95[0]));
  }
  verdict.covariance_log = covariance_of(results, verdict);
  return verdict;
}

}  // namespace flash::sysid
