#include "sysid/replay/replay_mesh.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "data/files/text.h"
#include "data/mesh/procedural_mesh.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/replay/recorded_mesh.h"

namespace flash::sysid {
namespace {

int halvings(double cell_scale) {
  return cell_scale < 1 ? std::max(1, static_cast<int>(std::lround(-std::log2(cell_scale)))) : 0;
}

void halve_all_cells(int times, data::Recording& recording) {
  for (int time = 0; time < times; ++time) {
    halve_cells(recording);
    for (data::RecordedGrasp& grasp : recording.grasps) grasp.cell *= 0.5;
  }
}

}  // namespace

std::string scaled_cell(const std::string& specification, double factor) {
  if (!data::is_made_on_the_spot(specification)) return "";
  const std::vector<std::string_view> words = data::split(specification, ":");
  const auto cell = words.size() >= 3 ? data::parse_number(words[2]) : std::nullopt;
  if (!cell || (words[0] != "sheet" && words[0] != "box")) return "";
  std::string scaled =
      std::string(words[0]) + ":" + std::string(words[1]) + ":" + data::format_number(factor * *cell);
  for (std::size_t k = 3; k < words.size(); ++k) scaled += ":" + std::string(words[k]);
  return scaled;
}

bool takes_any_cell(const data::Recording& recording) {
  return recording.start_mesh.empty() && !scaled_cell(recording.mesh_spec, 1).empty();
}

void mesh_as_set(const ReplaySettings& settings, data::Recording& recording) {
  if (!settings.mesh.empty()) replace_mesh(settings.mesh, recording);
  if (takes_any_cell(recording)) {
    if (settings.cell_scale < 1)
      replace_mesh(scaled_cell(recording.mesh_spec, settings.cell_scale), recording);
    grade_towards_grasps(settings, recording);
    return;
  }
  ReplaySettings as_named = settings;
  as_named.cell_scale = 1;
  grade_towards_grasps(as_named, recording);
  if (!recording.is_solid()) halve_all_cells(halvings(settings.cell_scale), recording);
}

void mesh_anew(const Replay& replay, const ReplaySettings& settings, data::Recording& recording) {
  if (settings.mesh == replay.settings.mesh && settings.cell_scale == replay.settings.cell_scale) return;
  if (!recording.start_mesh.empty() && settings.mesh == replay.settings.mesh) {
    halve_all_cells(halvings(settings.cell_scale) - halvings(replay.settings.cell_scale), recording);
    return;
  }
  ReplaySettings from = settings;
  if (from.mesh.empty()) from.mesh = replay.object_mesh;
  mesh_as_set(from, recording);
}

}  // namespace flash::sysid
