#include "sysid/replay/half_cell.h"

#include "data/procedural_mesh.h"
#include "data/text.h"

namespace flash::sysid {
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

std::optional<Replay> on_half_the_cell(const Replay& replay) {
  ReplaySettings settings = replay.settings;
  settings.mesh = scaled_cell(replay.recording.mesh_spec, 0.5);
  if (settings.mesh.empty() || !replay.recording.start_mesh.empty()) return std::nullopt;
  return make_replay(replay, settings);
}

}  // namespace flash::sysid
