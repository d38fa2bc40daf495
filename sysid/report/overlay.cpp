#include "sysid/report/overlay.h"

#include <cstdio>
#include <filesystem>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "sysid/observe/registration.h"

namespace flash::sysid {
namespace {

std::string frame_path(const std::string& folder, std::size_t index, const char* what) {
  char name[32];
  std::snprintf(name, sizeof name, "%03zu_%s.ply", index, what);
  return (std::filesystem::path(folder) / name).string();
}

std::string table_path(const std::string& folder) {
  return (std::filesystem::path(folder) / "overlay.csv").string();
}

std::string picture_path(const std::string& folder) {
  return (std::filesystem::path(folder) / "import.svg").string();
}

constexpr std::string_view header = "t,score_m,points";

}  // namespace

Overlay make_overlay(const Replay& replay, const Motion& motion, const RecordingScore& score) {
  Registration registration = registration_problem(replay, motion).start;
  registration.offset = score.offset;
  registration.yaw = score.yaw;
  registration.time_offset = score.time_offset;
  const Eigen::Isometry3d move = registration.observed_from_simulated();
  Overlay overlay{replay.recording.name, replay.surface.triangles, {}};
  for (std::size_t k = 0; k < replay.observations.size(); ++k) {
    OverlayFrame& frame = overlay.frames.emplace_back();
    frame.t = replay.observations[k].t;
    frame.cloud = replay.observations[k].points;
    frame.score = score.keyframes[k].score;
    data::Points simulated;
    surface_at(motion, frame.t + score.time_offset, simulated);
    frame.vertices = (simulated * move.linear().transpose()).rowwise() + move.translation().transpose();
  }
  return overlay;
}

void save_overlay(const Overlay& overlay, const std::string& folder) {
  std::filesystem::create_directories(folder);
  std::string table = std::string(header) + "\n";
  for (std::size_t k = 0; k < overlay.frames.size(); ++k) {
    const OverlayFrame& frame = overlay.frames[k];
    data::save_triangle_mesh({frame.vertices, overlay.triangles}, frame_path(folder, k, "mesh"));
    data::save_point_cloud(frame.cloud, frame_path(folder, k, "cloud"));
    table += data::format_number(frame.t) + "," + data::format_number(frame.score) + "," +
             std::to_string(frame.cloud.rows()) + "\n";
  }
  if (overlay.start_picture.empty())
    std::filesystem::remove(picture_path(folder));  // of an earlier search
  else
    data::write_atomically(picture_path(folder), overlay.start_picture);
  data::write_atomically(table_path(folder), table);
}

Overlay load_overlay(const std::string& folder) {
  const std::string path = table_path(folder);
  const std::string text = data::read_file(path);
  data::LineReader lines(text);
  std::string_view line;
  if (!lines.next(line) || line != header)
    throw data::InputError(path + ": line 1: expected \"" + std::string(header) + "\"");
  Overlay overlay;
  overlay.name = std::filesystem::path(folder).filename().string();
  if (std::filesystem::is_regular_file(picture_path(folder)))
    overlay.start_picture = data::read_file(picture_path(folder));
  while (lines.next(line)) {
    const std::vector<std::string_view> words = data::split(line, ",");
    const auto t = words.size() == 3 ? data::parse_number(words[0]) : std::nullopt;
    const auto score = words.size() == 3 ? data::parse_number(words[1]) : std::nullopt;
    if (!t || !score)
      throw data::InputError(path + ": line " + std::to_string(lines.number()) + ": expected three numbers");
    data::TriangleMesh mesh = data::load_triangle_mesh(frame_path(folder, overlay.frames.size(), "mesh"));
    data::Points cloud = data::load_point_cloud(frame_path(folder, overlay.frames.size(), "cloud"));
    overlay.triangles = std::move(mesh.triangles);
    overlay.frames.push_back({*t, std::move(mesh.vertices), std::move(cloud), *score});
  }
  return overlay;
}

}  // namespace flash::sysid
