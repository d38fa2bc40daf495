#include "sysid/report/search_folder.h"

#include <algorithm>
#include <filesystem>

#include "data/error.h"
#include "data/text.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;

void check_one_search(const std::string& folder, const SearchFolder& search) {
  const auto& [summary, results] = search;
  const auto path_of = [&](const char* file) { return (fs::path(folder) / file).string(); };
  const auto candidates = static_cast<std::size_t>(summary.candidates);
  if (results.candidates.size() != candidates)
    throw data::input_error(path_of("results.csv"), "rows",
                            "found " + data::format_count(results.candidates.size()) + ", expected the " +
                                data::format_count(candidates) + " candidates of summary.json");
  const auto unconverged =
      std::count_if(results.candidates.begin(), results.candidates.end(),
                    [](const CandidateResult& c) { return c.status != CandidateStatus::ok; });
  if (unconverged != summary.unconverged)
    throw data::input_error(path_of("summary.json"), "unconverged",
                            "found " + std::to_string(summary.unconverged) + ", expected the " +
                                std::to_string(unconverged) + " of results.csv");
  for (const ParameterFinding& finding : summary.parameters)
    if (std::none_of(results.axes.begin(), results.axes.end(),
                     [&](const Axis& axis) { return axis.name == finding.name; }))
      throw data::input_error(path_of("summary.json"), "axes",
                              "found \"" + finding.name + "\", which grid.json does not search");
  std::vector<std::string> names;
  for (const SummaryRecording& recording : summary.recordings) names.push_back(recording.name);
  if (!names.empty() && names != results.recordings)  // a search that found no candidate names none
    throw data::input_error(path_of("summary.json"), "recordings", "expected those of grid.json");
}

}  // namespace

SearchFolder load_search_folder(const std::string& folder) {
  SearchFolder search{load_summary((fs::path(folder) / "summary.json").string()), load_grid_results(folder)};
  check_one_search(folder, search);
  return search;
}

}  // namespace flash::sysid
