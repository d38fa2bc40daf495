#include "sysid/report/searched_mesh.h"

#include <cmath>
#include <filesystem>
#include <vector>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/sha256.h"
#include "data/files/text.h"
#include "data/mesh/procedural_mesh.h"
#include "data/recording/recording_digest.h"

namespace flash::sysid {
namespace {

std::optional<std::string> setting(const Summary& summary, const char* name) {
  const auto found = summary.settings.find(name);
  return found == summary.settings.end() ? std::nullopt : std::optional(found->second);
}

/// Of a mesh, or of the recording's own where `mesh` is empty [m].
double extent_of(const std::string& mesh, const std::string& path, const data::Recording& recording) {
  data::Recording on = recording;
  if (!mesh.empty()) data::load_object_mesh(mesh, path, "recordings.mesh", on);
  return (on.mesh.vertices.colwise().maxCoeff() - on.mesh.vertices.colwise().minCoeff()).norm();
}

/// "sheet:0.2x0.2:0.02" of "sheet:0.2x0.2:0.02 (121 vertices)".
std::string without_count(const std::string& text) { return text.substr(0, text.rfind(" (")); }

/// Of each recording; of an earlier program that of the first.
std::vector<std::string> meshes_of(const Summary& summary, const std::string& path) {
  std::vector<std::string> meshes;
  const std::string first = without_count(setting(summary, "mesh").value_or(""));
  for (const SummaryRecording& recording : summary.recordings) {
    meshes.push_back(recording.mesh.empty() ? first : recording.mesh);
    if (meshes.back().empty())
      throw data::input_error(path, "recordings." + recording.name + ".mesh",
                              "missing, expected the mesh that was searched");
  }
  return meshes;
}

}  // namespace

std::string named_mesh(const Replay& replay) {
  return named_mesh(replay.settings.mesh.empty() ? replay.object_mesh : replay.settings.mesh);
}

std::string named_mesh(const std::string& mesh) {
  return data::is_made_on_the_spot(mesh) ? mesh : std::filesystem::absolute(mesh).lexically_normal().string();
}

std::string mesh_digest(const std::string& mesh) {
  return mesh.empty() || data::is_made_on_the_spot(mesh) ? "" : data::sha256(data::read_file(mesh));
}

void expect_as_searched(const SearchedMesh& mesh, const std::string& source, const std::string& field) {
  if (mesh.mesh.empty()) return;
  if (!data::is_made_on_the_spot(mesh.mesh) && !std::filesystem::exists(mesh.mesh))
    throw data::input_error(source, field,
                            mesh.mesh +
                                " is missing, expected the mesh that was searched: put it back, or "
                                "repeat the search with --resume and --mesh where it lies elsewhere");
  data::Recording on;
  data::load_object_mesh(mesh.mesh, source, field, on);
  if (!mesh.digest.empty() && mesh_digest(mesh.mesh) != mesh.digest)
    throw data::input_error(source, field,
                            mesh.mesh + " has changed since the search: put it back, or search again");
}

double cell_scale_of(const std::optional<std::string>& text, const std::string& source) {
  if (!text) return 1;
  constexpr double kLeast = 1.0 / 16;  // answers take half; each further half has four times the vertices
  const std::optional<double> scale = data::parse_number(*text);
  if (!scale || !(*scale >= kLeast && *scale <= 1))
    throw data::input_error(source, "cell_scale",
                            "found \"" + *text + "\", expected a number from 0.0625 to 1");
  return *scale;
}

SearchedMesh searched_mesh(const Summary& summary, const std::string& run, const data::Recording& recording) {
  constexpr double kSame = 0.02;  // of the extent
  const std::string path = (std::filesystem::path(run) / "summary.json").string();
  const double scale = cell_scale_of(setting(summary, "cell_scale"), path);
  const std::vector<std::string> meshes = meshes_of(summary, path);
  const std::string sha256 = data::recording_sha256(recording);
  const auto as_searched = [&](std::size_t r) {
    SearchedMesh found{meshes[r], scale, summary.recordings[r].mesh_sha256};
    expect_as_searched(found, path, "recordings." + summary.recordings[r].name + ".mesh");
    return found;
  };
  for (std::size_t r = 0; r < meshes.size(); ++r)
    if (summary.recordings[r].sha256 == sha256)
      return summary.recordings[r].own_mesh ? SearchedMesh{"", scale} : as_searched(r);
  const double here = extent_of("", path, recording);
  std::string sizes;
  for (std::size_t r = 0; r < meshes.size(); ++r) {
    SearchedMesh found = as_searched(r);
    const double searched = extent_of(found.mesh, path, recording);
    if (std::abs(searched - here) <= kSame * here) return found;
    sizes += (sizes.empty() ? "" : ", ") + data::format_short(searched) + " m";
  }
  throw data::input_error(recording.source, "object.mesh",
                          "found an object " + data::format_short(here) + " m across, that of " + run +
                              " is " + sizes + ": give --mesh where both are of the same material");
}

}  // namespace flash::sysid
