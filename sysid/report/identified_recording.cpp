#include "sysid/report/identified_recording.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "data/files/text.h"

namespace flash::sysid {
namespace {

std::optional<double> number_of(const nlohmann::json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

/// Also of a number, as people write by hand.
std::optional<std::string> text_of(const nlohmann::json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || found->is_null()) return std::nullopt;
  return found->is_string() ? found->get<std::string>() : found->dump();
}

}  // namespace

std::optional<IdentifiedRecording> identified_recording(const data::Asset& asset, const std::string& sha256) {
  const nlohmann::json identification = nlohmann::json::parse(asset.identification, nullptr, false);
  if (!identification.is_object()) return std::nullopt;
  const auto of = [&](const char* name) { return identification.value(name, nlohmann::json()); };
  const nlohmann::json recordings = of("recordings"), verdicts = of("identifiable");
  for (const nlohmann::json& recording : recordings) {
    if (!recording.is_object() || recording.value("sha256", nlohmann::json()) != sha256) continue;
    IdentifiedRecording found{number_of(recording, "horizon_s"), number_of(recording, "score_m"),
                              number_of(recording, "grasp_size_m")};
    found.mesh.mesh = text_of(recording, "mesh").value_or("");
    found.mesh.digest = text_of(recording, "mesh_sha256").value_or("");
    if (const nlohmann::json solver = of("solver"); solver.is_object())
      found.mesh.cell_scale = cell_scale_of(text_of(solver, "cell_scale"), asset.source);
    if (recordings.size() == 1) {  // earlier programs kept what all have in common
      if (!found.horizon_s) found.horizon_s = number_of(identification, "horizon_s");
      if (!found.score) found.score = number_of(identification, "score_m");
    }
    if (verdicts.is_object())
      for (const auto& [name, verdict] : verdicts.items())
        if (verdict == "no") found.not_told.push_back(name);
    return found;
  }
  return std::nullopt;
}

std::string unlike_its_score(const IdentifiedRecording& recording, double score) {
  constexpr double kRounding = 1e-4;  // of a score: a last digit of the material, as solved steps pass it on
  if (!recording.score || std::abs(score - *recording.score) <= kRounding * *recording.score) return "";
  const auto mm = [](double distance) { return data::format_short(1e3 * distance) + " mm"; };
  std::string names;
  for (const std::string& name : recording.not_told) names += (names.empty() ? "" : ", ") + name;
  return "the score is " + mm(score) + ", and that of the search behind the asset was " +
         mm(*recording.score) +
         (names.empty() ? ": a setting or the version of the program differs"
                        : ": the asset has its own " + names + ", which the recordings did not tell");
}

}  // namespace flash::sysid
