#include "sysid/report/fit_start.h"

#include <algorithm>

#include "data/files/error.h"

namespace flash::sysid {
namespace {

// "friction=0.3", or a name alone: where the search found the parameter, or held it.
Hold hold_of(const std::string& text, const Summary& found) {
  if (text.find('=') != std::string::npos) return parse_hold(text);
  check_parameter("--hold " + text, text);
  const auto value = found.best.find(text);
  if (value == found.best.end())
    throw data::InputError("--hold " + text + ": the search neither found nor held it, expected " + text +
                           "=value");
  const auto fixed = found.fixed.find(text);
  if (fixed == found.fixed.end()) return {{text, {value->second}, false}};
  return {{text, {value->second}, false}, fixed->second.source == "measured", fixed->second.deviation};
}

}  // namespace

FitStart fit_start(const SearchFolder& search, const std::vector<std::string>& held) {
  const Summary& found = search.summary;
  std::vector<Hold> holds;
  const auto is_held = [&](const std::string& name) {
    return std::any_of(holds.begin(), holds.end(), [&](const Hold& hold) { return hold.axis.name == name; });
  };
  for (const std::string& text : held) {
    Hold hold = hold_of(text, found);
    if (is_held(hold.axis.name))
      throw data::InputError("--hold " + hold.axis.name + ": given twice, expected one value");
    holds.push_back(std::move(hold));
  }
  for (const auto& [name, fixed] : found.fixed)
    if (!is_held(name) && (fixed.source == "measured" || fixed.deviation))
      holds.push_back({{name, {fixed.value}, false}, fixed.source == "measured", fixed.deviation});
  FitStart start;
  for (const Axis& axis : search.results.axes) {
    if (is_held(axis.name)) continue;
    if (axis.values.size() == 1) {
      holds.push_back({axis, false});
      continue;
    }
    const auto finding = std::find_if(found.parameters.begin(), found.parameters.end(),
                                      [&](const ParameterFinding& each) { return each.name == axis.name; });
    start.grid.axes.push_back(axis);
    start.values.push_back(finding->estimate.value_or(found.best.at(axis.name)));
    start.around.push_back(
        finding->interval95.value_or(std::array{finding->values.front(), finding->values.back()}));
  }
  if (start.grid.axes.empty()) throw data::InputError("--hold: no parameter is left to fit");
  add_holds(holds, start.grid);
  for (std::size_t k = start.values.size(); k < start.grid.axes.size(); ++k) {
    const double value = start.grid.axes[k].values.front();
    start.values.push_back(value);
    start.around.push_back({value, value});
  }
  return start;
}

}  // namespace flash::sysid
