#include "sysid/infer/profile.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "data/text.h"
#include "sysid/emulate/score_interpolant.h"
#include "sysid/infer/cluster_variance.h"

namespace flash::sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNormalQuantile = 1.959964;
constexpr double kLimit = kNormalQuantile * kNormalQuantile;  // chi^2, one degree of freedom
constexpr int kPointsPerCell = 8;                             // of a profile, between two values of the grid

/// 95 % quantiles of chi^2 for 1 to 8 degrees of freedom.
constexpr std::array<double, 8> kQuantile95 = {3.841, 5.991, 7.815, 9.488, 11.070, 12.592, 14.067, 15.507};

constexpr double kStraight = 1e-3;     // of a rise, below which its straight part is rounding
constexpr double kLeastCurved = 0.05;  // of a rise: beyond, only the slope is tested, at more than four sigma

/// One point of a profile: coordinates that minimise the score at one coordinate held.
struct ProfilePoint {
  Eigen::VectorXd x;
  double score = 0;  ///< [m]
  double chi2 = 0;
};

struct Sampling {
  const ScoreInterpolant& surface;
  std::optional<double> repeatability;
  Eigen::VectorXd best;                ///< coordinates of the estimate
  double best_score = 0;               ///< [m]
  Eigen::VectorXd best_scores;         ///< of the samples [m]
  Eigen::MatrixXd gradients;           ///< of the samples at the estimate
  Eigen::MatrixXd hessian;             ///< of the score there
  double quantile = 0;                 ///< Student's, all keyframes counting alike
  double interpolation = 0;            ///< error of a score [m]
  std::vector<ClusterVariance> few{};  ///< one an axis; empty: all keyframes count alike

  int recordings() const { return surface.recordings().empty() ? 0 : 1 + surface.recordings().back(); }
};

/// Variance of the weighted mean of `values`, recordings being strata; their weighted means go to `means` and
/// the variances of those to `variances`.
double variance_of_mean(const Sampling& sampling, const Eigen::VectorXd& values, std::vector<double>& means,
                        std::vector<double>& variances) {
  const Eigen::VectorXd& weights = sampling.surface.weights();
  const double mean = weights.dot(values);
  double sum = 0;
  means.clear();
  variances.clear();
  for (int r = 0; r < sampling.recordings(); ++r) {
    double total = 0, stratum = 0, squares = 0;
    int count = 0;
    const auto for_each = [&](const auto& use) {
      for (Eigen::Index k = 0; k < values.size(); ++k)
        if (sampling.surface.recordings()[static_cast<std::size_t>(k)] == r) use(k);
    };
    for_each([&](Eigen::Index k) {
      total += weights[k];
      stratum += weights[k] * values[k];
      ++count;
    });
    if (count == 0) continue;
    // A single keyframe has no scatter of its own: it is taken with the rest.
    const double centre = count > 1 ? stratum / total : mean;
    for_each([&](Eigen::Index k) { squares += std::pow(weights[k] * (values[k] - centre), 2); });
    if (count > 1 && sampling.few.empty()) squares *= count / (count - 1.0);
    sum += squares;
    means.push_back(stratum / total);
    variances.push_back(squares / (total * total));
  }
  return sum;
}

/// By how much recordings disagree about the direction beyond the scatter of their keyframes (Birge 1932): at
/// the estimate the mean slope along it is zero over all, not in each.
double birge_ratio(const Sampling& sampling, const Eigen::VectorXd& direction) {
  std::vector<double> means, variances;
  variance_of_mean(sampling, sampling.gradients * direction, means, variances);
  if (means.size() < 2) return 1;
  double sum = 0;
  for (std::size_t r = 0; r < means.size(); ++r)
    sum += variances[r] > 0 ? means[r] * means[r] / variances[r] : 0;
  return std::max(1.0, sum / static_cast<double>(means.size() - 1));
}

