#include "sysid/report/next_steps.h"

#include <map>

#include "sysid/emulate/parameter_grid.h"
#include "sysid/report/parameter_label.h"

namespace flash::sysid {
namespace {

// Which experiment determines which parameter; the second would do as well.
const std::map<std::string, std::string>& telling_experiments() {
  static const std::map<std::string, std::string> experiments = {
      {"young",
       "Record a bar pull of 5 to 15 % with contour or gripper force: it determines the membrane stiffness."},
      {"poisson",
       "Record a bias pull of about 15 % with contour: it determines Poisson's ratio. Until then, the "
       "asset keeps its value."},
      {"bending", "Record a corner lift or a hang of a larger piece: both determine the bending rigidity."},
      {"friction",
       "Drag the sheet over the table, or tilt the table until it slides. A light sheet may need a lift: "
       "flash-sysid plan ranks the experiments for yours."},
      {"areal_density",
       "Weigh the sheet and pass --hold areal_density=...:measured: motion determines stiffness over weight "
       "only."},
      {"air_drag", "Record a hanging sheet that swings to rest: it determines air drag."},
      {"stiffness_damping", "Record a hanging sheet that swings to rest: it determines damping."}};
  return experiments;
}

bool is_fixed_as(const Summary& summary, const std::string& name, const std::string& source) {
  const auto found = summary.fixed.find(name);
  return found != summary.fixed.end() && found->second.source == source;
}

std::string label(const Summary& summary, const std::string& name) {
  return parameter_label(name, summary.settings.count("thickness_m") > 0).label;
}

}  // namespace

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
  for (const ParameterFinding& finding : summary.parameters) {
    const auto experiment = telling_experiments().find(finding.name);
    const bool widen_first = finding.edge != RangeEdge::none && finding.identifiable != Identifiable::no;
    if (finding.identifiable != Identifiable::yes && !widen_first &&
        experiment != telling_experiments().end())
      steps.push_back(experiment->second);
  }
  if (summary.unconverged > 0 && 10 * summary.unconverged > summary.candidates)
    steps.push_back("Allow more solver iterations: more than one candidate in ten did not converge.");
  if (usable && summary.exit_code == 0)
    steps.push_back("Export the tuned asset with its intervals: flash-sysid export RUN -o tuned.json");
  return steps;
}

std::vector<std::string> standing_unknowns(const Summary& summary) {
  std::vector<std::string> unknowns;
  bool searched_density = false;
  for (const ParameterFinding& finding : summary.parameters)
    searched_density = searched_density || finding.name == "areal_density";
  if (!searched_density && !is_fixed_as(summary, "areal_density", "measured"))
    unknowns.push_back(
        "The weight: the areal density is taken from the asset, and every stiffness scales with it. Weigh "
        "the sheet.");
  std::string assumed;
  for (const auto& [name, fixed] : summary.fixed)
    if (fixed.source == "assumed" && name != "areal_density")
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
  return unknowns;
}

}  // namespace flash::sysid
