#include "sysid/report/next_steps.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "data/files/text.h"
#include "sysid/emulate/parameter_grid.h"
#include "sysid/report/parameter_label.h"

namespace flash::sysid {
namespace {

bool is_fixed_as(const Summary& summary, const std::string& name, const std::string& source) {
  const auto found = summary.fixed.find(name);
  return found != summary.fixed.end() && found->second.source == source;
}

std::string label(const Summary& summary, const std::string& name) {
  return parameter_label(name, young_is_in_pascal(summary)).label;
}

/// "a bar pull"; "\"lift\" once more".
std::string called(const std::string& experiment) {
  const std::string again = " again";
  if (experiment.ends_with(again))
    return '"' + experiment.substr(0, experiment.size() - again.size()) + "\" once more";
  std::string words = experiment;
  std::replace(words.begin(), words.end(), '_', ' ');
  return "a " + words;
}

/// "bending rigidity from a factor of 1.8 to 1.2", or "from +- 0.1 to +- 0.05", at 95 %.
std::string narrowing(const Summary& summary, const ParameterFinding& finding, const NextExperiment& next) {
  const auto half = [&](double spread) {
    constexpr double kTwoSided = 1.959964;
    return finding.logarithmic ? data::format_short(std::exp(kTwoSided * spread))
                               : "+- " + data::format_short(kTwoSided * spread);
  };
  return label(summary, finding.name) + (finding.logarithmic ? " from a factor of " : " from ") +
         half(next.spread_before.at(finding.name)) + " to " + half(next.spread.at(finding.name));
}

bool is_told(const ParameterFinding& finding) { return finding.identifiable == Identifiable::yes; }

/// The experiment that adds most, and for what it hardly narrows the one that narrows that most.
void add_experiments(const Summary& summary, std::vector<std::string>& steps) {
  constexpr double kNarrows = 0.9;  // of a spread
  const auto ratio = [](const NextExperiment& next, const std::string& name) {
    return next.spread.at(name) / next.spread_before.at(name);
  };
  const NextExperiment& first = summary.next_experiments.front();
  std::vector<std::pair<const NextExperiment*, std::string>> proposed = {{&first, ""}};
  std::string hopeless;
  for (const ParameterFinding& finding : summary.parameters) {
    const NextExperiment* best = &first;
    if (ratio(first, finding.name) > kNarrows) {
      if (is_told(finding)) continue;
      for (const NextExperiment& next : summary.next_experiments)
        if (ratio(next, finding.name) < ratio(*best, finding.name)) best = &next;
      if (ratio(*best, finding.name) > kNarrows) {
        hopeless += (hopeless.empty() ? "" : ", ") + label(summary, finding.name);
        continue;
      }
    }
    auto at =
        std::find_if(proposed.begin(), proposed.end(), [&](const auto& each) { return each.first == best; });
    if (at == proposed.end()) at = proposed.insert(at, {best, ""});
    at->second += (at->second.empty() ? "" : ", ") + narrowing(summary, finding, *best);
  }
  for (const auto& [next, gains] : proposed) {
    char bits[32];
    std::snprintf(bits, sizeof bits, "%.1f", next->bits);
    if (!gains.empty())
      steps.push_back("Record " + called(next->name) + ": it is expected to narrow " + gains + " (95 %; " +
                      bits + " bits in all).");
  }
  if (!hopeless.empty())
    steps.push_back("No experiment that was tried would narrow " + hopeless +
                    " by a tenth: hold it at a value that is known, or record something else.");
}

/// What warnings ask for, before an answer counts that they doubt.
void add_warned(const Summary& summary, std::vector<std::string>& steps) {
  const auto is_said = [&](const std::string& warning) {
    // These say of what the answer is, and ask for nothing.
    if (warning.starts_with("the answer is simulated on cells of ") || warning.ends_with(", allows for that"))
      return true;
    for (const SummaryRecording& recording : summary.recordings)
      if (warning.starts_with(recording.name + ": the model does not fit")) return true;
    for (const ParameterFinding& finding : summary.parameters)
      if (warning.starts_with(finding.name + ": the best value is")) return true;
    return false;
  };
  for (const SummaryRecording& recording : summary.recordings)
    if (!model_fits(recording))
      steps.push_back(
          "Find what the model of " + recording.name +
          " misses: look at the estimate over what was seen, first at the grasp "
          "(--grasp-shape, --grasp-size), then the start's yaw and the table, then the material.");
  for (const std::string& warning : summary.warnings)
    if (!is_said(warning)) steps.push_back("See to what the search warns of: " + warning + ".");
}

/// What is left to do where the search itself proposes nothing: to look at what was seen, and at why.
void add_looks(const Summary& summary, std::vector<std::string>& steps) {
  const std::string why =
      summary.warnings.empty() ? "" : " The search says: " + summary.warnings.front() + ".";
  if (summary.best.empty())
    steps.push_back(
        "Replay one set of values, as flash-sysid replay RECORDING --asset ASSET -o overlay, with a "
        "shorter --time-step or values nearer to the asset's, until it runs and has a score." +
        why);
  else
    steps.push_back(
        "Look at the estimate over what was seen, above and in best/: where they part from the "
        "start, mesh, grasp, table, clocks or frames are wrong; where they never part, record a "
        "motion that tells more (flash-sysid plan RECORDING --run RUN -o plan.json)." +
        why);
}

}  // namespace

std::vector<std::string> caveats(const Summary& summary) {
  std::vector<std::string> lines;
  if (summary.by_points)
    lines.emplace_back(
        "intervals reach to the values searched next to the likely ones: the motion changes too abruptly "
        "between them");
  std::string missed;
  for (const SummaryRecording& recording : summary.recordings)
    if (!model_fits(recording)) missed += (missed.empty() ? "" : ", ") + recording.name;
  if (!missed.empty()) lines.push_back("intervals are those of a model that does not fit " + missed);
  return lines;
}

std::vector<std::string> next_steps(const Summary& summary) {
  std::vector<std::string> steps;
  bool usable = false;
  for (const ParameterFinding& finding : summary.parameters) {
    usable = usable || finding.identifiable != Identifiable::no;
    if (finding.edge != RangeEdge::none && finding.identifiable != Identifiable::no)
      steps.push_back("Widen the range of " + label(summary, finding.name) + " (" + option_of(finding.name) +
                      "): the best value is its " +
                      (finding.edge == RangeEdge::low ? "lowest." : "highest."));
  }
  if (!summary.next_experiments.empty()) add_experiments(summary, steps);
  if (summary.unconverged > 0 && 10 * summary.unconverged > summary.candidates)
    steps.push_back("Allow more solver iterations: more than one candidate in ten did not converge.");
  if (summary.by_points)
    for (const ParameterFinding& finding : summary.parameters)
      if (finding.interval95)
        steps.push_back("Search more values of " + label(summary, finding.name) + ": " +
                        option_of(finding.name) + " " + data::format_short((*finding.interval95)[0]) + ":" +
                        data::format_short((*finding.interval95)[1]) + ":9" +
                        (finding.logarithmic ? ":log." : "."));
  if (usable && summary.exit_code == 0) {
    add_warned(summary, steps);
    std::string but;
    for (const std::string& caveat : caveats(summary)) but += (but.empty() ? " (" : "; ") + caveat;
    steps.push_back("Export the tuned asset with its intervals: flash-sysid export RUN -o tuned.json" + but +
                    (but.empty() ? "" : ")"));
  }
  if (steps.empty()) add_looks(summary, steps);
  return steps;
}

std::vector<std::string> standing_unknowns(const Summary& summary) {
  std::vector<std::string> unknowns;
  const bool solid = summary.best.count("density") > 0;
  const std::string density = solid ? "density" : "areal_density";
  bool searched_density = false;
  for (const ParameterFinding& finding : summary.parameters)
    searched_density = searched_density || finding.name == density;
  if (!searched_density && !is_fixed_as(summary, density, "measured"))
    unknowns.push_back(
        std::string("The weight: the ") + (solid ? "density" : "areal density") +
        " is taken from the asset and counts as known to 10 %. Every stiffness scales with it. "
        "Weigh the " +
        (solid ? "object" : "sheet") + ": --hold " + density + "=VALUE:measured");
  std::string assumed;
  for (const auto& [name, fixed] : summary.fixed)
    if (fixed.source == "assumed" && name != density)
      assumed += (assumed.empty() ? "" : ", ") + label(summary, name);
  if (!assumed.empty()) unknowns.push_back("Assumed, not measured: " + assumed + ".");
  const auto left_out = [&](const char* setting) {
    const auto found = summary.settings.find(setting);
    return found != summary.settings.end() && found->second == "no";
  };
  if (left_out("solver_check"))
    unknowns.push_back("How far the solver itself moves the answer: no finer solution was asked for.");
  if (left_out("horizon"))
    unknowns.push_back("Until when the motion can be predicted: it was not asked for.");
  if (summary.by_points)
    unknowns.emplace_back(
        "Where the parameters are within their intervals: the motion changes too abruptly between the values "
        "searched.");
  for (const SummaryRecording& recording : summary.recordings)
    if (!model_fits(recording))
      unknowns.push_back("What else moves the cloth: the model does not fit " + recording.name + ".");
  return unknowns;
}

}  // namespace flash::sysid