/// `axis`: whose profile the point is of; none: of no one's.
double chi_squared(const Sampling& sampling, const ProfilePoint& point, std::optional<std::size_t> axis) {
  const Eigen::VectorXd rises = sampling.surface.scores(point.x) - sampling.best_scores;
  const double rise = std::max(0.0, sampling.surface.weights().dot(rises) - sampling.interpolation);
  // Where the range ends before the score falls no more, it rises from there in a straight line too. Only of
  // kept motions is its slope known: between scores the spline may undershoot to nothing, where it has none.
  const Eigen::VectorXd step = point.x - sampling.best;
  double curved = rise;
  if (!sampling.few.empty() && sampling.surface.weights().dot(sampling.gradients * step) > kStraight * rise)
    curved = std::clamp(0.5 * step.dot(sampling.hessian * step), kLeastCurved * rise, rise);
  std::vector<double> means, variances;
  double variance =
      variance_of_mean(sampling, rises, means, variances) * birge_ratio(sampling, point.x - sampling.best);
  double quantile = sampling.quantile;
  if (axis && !sampling.few.empty()) {
    variance *= sampling.few[*axis].variance;
    quantile = student_quantile(std::max(1.0, sampling.few[*axis].freedom));
  }
  const double scaled = kNormalQuantile / quantile;
  double chi2 = 0;
  if (curved > 0) chi2 = variance > 0 ? 4 * rise * curved / variance * scaled * scaled : kInfinity;
  if (sampling.repeatability) {
    const double squares = point.score * point.score - sampling.best_score * sampling.best_score;
    const double samples = static_cast<double>(rises.size());
    chi2 = std::min(chi2, samples * std::max(0.0, squares) / std::pow(*sampling.repeatability, 2));
  }
  return chi2;
}

/// Best candidates first, diverged ones left out.
std::vector<const CandidateResult*> ranked(const GridResults& results) {
  std::vector<const CandidateResult*> order;
  for (const CandidateResult& candidate : results.candidates)
    if (std::isfinite(candidate.score)) order.push_back(&candidate);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto* a, const auto* b) { return a->score < b->score; });
  return order;
}

/// Coordinates at which a profile is wanted: those of the grid, some between, and the estimate's.
std::vector<double> profile_coordinates(const Eigen::VectorXd& knots, double best) {
  std::vector<double> coordinates;
  for (Eigen::Index i = 0; i + 1 < knots.size(); ++i)
    for (int j = 0; j < kPointsPerCell; ++j)
      coordinates.push_back(knots[i] + (knots[i + 1] - knots[i]) * j / kPointsPerCell);
  coordinates.push_back(knots[knots.size() - 1]);
  const auto place = std::lower_bound(coordinates.begin(), coordinates.end(), best);
  if (place == coordinates.end() || *place != best) coordinates.insert(place, best);
  return coordinates;
}

/// The profile along axis k, from the estimate outwards, each point from its neighbour and from the best
/// candidate of the nearest slice of the grid.
std::vector<ProfilePoint> profile_along(const ScoreInterpolant& surface, std::size_t k,
                                        const Eigen::VectorXd& best,
                                        const std::vector<const CandidateResult*>& order) {
  const auto axis = static_cast<Eigen::Index>(k);
  const std::vector<double> coordinates = profile_coordinates(surface.knots(k), best[axis]);
  std::vector<bool> free(static_cast<std::size_t>(surface.parameters()), true);
  free[k] = false;
  std::vector<Eigen::VectorXd> slices;
  for (const double knot : surface.knots(k)) {
    const auto found = std::find_if(order.begin(), order.end(), [&](const CandidateResult* candidate) {
      return surface.coordinate(k, candidate->values[k]) == knot;
    });
    slices.push_back(found == order.end() ? best : surface.coordinates((*found)->values));
  }
  std::vector<ProfilePoint> profile(coordinates.size());
  const auto visit = [&](std::size_t i, const Eigen::VectorXd& neighbour) {
    Eigen::Index slice;
    (surface.knots(k).array() - coordinates[i]).abs().minCoeff(&slice);
    profile[i].score = kInfinity;
    for (Eigen::VectorXd x : {neighbour, slices[static_cast<std::size_t>(slice)]}) {
      x[axis] = coordinates[i];
      const double score = surface.minimize(free, x);
      if (score < profile[i].score) profile[i] = {x, score, 0};
    }
  };
  const auto middle = static_cast<std::size_t>(
      std::lower_bound(coordinates.begin(), coordinates.end(), best[axis]) - coordinates.begin());
  for (std::size_t i = middle; i < profile.size(); ++i) visit(i, i == middle ? best : profile[i - 1].x);
  for (std::size_t i = middle; i-- > 0;) visit(i, profile[i + 1].x);
  return profile;
}

