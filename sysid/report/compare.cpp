#include "sysid/report/compare.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "data/error.h"
#include "data/text.h"
#include "sysid/report/residuals_file.h"
#include "sysid/report/search_folder.h"

namespace flash::sysid {
namespace {

std::string setting(const Summary& search, const std::string& name) {
  const auto found = search.settings.find(name);
  return found == search.settings.end() ? "none" : found->second;
}

/// "1500 observations from 1.0 to 2.4 s".
std::string observed_in(const LeftResiduals& recording) {
  return std::to_string(recording.left.size()) + " observations from " +
         data::format_short(recording.rows.times.front()) + " to " +
         data::format_short(recording.rows.times.back()) + " s";
}

bool same_rows(const LeftResiduals& a, const LeftResiduals& b) {
  return a.left.size() == b.left.size() && a.rows.keyframe == b.rows.keyframe &&
         a.rows.channel == b.rows.channel && a.rows.times == b.rows.times;
}

void check_comparable(const FinishedSearch& first, const FinishedSearch& other) {
  const std::vector<SummaryRecording>&ours = first.summary.recordings, &theirs = other.summary.recordings;
  if (!std::equal(ours.begin(), ours.end(), theirs.begin(), theirs.end(),
                  [](const SummaryRecording& a, const SummaryRecording& b) { return a.sha256 == b.sha256; }))
    throw data::InputError(other.name + ": found other recordings than in " + first.name +
                           ", expected the same in the same order");
  for (const char* each : {"distance", "observed", "sigmas", "repeatability_m"})
    if (setting(first.summary, each) != setting(other.summary, each))
      throw data::input_error(other.name, "settings." + std::string(each),
                              "found \"" + setting(other.summary, each) + "\", expected \"" +
                                  setting(first.summary, each) + "\" as in " + first.name);
  for (std::size_t r = 0; r < ours.size(); ++r)
    if (!same_rows(first.residuals[r], other.residuals[r]))
      throw data::input_error(other.name, ours[r].name,
                              "found " + observed_in(other.residuals[r]) + ", expected " +
                                  observed_in(first.residuals[r]) + " as in " + first.name +
                                  ": search all with --no-horizon, or with one --from and --to");
}

/// The posterior's draws in the coordinates of its parameters, and the width of each range.
double occupied_by(const Summary& search) {
  Eigen::MatrixXd draws = search.samples;
  Eigen::VectorXd widths(draws.cols());
  for (Eigen::Index k = 0; k < draws.cols(); ++k) {
    const ParameterFinding& finding = search.parameters[static_cast<std::size_t>(k)];
    const bool logarithmic = finding.values.front() > 0 && finding.logarithmic;
    if (logarithmic) draws.col(k) = draws.col(k).array().log();
    widths[k] = logarithmic ? std::log(finding.values.back() / finding.values.front())
                            : finding.values.back() - finding.values.front();
  }
  return log_occupied(draws, widths);
}

std::set<std::string> settings_that_differ(const std::vector<FinishedSearch>& searches) {
  std::set<std::string> differing;
  for (const FinishedSearch& search : searches)
    for (const auto& [key, text] : search.summary.settings)
      for (const FinishedSearch& other : searches)
        if (setting(other.summary, key) != text) differing.insert(key);
  return differing;
}

}  // namespace

FinishedSearch load_finished_search(const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / "summary.json").string();
  FinishedSearch search{folder, load_search_folder(folder).summary, {}};
  if (search.summary.residuals_digest.empty())
    throw data::input_error(path, "residuals_digest",
                            "found none, expected a search by this version that came to an estimate; grid "
                            "--resume writes it anew");
  std::vector<double> costs;
  for (const SummaryRecording& recording : search.summary.recordings) costs.push_back(recording.error_cost);
  search.residuals = load_residuals((std::filesystem::path(folder) / "residuals.csv").string(),
                                    search.summary.residuals_digest, costs);
  return search;
}

std::vector<ComparedSearch> compare(const std::vector<FinishedSearch>& searches) {
  for (const FinishedSearch& search : searches) check_comparable(searches.front(), search);
  const auto reference = std::min_element(searches.begin(), searches.end(), [](const auto& a, const auto& b) {
    return a.summary.best_score < b.summary.best_score;
  });
  const std::optional<double> repeatability =
      data::parse_number(setting(reference->summary, "repeatability_m"));
  const std::set<std::string> differing = settings_that_differ(searches);
  std::vector<ComparedSearch> compared;
  double most = -INFINITY, sum = 0;
  for (const FinishedSearch& search : searches) {
    ComparedSearch& each = compared.emplace_back();
    if (&search != &*reference)
      each.excess = excess_deviance(reference->residuals, search.residuals, repeatability);
    each.occupied = occupied_by(search.summary);
    each.probability = each.occupied - 0.5 * each.excess;
    most = std::max(most, each.probability);
    for (const std::string& key : differing) each.differs[key] = setting(search.summary, key);
  }
  for (ComparedSearch& each : compared) sum += each.probability = std::exp(each.probability - most);
  for (ComparedSearch& each : compared) each.probability /= sum;
  return compared;
}

}  // namespace flash::sysid
