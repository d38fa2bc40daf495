#include "sysid/report/compare.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sysid/report/residuals_file.h"
#include "sysid/report/search_folder.h"

namespace flash::sysid {
namespace {

std::string setting(const Summary& search, const std::string& name) {
  const auto found = search.settings.find(name);
  return found == search.settings.end() ? "none" : found->second;
}

/// Its settings, and what it held: "0.3, measured".
std::map<std::string, std::string> described(const Summary& search) {
  std::map<std::string, std::string> texts = search.settings;
  for (const auto& [name, fixed] : search.fixed)
    texts[name] = data::format_short(fixed.value) + ", " + fixed.source;
  return texts;
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
  for (const char* each : {"distance", "observed", "sigmas", "repeatability_m"})
    if (setting(first.summary, each) != setting(other.summary, each))
      throw data::input_error(other.name, "settings." + std::string(each),
                              "found \"" + setting(other.summary, each) + "\", expected \"" +
                                  setting(first.summary, each) + "\" as in " + first.name);
  for (std::size_t r = 0; r < first.residuals.size(); ++r)
    if (!same_rows(first.residuals[r], other.residuals[r]))
      throw data::input_error(other.name, first.summary.recordings[r].name,
                              "found " + observed_in(other.residuals[r]) + ", expected " +
                                  observed_in(first.residuals[r]) + " as in " + first.name +
                                  ": search all with --no-horizon, or with one --from and --until");
}

/// Of each search what is not alike in all; "-" where there is none.
std::vector<std::map<std::string, std::string>> differences(const std::vector<FinishedSearch>& searches) {
  std::vector<std::map<std::string, std::string>> texts;
  std::map<std::string, std::set<std::string>> seen;
  for (const FinishedSearch& search : searches) texts.push_back(described(search.summary));
  for (const auto& each : texts)
    for (const auto& [name, text] : each) seen[name];
  for (auto& [name, values] : seen)
    for (auto& each : texts) values.insert(each.emplace(name, "-").first->second);
  for (auto& each : texts)
    std::erase_if(each, [&](const auto& setting) { return seen[setting.first].size() == 1; });
  return texts;
}

/// A search with its recordings in the order of another. Throws data::InputError where they are others.
FinishedSearch in_order_of(const FinishedSearch& first, const FinishedSearch& search) {
  FinishedSearch ordered{search.name, search.summary, {}};
  ordered.summary.recordings.clear();
  for (const SummaryRecording& wanted : first.summary.recordings)
    for (std::size_t r = 0; r < search.summary.recordings.size(); ++r)
      if (search.summary.recordings[r].sha256 == wanted.sha256) {
        ordered.summary.recordings.push_back(search.summary.recordings[r]);
        ordered.residuals.push_back(search.residuals[r]);
      }
  const std::size_t count = first.summary.recordings.size();
  if (search.summary.recordings.size() != count || ordered.residuals.size() != count)
    throw data::InputError(search.name + ": found other recordings than in " + first.name +
                           ", expected searches of the same");
  return ordered;
}

}  // namespace

FinishedSearch load_finished_search(const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / "summary.json").string();
  FinishedSearch search{folder, load_search_folder(folder).summary, {}};
  if (search.summary.residuals_digest.empty())
    throw data::input_error(path, "residuals_digest",
                            "found none, expected a search by this version that came to an estimate; grid "
                            "--resume writes it anew");
  for (const SummaryRecording& recording : search.summary.recordings)
    if (!(recording.spread > 0) || !(recording.error_cost >= 0) || !std::isfinite(recording.error_cost))
      throw data::input_error(path, recording.name,
                              "found a spread_m of " + data::format_short(recording.spread) +
                                  " and an error_cost of " + data::format_short(recording.error_cost) +
                                  ", expected above 0, and 0 or above");
  for (const double each : search.summary.open_information)
    if (!(each >= 0) || !std::isfinite(each))
      throw data::input_error(path, "open_information", "found a number below 0, or none");
  std::vector<double> costs;
  for (const SummaryRecording& recording : search.summary.recordings) costs.push_back(recording.error_cost);
  search.residuals = load_residuals((std::filesystem::path(folder) / "residuals.csv").string(),
                                    search.summary.residuals_digest, costs);
  return search;
}

std::vector<ComparedSearch> compare(const std::vector<FinishedSearch>& found) {
  std::vector<FinishedSearch> searches;
  for (const FinishedSearch& search : found) {
    searches.push_back(in_order_of(found.front(), search));
    check_comparable(searches.front(), searches.back());
  }
  const auto reference = std::min_element(searches.begin(), searches.end(), [](const auto& a, const auto& b) {
    return a.summary.best_score < b.summary.best_score;
  });
  const std::optional<double> repeatability =
      data::parse_number(setting(reference->summary, "repeatability_m"));
  // One for all searches: a model that misses more is not freer for that.
  double precision = 0;  // mean of the recordings'
  for (const SummaryRecording& recording : reference->summary.recordings)
    precision += std::pow(recording.spread, -2) / static_cast<double>(reference->summary.recordings.size());
  const double spread = 1 / std::sqrt(precision);
  std::vector<std::map<std::string, std::string>> differs = differences(searches);
  std::vector<ComparedSearch> compared;
  double most = -INFINITY, sum = 0;
  for (std::size_t i = 0; i < searches.size(); ++i) {
    ComparedSearch& each = compared.emplace_back();
    if (&searches[i] != &*reference)
      each.excess = excess_deviance(reference->residuals, searches[i].residuals, repeatability);
    const std::vector<double>& open = searches[i].summary.open_information;
    each.occupied = log_occupied(
        Eigen::Map<const Eigen::VectorXd>(open.data(), static_cast<Eigen::Index>(open.size())), spread);
    each.probability = each.occupied - 0.5 * each.excess;
    most = std::max(most, each.probability);
    each.differs = std::move(differs[i]);
  }
  for (ComparedSearch& each : compared) sum += each.probability = std::exp(each.probability - most);
  for (ComparedSearch& each : compared) each.probability /= sum;
  return compared;
}

}  // namespace flash::sysid