/// Where chi^2 passes the limit between an included and an excluded coordinate; its root is straight where
/// chi^2 is a parabola.
double crossing(const ProfilePoint& inside, const ProfilePoint& outside, Eigen::Index axis) {
  const double from = std::sqrt(inside.chi2), to = std::sqrt(outside.chi2);
  const double s = std::isfinite(to) ? (kNormalQuantile - from) / (to - from) : 0.5;
  return inside.x[axis] + s * (outside.x[axis] - inside.x[axis]);
}

std::string millimetres(double metres) { return data::format_short(1000 * metres) + " mm"; }

/// The profile over the whole range searched.
struct WholeProfile {
  std::vector<double> values, scores;  // [m]
  double least = 0;                    // score [m]
};

/// Whether another parameter stands where the grid ends and its range does not: the profile lies lower there.
bool cut_off(const ProfilePoint& point, std::size_t k, const ScoreInterpolant& surface,
             const std::vector<RangeEnd>& ends) {
  return std::any_of(ends.begin(), ends.end(), [&](const RangeEnd& end) {
    if (end.axis == k) return false;
    const auto axis = static_cast<Eigen::Index>(end.axis);
    const Eigen::VectorXd& knots = surface.knots(end.axis);
    const double first = knots[0], last = knots[knots.size() - 1], near = 1e-6 * (last - first),
                 range = surface.coordinate(end.axis, end.estimate[axis]);
    return (range < first - near && point.x[axis] <= first + near) ||
           (range > last + near && point.x[axis] >= last - near);
  });
}

/// A part and the ends of the range around it.
WholeProfile whole_profile(WholeProfile part, const std::vector<RangeEnd>& ends, std::size_t k) {
  for (const RangeEnd& end : ends) {
    const double value = end.estimate[static_cast<Eigen::Index>(k)];
    if (end.axis != k || (value >= part.values.front() && value <= part.values.back())) continue;
    const bool below = value < part.values.front();
    part.values.insert(below ? part.values.begin() : part.values.end(), value);
    part.scores.insert(below ? part.scores.begin() : part.scores.end(), end.score);
  }
  return part;
}

std::string note_of(const ParameterFinding& finding, double least, bool unconverged) {
  std::string note;
  const auto add = [&](const std::string& sentence) { note += (note.empty() ? "" : "; ") + sentence; };
  if (finding.identifiable == Identifiable::no) {
    const double highest = *std::max_element(finding.scores.begin(), finding.scores.end());
    add("no value searched is excluded: over the whole range the best score rises by " +
        millimetres(highest - least) +
        ", less than scatter of the keyframes and error of the solver explain: not identifiable");
  }
  if (finding.identifiable == Identifiable::lower_bound)
    add("only values below " + data::format_short((*finding.interval95)[0]) + " are excluded");
  if (finding.identifiable == Identifiable::upper_bound)
    add("only values above " + data::format_short((*finding.interval95)[1]) + " are excluded");
  if (finding.edge == RangeEdge::low) add("the best value is the lowest searched: search lower");
  if (finding.edge == RangeEdge::high) add("the best value is the highest searched: search higher");
  if (unconverged) add("the profile rests on candidates whose simulation did not converge");
  return note;
}

/// A parameter's finding but for the words, and on which sides values are excluded.
struct ProfiledParameter {
  ParameterFinding finding;
  std::vector<ProfilePoint> profile;
  WholeProfile whole;
  bool closed_below = false, closed_above = false;
};

