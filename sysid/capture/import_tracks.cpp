#include "sysid/capture/import_tracks.h"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "data/asset/asset.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/staged_folder.h"
#include "data/files/stop.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/mesh/procedural_mesh.h"

namespace flash::sysid {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

Json bound_of(const Eigen::Vector3d& bound) {
  Json list = Json::array();
  for (const double value : bound) list.push_back(std::isfinite(value) ? Json(value) : Json(nullptr));
  return list;
}

/// The tracks, or the first of each so many times.
data::MarkerTracks thinned(const TrackImportSettings& settings) {
  data::MarkerTracks tracks = data::load_marker_tracks(settings.tracks);
  if (settings.every <= 1) return tracks;
  std::vector<data::MarkerSample> kept;
  for (std::size_t k = 0; k < tracks.samples.size(); k += static_cast<std::size_t>(settings.every))
    kept.push_back(tracks.samples[k]);
  tracks.samples = kept;
  return tracks;
}

/// What moves, and is seen to.
void check_use(const data::Recording& recording, const TrackImportSettings& settings) {
  const std::size_t held = data::select_vertices(recording, recording.supports[0].select, "supports").size();
  if (held == static_cast<std::size_t>(recording.mesh.vertices.rows()))
    throw data::InputError("--clamp-x, --clamp-y, --clamp-z: hold all " + data::format_count(held) +
                           " vertices of the object, expected some that move");
  if (recording.keyframes.size() < 2)
    throw data::InputError(
        (settings.every > 1 ? "--every: leaves one time of " : "--markers: found one time in ") +
        settings.tracks + ", expected two or more");
}

/// The user knows the options, not files that are gone.
std::string in_words_of_options(std::string what, const fs::path& folder, const std::string& mesh_file,
                                const TrackImportSettings& settings) {
  const auto replace = [&](const std::string& gone, const std::string& known) {
    for (std::size_t at = 0; (at = what.find(gone, at)) != std::string::npos; at += known.size())
      what.replace(at, gone.size(), known);
  };
  replace((folder / "tracks.csv").string(), settings.tracks);
  replace((folder / "placed.csv").string(), settings.placed);
  if (!mesh_file.empty()) replace((folder / mesh_file).string(), settings.mesh_spec);
  if (what.starts_with(folder.string())) what = "import: " + what.substr(folder.string().size() + 1);
  replace((folder / "").string(), "");
  return what;
}

}  // namespace

data::Recording import_tracks(const TrackImportSettings& settings) {
  const fs::path out(settings.out);
  const bool has_file = !data::is_made_on_the_spot(settings.mesh_spec);
  const std::string mesh_file = has_file ? fs::path(settings.mesh_spec).filename().string() : "";
  std::vector<std::string> names = {"recording.json", "tracks.csv", "placed.csv"};
  if (has_file) names.push_back(mesh_file);
  data::check_names_free(settings.out, names, settings.overwrite);
  const data::MarkerTracks tracks = thinned(settings);
  if (!settings.placed.empty()) data::load_marker_places(settings.placed);
  if (has_file && !fs::exists(settings.mesh_spec))
    throw data::InputError("--mesh: found \"" + settings.mesh_spec + "\", expected a mesh or a file");

  Json json;
  json["schema"] = "flash-recording/1";
  json["name"] =
      !settings.name.empty() ? settings.name : fs::weakly_canonical(fs::absolute(out)).filename().string();
  json["kind"] = settings.kind;
  json["gravity"] = {settings.gravity.x(), settings.gravity.y(), settings.gravity.z()};
  json["object"]["mesh"] = has_file ? mesh_file : settings.mesh_spec;
  if (!settings.asset.empty()) {
    if (!fs::exists(settings.asset))
      throw data::InputError("--asset: found \"" + settings.asset + "\", expected a file");
    data::load_asset(settings.asset);  // says what is wrong with it
    json["object"]["asset"] = fs::absolute(settings.asset).lexically_normal().string();
  }
  const Json clamp = {{"min", bound_of(settings.clamp.min)}, {"max", bound_of(settings.clamp.max)}};
  json["supports"] = {{{"name", "clamp"}, {"select", {{"box", clamp}}}}};
  json["markers"]["tracks"] = "tracks.csv";
  if (!settings.placed.empty()) json["markers"]["placed"] = "placed.csv";
  if (!settings.on_support.empty()) json["markers"]["on_support"] = settings.on_support;

  data::StagedFolder staged(settings.out);
  const fs::path folder(staged.path());
  data::save_marker_tracks(tracks, (folder / "tracks.csv").string());
  if (!settings.placed.empty())
    data::write_atomically((folder / "placed.csv").string(), data::read_file(settings.placed));
  if (has_file) data::write_atomically((folder / mesh_file).string(), data::read_file(settings.mesh_spec));
  const std::string staged_json = (folder / "recording.json").string();
  data::write_atomically(staged_json, data::format_json(json));
  try {
    check_use(data::load_recording(staged_json), settings);
  } catch (const data::InputError& error) {
    throw data::InputError(in_words_of_options(error.what(), folder, mesh_file, settings));
  }
  if (!settings.asset.empty()) {
    json["object"]["asset"] = data::relative_path(settings.asset, (out / "recording.json").string());
    data::write_atomically(staged_json, data::format_json(json));
  }
  data::end_once(settings.stop);
  staged.publish("recording.json");
  fs::remove(fs::path(settings.out) / "import.svg");  // of what stood there before
  return data::load_recording((out / "recording.json").string());
}

}  // namespace flash::sysid
