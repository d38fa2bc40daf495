#include "sysid/infer/motion_change.h"

#include <optional>

#include "sysid/emulate/mesh_projection.h"

namespace flash::sysid {
namespace {

bool are_alike(const data::TriangleMesh& one, const data::TriangleMesh& other) {
  return one.vertices.rows() == other.vertices.rows() && one.vertices == other.vertices;
}

}  // namespace

SheetShifts shifts_of(const MotionChange& change, std::size_t r, const Replay& replay, double time_offset) {
  const data::TriangleMesh& mesh = replay.surface;
  SheetShifts shifts(replay.observations.size());
  for (SheetShift& shift : shifts) shift.positions = data::Points::Zero(mesh.vertices.rows(), 3);
  for (const MotionTerm& term : change) {
    const data::TriangleMesh& own = term.motions->replays[r].surface;
    const Motion& motion = term.motions->results[r].motion;
    std::optional<MeshProjection> to_mesh;
    if (!are_alike(own, mesh)) to_mesh = projection(own, mesh);
    data::Points positions;
    for (std::size_t k = 0; k < shifts.size(); ++k) {
      const double t = replay.observations[k].t + time_offset;
      surface_at(motion, t, positions);
      if (to_mesh) positions = projected(*to_mesh, positions);
      shifts[k].positions += term.factor * positions;
      shifts[k].force += term.factor * force_at(motion, t);
    }
  }
  return shifts;
}

}  // namespace flash::sysid
