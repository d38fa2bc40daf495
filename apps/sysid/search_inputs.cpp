#include "apps/sysid/search_inputs.h"

#include <cmath>
#include <filesystem>
#include <string_view>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sysid/emulate/grid_file.h"

namespace flash {

void check_size(const sysid::Replay& replay, const data::Recording& recording, const std::string& run) {
  const auto extent = [](const data::Points& vertices) {
    return (vertices.colwise().maxCoeff() - vertices.colwise().minCoeff()).norm();
  };
  const double searched = extent(replay.recording.mesh.vertices), here = extent(recording.mesh.vertices);
  if (std::abs(searched - here) > 0.02 * here)
    throw data::input_error(recording.source, "object.mesh",
                            "found an object " + data::format_short(here) + " m across, that of " + run +
                                " is " + data::format_short(searched) +
                                " m: give --mesh where both are of the same material");
}

std::vector<std::string> unlike_the_asset_of(const std::string& run, const sysid::Fingerprint& print) {
  constexpr std::string_view kAsset = "asset ";
  const sysid::GridFile search = sysid::load_grid_file((std::filesystem::path(run) / "grid.json").string());
  std::vector<std::string> lines;
  if (!search.fingerprint) return lines;
  for (const auto& [name, value] : *search.fingerprint) {
    const auto here = print.find(name);
    if (!name.starts_with(kAsset) || here == print.end() || here->second == value) continue;
    lines.push_back(name.substr(kAsset.size()) + ": found " + here->second + ", the search had " + value);
  }
  return lines;
}

}  // namespace flash
