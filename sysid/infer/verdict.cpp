#include "sysid/infer/verdict.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "data/files/text.h"
#include "data/numbers/chi_square.h"

namespace flash::sysid {
namespace {

/// Deviance over the least, from which an end of the range is excluded. Theory: chi-square of one degree of
/// freedom, once in twenty.
constexpr double kExcluded = data::chi_square_95_of_1;
/// Bits of the usual range, from which a parameter is told. Chosen: what told means: the interval is at most
/// half of what fabrics have.
constexpr double kLeastBits = 1;

/// As coordinates of an axis.
std::array<double, 2> usual_of(const Axis& axis, const MaterialBase& base) {
  const auto [low, high] = usual_range(parameter_named(axis.name), base);
  return axis.logarithmic ? std::array{std::log(low), std::log(high)} : std::array{low, high};
}

/// Least score at each value of an axis, over what was simulated.
void add_profile(const GridResults& results, std::size_t k, ParameterFinding& finding) {
  for (const double value : results.axes[k].values) {
    double least = std::numeric_limits<double>::infinity();
    for (const CandidateResult& candidate : results.candidates)
      if (candidate.values[k] == value) least = std::min(least, candidate.score);
    if (!std::isfinite(least)) continue;
    finding.values.push_back(value);
    finding.scores.push_back(least);
  }
}

ParameterFinding empty_finding(const GridResults& results, std::size_t k) {
  ParameterFinding finding;
  finding.name = results.axes[k].name;
  finding.logarithmic = results.axes[k].logarithmic;
  add_profile(results, k, finding);
  return finding;
}

/// Which end of a range a coordinate is at, up to rounding of a logarithm and back.
RangeEdge edge_of(const Axis& range, double coordinate) {
  const double low = coordinate_of(range, range.values.front()),
               high = coordinate_of(range, range.values.back());
  const double rounding = 1e-9 * (high - low);
  return coordinate <= low + rounding    ? RangeEdge::low
         : coordinate >= high - rounding ? RangeEdge::high
                                         : RangeEdge::none;
}

std::string note_of(const ParameterFinding& finding, bool open_below, bool open_above) {
  std::string note;
  const auto add = [&](const std::string& sentence) { note += (note.empty() ? "" : "; ") + sentence; };
  const std::string low = data::format_short(finding.values.front()),
                    high = data::format_short(finding.values.back());
  if (finding.identifiable == Identifiable::no && open_below && open_above)
    add("every value from " + low + " to " + high + " is likely");
  if (finding.identifiable == Identifiable::no && !(open_below && open_above))
    add("the recordings halve the range that is usual for cloth by less than once");
  if (finding.identifiable == Identifiable::lower_bound)
    add("only values below " + data::format_short((*finding.interval95)[0]) + " are excluded");
  if (finding.identifiable == Identifiable::upper_bound)
    add("only values above " + data::format_short((*finding.interval95)[1]) + " are excluded");
  if (finding.edge != RangeEdge::none) add(edge_text(finding.edge));
  return note;
}

}  // namespace

std::vector<ParameterFinding> findings_of(const GridResults& results, const std::vector<Axis>& searched,
                                          const Posterior& posterior, const MaterialBase& base) {
  std::vector<ParameterFinding> findings;
  for (std::size_t k = 0; k < searched.size(); ++k) {
    ParameterFinding finding = empty_finding(results, k);
    const Axis& range = searched[k];
    const Axis& looked = posterior.axes[k];
    const double estimate = posterior.values()[k];
    finding.estimate = estimate;
    if (looked.values.size() > 1) {
      // What a look leaves likely at its end may be likely up to the end of the range.
      const auto open = [&](bool high) {
        return posterior.ends(static_cast<Eigen::Index>(k), high ? 1 : 0) < kExcluded;
      };
      const double mode = posterior.estimate[static_cast<Eigen::Index>(k)];
      const RangeEdge edge = edge_of(range, mode);
      // The most likely values of all parameters together may lie beyond what is likely of one by itself.
      double low = std::min(mode, posterior.quantile(k, 0.025)),
             high = std::max(mode, posterior.quantile(k, 0.975));
      if (posterior.reach.rows() > 0) {
        low = std::min(low, posterior.reach(static_cast<Eigen::Index>(k), 0));
        high = std::max(high, posterior.reach(static_cast<Eigen::Index>(k), 1));
      }
      // So may what the range cuts off.
      const bool below = open(false) || edge_of(range, low) == RangeEdge::low,
                 above = open(true) || edge_of(range, high) == RangeEdge::high;
      finding.interval95 = {below ? range.values.front() : value_of(looked, low),
                            above ? range.values.back() : value_of(looked, high)};
      const std::array<double, 2> usual = usual_of(range, base);
      const double from = below ? std::min(usual[0], low) : low, to = above ? std::max(usual[1], high) : high;
      finding.bits = std::log2((usual[1] - usual[0]) / std::max(to - from, 1e-12));
      finding.identifiable = (below && above) || *finding.bits < kLeastBits ? Identifiable::no
                             : below                                        ? Identifiable::upper_bound
                             : above                                        ? Identifiable::lower_bound
                                                                            : Identifiable::yes;
      // Where every value is likely, a wider range would tell no more.
      if (!(below && above)) finding.edge = edge;
      finding.note = note_of(finding, below, above);
    } else {
      finding.interval95 = {estimate, estimate};
    }
    findings.push_back(std::move(finding));
  }
  return findings;
}

std::vector<ParameterFinding> findings_without_posterior(const GridResults& results,
                                                         const std::vector<double>& values) {
  std::vector<ParameterFinding> findings;
  for (std::size_t k = 0; k < results.axes.size(); ++k) {
    ParameterFinding finding = empty_finding(results, k);
    finding.estimate = values[k];
    finding.interval95 = {results.axes[k].values.front(), results.axes[k].values.back()};
    findings.push_back(std::move(finding));
  }
  return findings;
}

Eigen::MatrixXd samples_of(const Posterior& posterior) {
  Eigen::MatrixXd samples = posterior.samples;
  for (std::size_t k = 0; k < posterior.axes.size(); ++k)
    for (double& value : samples.col(static_cast<Eigen::Index>(k)))
      value = value_of(posterior.axes[k], value);
  return samples;
}

Eigen::MatrixXd covariance_of_logarithms(const Posterior& posterior) {
  for (const Axis& axis : posterior.axes)
    if (axis.values.front() <= 0 || axis.values.size() < 2) return {};
  const Eigen::MatrixXd logarithms = samples_of(posterior).array().log();
  const Eigen::MatrixXd from_mean = logarithms.rowwise() - logarithms.colwise().mean();
  return from_mean.transpose() * from_mean /
         static_cast<double>(std::max<Eigen::Index>(1, logarithms.rows() - 1));
}

}  // namespace flash::sysid
