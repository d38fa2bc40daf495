#include "sysid/replay/half_cell.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "data/mesh/halved_tets.h"
#include "data/mesh/tet_faces.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/replay/replay_mesh.h"

namespace flash::sysid {
namespace {

/// The recording of a solid whose tetrahedra came from a file, each split in eight. What was selected by
/// vertices takes the edges between them too.
data::Recording with_halved_tets(const data::Recording& recording) {
  data::Recording finer = recording;
  const data::HalvedTets halves = data::halved({recording.mesh.vertices, recording.tetrahedra});
  finer.tetrahedra = halves.mesh.tetrahedra;
  finer.mesh = {halves.mesh.vertices, data::outer_faces(finer.tetrahedra)};
  const auto add_middles = [&](data::Selection& select) {
    const std::set<int> chosen(select.vertices.begin(), select.vertices.end());
    const auto count = static_cast<int>(recording.mesh.vertices.rows());
    for (std::size_t k = 0; k < halves.edges.size(); ++k)
      if (chosen.contains(halves.edges[k][0]) && chosen.contains(halves.edges[k][1]))
        select.vertices.push_back(count + static_cast<int>(k));
  };
  for (data::RecordedGrasp& grasp : finer.grasps) add_middles(grasp.select);
  for (data::RecordedSupport& support : finer.supports) add_middles(support.select);
  for (data::RecordedLoad& load : finer.loads) add_middles(load.select);
  finer.start = (finer.mesh.vertices * finer.base_from_object.linear().transpose()).rowwise() +
                finer.base_from_object.translation().transpose();
  return finer;
}

}  // namespace

Replay on_half_the_cell(const Replay& replay) {
  ReplaySettings settings = replay.settings;
  if (are_graded(replay.recording, settings)) {
    data::Recording finer = replay.recording;
    refine_grasps(settings, 0.25, finer);
    return on_mesh(replay, std::move(finer), settings);
  }
  if (takes_any_cell(replay.recording)) {
    settings.cell_scale *= 0.5;
    return make_replay(replay, settings);
  }
  data::Recording finer = replay.recording.is_solid() ? with_halved_tets(replay.recording) : replay.recording;
  if (!finer.is_solid()) halve_cells(finer);
  return on_mesh(replay, std::move(finer), settings);
}

std::vector<Replay> on_half_the_cell(const std::vector<Replay>& replays) {
  std::vector<Replay> halves;
  for (const Replay& replay : replays) {
    halves.push_back(on_half_the_cell(replay));
  }
  return halves;
}

std::vector<Replay> on_smaller_cells(const std::vector<Replay>& replays, double factor) {
  const bool any = std::all_of(replays.begin(), replays.end(),
                               [](const Replay& replay) { return takes_any_cell(replay.recording); });
  std::vector<Replay> smaller;
  for (const Replay& replay : replays) {
    ReplaySettings settings = replay.settings;
    settings.cell_scale *= any ? factor : 0.5;
    smaller.push_back(make_replay(replay, settings));
  }
  return smaller;
}

bool are_graded(const std::vector<Replay>& replays) {
  return std::all_of(replays.begin(), replays.end(),
                     [](const Replay& replay) { return are_graded(replay.recording, replay.settings); });
}

HalvedSheet halved_sheet(const std::vector<Replay>& replays, int times) {
  HalvedSheet halves;
  for (const Replay& replay : replays) {
    data::Recording sheet = replay.recording;
    for (int time = 1; time < times; ++time) halve_cells(sheet);
    data::Recording before = sheet;
    refine_grasps(replay.settings, std::ldexp(1.0, -times), before);
    halve_cells(sheet);
    halves.before.push_back(on_mesh(replay, std::move(before), replay.settings));
    halves.after.push_back(on_mesh(replay, std::move(sheet), replay.settings));
  }
  return halves;
}

}  // namespace flash::sysid
