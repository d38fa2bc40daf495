#include "apps/sysid/search_inputs.h"

#include <cmath>
#include <filesystem>
#include <string_view>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sysid/emulate/grid_file.h"

namespace flash {

void take_mesh(const sysid::Summary& search, const std::string& run, const data::Recording& recording,
               sysid::ReplaySettings& settings) {
  const sysid::SearchedMesh searched = sysid::searched_mesh(search, run, recording);
  settings.mesh = searched.mesh;
  settings.cell_scale = searched.cell_scale;
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
