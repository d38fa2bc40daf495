#include "sysid/replay/recorded_mesh.h"

#include <Eigen/Geometry>
#include <utility>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sysid {
namespace {

/// The vertices of `mesh` inside the bounding box, at rest, of those that were taken on the recording's own.
std::vector<int> same_place(const std::vector<int>& taken, const data::TriangleMesh& own,
                            const data::TriangleMesh& mesh, const std::string& source,
                            const std::string& field) {
  Eigen::AlignedBox3d box;
  for (const int vertex : taken) box.extend(own.vertices.row(vertex).transpose());
  const double slack = 1e-6 * (own.vertices.colwise().maxCoeff() - own.vertices.colwise().minCoeff()).norm();
  std::vector<int> vertices;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i)
    if (box.exteriorDistance(Eigen::Vector3d(mesh.vertices.row(i))) <= slack)
      vertices.push_back(static_cast<int>(i));
  if (vertices.empty())
    throw data::input_error(source, field + ".select.vertices", "none of the other mesh lies where these do");
  return vertices;
}

/// Takes what was selected by vertices to the vertices that lie there now; the start follows its pose.
void follow(const data::TriangleMesh& own, data::Recording& recording) {
  const auto moved = [&](data::Selection& select, const char* field) {
    if (!select.vertices.empty())
      select.vertices = same_place(select.vertices, own, recording.mesh, recording.source, field);
  };
  for (data::RecordedGrasp& grasp : recording.grasps) moved(grasp.select, "grasps");
  for (data::RecordedSupport& support : recording.supports) moved(support.select, "supports");
  for (data::RecordedLoad& load : recording.loads) moved(load.select, "loads");
  recording.start = (recording.mesh.vertices * recording.base_from_object.linear().transpose()).rowwise() +
                    recording.base_from_object.translation().transpose();
}

void expect_rigid_start(const data::Recording& recording, const std::string& mesh) {
  if (!recording.start_mesh.empty())
    throw data::input_error(recording.source, "object.start",
                            "is a mesh of its own, so that the sheet cannot be meshed anew as " + mesh);
}

}  // namespace

void place_mesh(data::TriangleMesh mesh, data::Recording& recording) {
  expect_rigid_start(recording, recording.mesh_spec);
  const data::TriangleMesh own = std::exchange(recording.mesh, std::move(mesh));
  follow(own, recording);
}

void replace_mesh(const std::string& mesh, data::Recording& recording) {
  expect_rigid_start(recording, mesh);
  const data::TriangleMesh own = std::move(recording.mesh);
  const bool was_solid = recording.is_solid();
  data::load_object_mesh(mesh, "--mesh", "", recording);
  if (recording.is_solid() != was_solid)
    throw data::InputError("--mesh: found " + mesh + ", expected " +
                           (was_solid ? "a solid as box:0.1x0.03x0.03:0.01 or a file of tetrahedra"
                                      : "a sheet as sheet:0.4x0.4:0.02 or a file of triangles"));
  const auto size_of = [](const data::TriangleMesh& each) -> Eigen::Vector3d {
    return (each.vertices.colwise().maxCoeff() - each.vertices.colwise().minCoeff()).transpose();
  };
  const Eigen::Vector3d was = size_of(own), is = size_of(recording.mesh);
  // Of the largest side: cells of another size and a new measurement stay below. Work: a refusal.
  constexpr double kOther = 0.25;
  if ((was - is).cwiseAbs().maxCoeff() > kOther * was.maxCoeff()) {
    const auto text = [](const Eigen::Vector3d& size) {
      return data::format_short(size.x()) + " x " + data::format_short(size.y()) + " x " +
             data::format_short(size.z()) + " m";
    };
    throw data::InputError("--mesh: found " + mesh + ", " + text(is) +
                           ", expected about the size of the object in " + recording.source + ", " +
                           text(was));
  }
  follow(own, recording);
}

}  // namespace flash::sysid