ProfiledParameter find_interval(const GridResults& results, std::size_t k, const Sampling& sampling,
                                std::vector<ProfilePoint> profile, const ProfileSettings& settings) {
  const ScoreInterpolant& surface = sampling.surface;
  const SolverError& solver = settings.solver;
  const auto axis = static_cast<Eigen::Index>(k);
  const Eigen::VectorXd& knots = surface.knots(k);
  const double best = sampling.best[axis];
  ParameterFinding finding;
  finding.name = results.axes[k].name;
  finding.logarithmic = results.axes[k].logarithmic;
  std::size_t low = 0, high = 0;  // the outermost points inside; the estimate is one of them
  bool found = false;
  WholeProfile part{{}, {}, sampling.best_score};
  const double lowest = results.axes[k].values.front(), highest = results.axes[k].values.back();
  const auto value_of = [&](std::size_t i) {  // the ends of the axis to the last digit
    return i == 0 ? lowest : i + 1 == profile.size() ? highest : surface.value(k, profile[i].x[axis]);
  };
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const bool is_best = profile[i].x[axis] == best;
    profile[i].chi2 = is_best ? 0 : chi_squared(sampling, profile[i], k);
    if (is_best || !cut_off(profile[i], k, surface, settings.ends)) {
      part.values.push_back(value_of(i));
      part.scores.push_back(profile[i].score);
    }
    if (profile[i].chi2 > kLimit) continue;
    if (!found) low = i;
    high = i;
    found = true;
  }
  finding.estimate = std::clamp(surface.value(k, best), lowest, highest);

  double below = low > 0 ? crossing(profile[low], profile[low - 1], axis) : knots[0];
  double above =
      high + 1 < profile.size() ? crossing(profile[high], profile[high + 1], axis) : knots[knots.size() - 1];
  double squares = 0;
  for (const SolverShift& remainder : solver.remainders) squares += remainder[axis] * remainder[axis];
  below = best - std::sqrt(std::pow(best - below, 2) + squares);
  above = best + std::sqrt(std::pow(above - best, 2) + squares);
  for (const SolverShift& shift : solver.shifts) {
    below -= std::max(0.0, shift[axis]);
    above += std::max(0.0, -shift[axis]);
  }
  const double error = solver.score + solver.interpolation;
  WholeProfile whole = whole_profile(std::move(part), settings.ends, k);
  const auto rises = [&](double from, double to) {
    for (std::size_t i = 0; i < whole.values.size(); ++i)
      if (whole.values[i] >= from && whole.values[i] <= to && whole.scores[i] - whole.least > error)
        return true;
    return false;
  };
  const double first = whole.values.front(), end = whole.values.back();
  const bool closed_below =
      low > 0 && below > surface.coordinate(k, first) && rises(first, value_of(low - 1));
  const bool closed_above =
      high + 1 < profile.size() && above < surface.coordinate(k, end) && rises(value_of(high + 1), end);
  finding.interval95 = {closed_below ? surface.value(k, below) : first,
                        closed_above ? surface.value(k, above) : end};
  finding.values = whole.values;
  finding.scores = whole.scores;
  return {std::move(finding), std::move(profile), std::move(whole), closed_below, closed_above};
}

/// Widens the interval to a value, at most to the range.
void hold(ProfiledParameter& parameter, double value) {
  auto& [low, high] = *parameter.finding.interval95;
  const double first = parameter.whole.values.front(), end = parameter.whole.values.back();
  low = std::max(first, std::min(low, value));
  high = std::min(end, std::max(high, value));
  parameter.closed_below = parameter.closed_below && low > first;
  parameter.closed_above = parameter.closed_above && high < end;
}

/// What one parameter's profile does not exclude, the intervals of the others hold: by its scatter, or on a
/// side where the solver cannot be trusted to tell a valley from flat.
void hold_profiles(const ScoreInterpolant& surface, const Eigen::VectorXd& best,
                   const std::vector<RangeEnd>& ends, std::vector<ProfiledParameter>& parameters) {
  const std::vector<ProfiledParameter> found = parameters;
  const auto closed = [&](std::size_t j, double x) {
    return x < best[static_cast<Eigen::Index>(j)] ? found[j].closed_below : found[j].closed_above;
  };
  for (std::size_t j = 0; j < found.size(); ++j)
    for (std::size_t k = 0; k < found.size(); ++k) {
      if (k == j) continue;
      const auto axis = static_cast<Eigen::Index>(k);
      for (const ProfilePoint& point : found[j].profile)
        if (point.chi2 <= kLimit || !closed(j, point.x[static_cast<Eigen::Index>(j)]))
          hold(parameters[k], surface.value(k, point.x[axis]));
      for (const RangeEnd& end : ends)
        if (end.axis == j && !closed(j, surface.coordinate(j, end.estimate[static_cast<Eigen::Index>(j)])))
          hold(parameters[k], end.estimate[axis]);
    }
}

