#include "sysid/report/summary_checks.h"

#include <cmath>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sysid/emulate/parameter_grid.h"
#include "sysid/infer/weight_scale.h"
#include "sysid/report/searched_mesh.h"

namespace flash::sysid {
namespace {

void check_within(const std::string& path, const std::string& field, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw data::input_error(path, field,
                            "found " + data::format_short(value) + ", expected " + data::format_short(low) +
                                " to " + data::format_short(high));
}

void check_value(const std::string& path, const std::string& field, const std::string& name, double value) {
  const Parameter* const info = find_parameter(name);
  if (info == nullptr) throw data::input_error(path, field, "found \"" + name + "\", which is no parameter");
  check_within(path, field + "." + name, value, info->low, info->high);
}

/// An error of a weight that was not measured is a factor of every stiffness, beyond what was simulated too.
bool scales_with_weight(const Summary& summary, const std::string& name) {
  return is_stiffness(name) && (summary.held.contains("areal_density") || summary.held.contains("density"));
}

/// Estimate and interval: there as the verdict says, in what was searched. `beyond`: of a weight that is not
/// known, or to values of an earlier search.
void check_answer(const std::string& path, const std::string& field, const ParameterFinding& finding,
                  bool beyond) {
  const auto rounding = [](double value) { return 1e-9 * std::abs(value); };  // of a logarithm and back
  if (finding.identifiable == Identifiable::yes && !finding.estimate)
    throw data::input_error(path, field + ".estimate",
                            "found null, expected a number, as identifiable is \"yes\"");
  if (finding.identifiable != Identifiable::no && !finding.interval95)
    throw data::input_error(
        path, field + ".interval95",
        "found null, expected two numbers, as identifiable is \"" + to_string(finding.identifiable) + "\"");
  if (!finding.interval95) return;
  const auto [low, high] = *finding.interval95;
  if (!(low <= high)) throw data::input_error(path, field + ".interval95", "expected its lower end first");
  const double first = finding.values.front(), last = finding.values.back();
  // What is open may reach beyond these values, to the ends of an earlier search.
  const Parameter* const info = find_parameter(finding.name);
  const bool open = info != nullptr && finding.identifiable != Identifiable::yes;
  const bool below = beyond || (open && finding.identifiable != Identifiable::lower_bound),
             above = beyond || (open && finding.identifiable != Identifiable::upper_bound);
  for (const double end : {low, high})
    check_within(path, field + ".interval95", end, below ? info->low : first - rounding(first),
                 above ? info->high : last + rounding(last));
  if (finding.estimate)
    check_within(path, field + ".estimate", *finding.estimate, first - rounding(first),
                 last + rounding(last));
}

void check_score(const std::string& path, const std::string& field, double score) {
  if (!(score >= 0))
    throw data::input_error(path, field,
                            "found " + data::format_short(score) + ", expected a number of 0 or above");
}

/// Only a search of which no candidate has a score is without them.
void check_best(const Summary& summary, const std::string& path) {
  if (summary.best.empty()) return;
  const auto check = [&](const std::string& field, double value) {
    if (!std::isfinite(value)) throw data::input_error(path, field, "found null, expected a number");
  };
  check("best.score", summary.best_score);
  check("best.score_on_mesh", summary.score_on_mesh);
  check("best.membrane_stiffness", summary.membrane_stiffness);
  for (const SummaryRecording& recording : summary.recordings)
    check("recordings." + recording.name + ".score", recording.score);
}

void check_agreement(const Summary& summary, const std::string& path) {
  const Agreement& agreement = *summary.agreement;
  check_within(path, "agreement.chance", agreement.chance, 0, 1);
  check_score(path, "agreement.excess", agreement.excess);
  for (const auto* const lists : {&agreement.alone, &agreement.spreads}) {
    const std::string field = lists == &agreement.alone ? "agreement.alone" : "agreement.spreads";
    if (lists->size() != summary.recordings.size())
      throw data::input_error(path, field, "expected a list for each recording");
    for (const std::vector<double>& numbers : *lists)
      if (numbers.size() != summary.parameters.size())
        throw data::input_error(path, field, "expected a number for each parameter");
  }
}

}  // namespace

void check_values(const Summary& summary, const std::string& path) {
  if (summary.agreement) check_agreement(summary, path);
  check_best(summary, path);
  if (const auto scale = summary.settings.find("cell_scale"); scale != summary.settings.end())
    cell_scale_of(scale->second, path);
  for (const auto& [name, value] : summary.best) check_value(path, "best.parameters", name, value);
  for (const auto& [name, fixed] : summary.fixed) check_value(path, "fixed", name, fixed.value);
  check_score(path, "best.score", summary.best_score);
  check_score(path, "best.score_on_mesh", summary.score_on_mesh);
  check_score(path, "best.membrane_stiffness", summary.membrane_stiffness);
  for (const ParameterFinding& finding : summary.parameters) {
    const std::string field = "parameters." + finding.name;
    if (!summary.best.empty() && !summary.best.contains(finding.name))
      throw data::input_error(path, "best.parameters." + finding.name, "missing, expected a number");
    if (finding.values.empty() || finding.values.size() != finding.scores.size())
      throw data::input_error(path, field + ".profile", "expected as many scores as values, one at least");
    const Parameter* const info = find_parameter(finding.name);
    if (info == nullptr) throw data::input_error(path, field, "is no parameter");
    if (finding.estimate) check_value(path, "parameters", finding.name, *finding.estimate);
    for (const double value : finding.values)
      check_within(path, field + ".profile.values", value, info->low, info->high);
    check_answer(path, field, finding, summary.by_points || scales_with_weight(summary, finding.name));
    for (const double score : finding.scores) check_score(path, field + ".profile.scores", score);
  }
  const auto count = static_cast<Eigen::Index>(summary.parameters.size());
  if (summary.covariance_log.size() > 0 && summary.covariance_log.rows() != count)
    throw data::input_error(path, "covariance_log", "expected a row for each of axes, or none");
  for (const NextExperiment& next : summary.next_experiments)
    for (const auto* const spreads : {&next.spread_before, &next.spread})
      for (const ParameterFinding& finding : summary.parameters) {
        const auto spread = spreads->find(finding.name);
        if (spread == spreads->end() || !(spread->second >= 0))
          throw data::input_error(path, "next_experiments." + next.name + "." + finding.name,
                                  "expected a number of 0 or above");
      }
  for (const SummaryRecording& recording : summary.recordings) {
    check_score(path, "recordings." + recording.name + ".score", recording.score);
    check_score(path, "recordings." + recording.name + ".noise_m", recording.misfit.noise);
    check_score(path, "recordings." + recording.name + ".misfit_m", recording.misfit.size);
    for (const DiscrepancyDraw& draw : recording.misfit.draws)
      for (const double number : {draw.size, draw.reach_time, draw.reach_sheet})
        check_score(path, "recordings." + recording.name + ".misfit_draws", number);
    for (const SummaryFrame& frame : recording.frames) {
      check_score(path, "recordings." + recording.name + ".frames.score", frame.score);
      check_score(path, "recordings." + recording.name + ".frames.weight", frame.weight);
    }
  }
  if (summary.candidates < 0 || summary.unconverged < 0 || summary.unconverged > summary.candidates)
    throw data::input_error(path, "unconverged", "expected 0 to the number of candidates");
  if (summary.exit_code != 0 && (summary.exit_code != 3 || summary.warnings.empty()))
    throw data::input_error(path, "exit_code", "expected 0, or 3 with the reason among warnings");
}

}  // namespace flash::sysid