ParameterFinding conclude(const GridResults& results, std::size_t k, const Sampling& sampling,
                          ProfiledParameter parameter) {
  ParameterFinding finding = std::move(parameter.finding);
  bool unconverged = false;
  if (parameter.profile.size() > 1) {
    finding.identifiable = parameter.closed_below && parameter.closed_above ? Identifiable::yes
                           : parameter.closed_above                         ? Identifiable::upper_bound
                           : parameter.closed_below                         ? Identifiable::lower_bound
                                                                            : Identifiable::no;
    const double best = sampling.best[static_cast<Eigen::Index>(k)];
    finding.edge = best <= sampling.surface.coordinate(k, finding.values.front())  ? RangeEdge::low
                   : best >= sampling.surface.coordinate(k, finding.values.back()) ? RangeEdge::high
                                                                                   : RangeEdge::none;
    const auto least = std::min_element(results.candidates.begin(), results.candidates.end(),
                                        [](const auto& a, const auto& b) { return a.score < b.score; });
    unconverged = least->status != CandidateStatus::ok;
  }
  finding.note = note_of(finding, parameter.whole.least, unconverged);
  return finding;
}

/// H^-1 J H^-1, H the Hessian of the score at the estimate and J the covariance of its gradient by the
/// scatter of the keyframes; of the logarithms of the parameters.
Eigen::MatrixXd covariance_of(const GridResults& results, const Sampling& sampling) {
  const Eigen::Index parameters = sampling.surface.parameters();
  Eigen::VectorXd per_log(parameters);  // d coordinate / d log(parameter)
  for (Eigen::Index k = 0; k < parameters; ++k) {
    const Axis& axis = results.axes[static_cast<std::size_t>(k)];
    if (axis.values.front() <= 0 || axis.values.size() < 3) return {};
    per_log[k] = axis.logarithmic ? 1 : sampling.best[k];
  }
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  sampling.surface.score(sampling.best, gradient, hessian);
  const Eigen::LLT<Eigen::MatrixXd> llt(hessian);
  if (llt.info() != Eigen::Success) return {};
  Eigen::MatrixXd scatter(parameters, parameters);
  std::vector<double> means, variances;
  const auto variance = [&](const Eigen::VectorXd& direction) {
    return variance_of_mean(sampling, sampling.gradients * direction, means, variances);
  };
  for (Eigen::Index i = 0; i < parameters; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      const Eigen::VectorXd a = Eigen::VectorXd::Unit(parameters, i),
                            b = Eigen::VectorXd::Unit(parameters, j);
      scatter(i, j) = scatter(j, i) = 0.25 * (variance(a + b) - variance(a - b));
    }
  const Eigen::MatrixXd inverse = llt.solve(Eigen::MatrixXd::Identity(parameters, parameters));
  const Eigen::MatrixXd covariance = inverse * scatter * inverse;
  const Eigen::VectorXd per_coordinate = per_log.cwiseInverse();
  return per_coordinate.asDiagonal() * covariance * per_coordinate.asDiagonal();
}

/// The spread that makes the Gaussian region n (s^2 - s_best^2) / sigma^2 end where the sampled one does.
double equivalent_sigma(const GridResults& results, const Sampling& sampling) {
  const double samples = static_cast<double>(sampling.best_scores.size());
  double sigma = 0, nearest = kInfinity;
  for (const CandidateResult& candidate : results.candidates) {
    if (!std::isfinite(candidate.score)) continue;
    ProfilePoint point{sampling.surface.coordinates(candidate.values), candidate.score, 0};
    const double chi2 = chi_squared(sampling, point, std::nullopt);
    const double squares = candidate.score * candidate.score - sampling.best_score * sampling.best_score;
    if (!(chi2 > 0) || squares <= 0 || std::abs(std::log(chi2 / kLimit)) >= nearest) continue;
    nearest = std::abs(std::log(chi2 / kLimit));
    sigma = std::sqrt(samples * squares / chi2);
  }
  return sigma;
}

}  // namespace

GridVerdict profile_grid(const GridResults& results, std::optional<double> repeatability,
                         const SolverError& solver) {
  return profile_grid(results, {repeatability, solver});
}

GridVerdict profile_grid(const GridResults& results, const ProfileSettings& settings) {
  const std::optional<double> repeatability = settings.repeatability;
  GridVerdict verdict;
  const std::vector<const CandidateResult*> order = ranked(results);
  verdict.score = kInfinity;
  if (order.empty()) return verdict;
  verdict.best = static_cast<int>(order.front() - results.candidates.data());
  verdict.score = order.front()->score;

  const ScoreInterpolant surface(results);
  const std::vector<bool> all(results.axes.size(), true);
  Sampling sampling{surface, repeatability, {}, kInfinity, {}, {}, {}, 0, settings.solver.interpolation};
  constexpr std::size_t kStarts = 5;
  const auto try_from = [&](Eigen::VectorXd x) {
    const double score = surface.minimize(all, x);
    if (score < sampling.best_score) {
      sampling.best_score = score;
      sampling.best = x;
      return true;
    }
    return false;
  };
  for (std::size_t i = 0; i < std::min(kStarts, order.size()); ++i)
    try_from(surface.coordinates(order[i]->values));

  std::vector<std::vector<ProfilePoint>> profiles;
  for (std::size_t k = 0; k < results.axes.size(); ++k) {
    profiles.push_back(profile_along(surface, k, sampling.best, order));
    // A profile may come by a lower valley: all begin again from there.
    bool lower = false;
    for (const ProfilePoint& point : profiles.back())
      if (point.score < sampling.best_score - 1e-9) lower = try_from(point.x) || lower;
    if (!lower) continue;
    profiles.clear();
    k = static_cast<std::size_t>(-1);
  }
  sampling.best_scores = surface.scores(sampling.best);
  sampling.gradients = surface.gradients(sampling.best);
  Eigen::VectorXd gradient;
  surface.score(sampling.best, gradient, sampling.hessian);
  if (!settings.information.empty())
    sampling.few =
        cluster_variance(surface.weights().asDiagonal() * sampling.gradients, settings.information);
  verdict.keyframes = static_cast<int>(surface.weights().size());
  const auto searched = std::count_if(results.axes.begin(), results.axes.end(),
                                      [](const Axis& axis) { return axis.values.size() > 1; });
  sampling.quantile = student_quantile(verdict.keyframes - static_cast<int>(searched));

  verdict.estimate_score = sampling.best_score;
  verdict.estimate.resize(surface.parameters());
  std::vector<ProfiledParameter> profiled;
  for (std::size_t k = 0; k < results.axes.size(); ++k)
    profiled.push_back(find_interval(results, k, sampling, std::move(profiles[k]), settings));
  hold_profiles(surface, sampling.best, settings.ends, profiled);
  for (std::size_t k = 0; k < results.axes.size(); ++k) {
    verdict.parameters.push_back(conclude(results, k, sampling, std::move(profiled[k])));
    verdict.estimate[static_cast<Eigen::Index>(k)] = *verdict.parameters.back().estimate;
  }
  verdict.covariance_log = covariance_of(results, sampling);
  verdict.sigma = equivalent_sigma(results, sampling);
  verdict.sigma_source = "residual";
  if (repeatability && verdict.sigma >= *repeatability * (1 - 1e-9)) verdict.sigma_source = "repeatability";
  const std::size_t freedom = std::clamp<std::size_t>(searched, 1, kQuantile95.size());
  const double variance_share = kQuantile95[freedom - 1] / std::max(verdict.keyframes, 1);
  verdict.level95 = std::sqrt(verdict.score * verdict.score + variance_share * verdict.sigma * verdict.sigma);
  return verdict;
}

}  // namespace flash::sysid
