#include "data/mesh/selection.h"

#include <limits>
#include <set>

#include "data/files/json_reader.h"

namespace flash::data {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

Eigen::Vector3d read_bound(const JsonObject& object, const char* key, double open) {
  Eigen::Vector3d bound = Eigen::Vector3d::Constant(open);
  if (!object.has(key)) return bound;
  const nlohmann::json& list = object.raw(key);
  if (!list.is_array() || list.size() != 3) throw object.error(key, "three numbers, null where open");
  for (int axis = 0; axis < 3; ++axis) {
    const nlohmann::json& value = list[static_cast<std::size_t>(axis)];
    if (value.is_null()) continue;
    if (!value.is_number()) throw object.error(key, "three numbers, null where open");
    bound[axis] = value.get<double>();
  }
  return bound;
}

Selection read_selection(const JsonObject& owner, Eigen::Index vertices) {
  const JsonObject select = owner.object("select");
  select.expect_fields({"corner", "vertices", "position", "within", "box"});
  if (select.has("corner") + select.has("vertices") + select.has("position") + select.has("box") != 1)
    throw input_error(select.source(), owner.name_of("select"),
                      "expected exactly one of corner, vertices, position and box");
  Selection selection;
  selection.within = select.positive("within", selection.within);
  if (select.has("position")) selection.position = select.vector("position", 3);
  if (select.has("corner")) {
    const std::vector<int> corner = select.indices("corner");
    if (corner.size() != 2 || corner[0] > 1 || corner[1] > 1)
      throw select.error("corner", "[i, j], each 0 or 1");
    selection.corner = {corner[0], corner[1]};
  }
  if (select.has("vertices")) {
    selection.vertices = select.indices("vertices");
    if (selection.vertices.empty()) throw select.error("vertices", "at least one index");
    if (std::set<int>(selection.vertices.begin(), selection.vertices.end()).size() !=
        selection.vertices.size())
      throw select.error("vertices", "each vertex once");
    for (const int vertex : selection.vertices)
      if (vertex >= vertices)
        throw select.error("vertices",
                           "indices below " + std::to_string(vertices) + ", the vertices of the mesh");
  }
  if (select.has("box")) {
    const JsonObject box = select.object("box");
    box.expect_fields({"min", "max"});
    const Eigen::Vector3d low = read_bound(box, "min", -kInfinity), high = read_bound(box, "max", kInfinity);
    if (!(low.array() <= high.array()).all()) throw box.error("min", "at most max on every axis");
    selection.box = Eigen::AlignedBox3d(low, high);
  }
  return selection;
}

std::vector<int> vertices_in(const Selection& select, const Points& rest, const Points& start,
                             const Eigen::Vector3d& place) {
  if (!select.vertices.empty()) return select.vertices;
  std::vector<int> selected;
  // A cell edge that equals `within` but for rounding counts as inside.
  const double within = select.within * (1 + 1e-9);
  if (select.corner) {
    Eigen::Vector2d corner;
    for (int axis = 0; axis < 2; ++axis)
      corner[axis] = (*select.corner)[static_cast<std::size_t>(axis)] == 0 ? rest.col(axis).minCoeff()
                                                                           : rest.col(axis).maxCoeff();
    for (int v = 0; v < rest.rows(); ++v)
      if ((rest.row(v).head<2>().transpose() - corner).cwiseAbs().maxCoeff() <= within) selected.push_back(v);
  } else if (select.box) {
    // So does a vertex on a side of the box.
    const double slack = 1e-9 * (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
    const Eigen::AlignedBox3d box(select.box->min().array() - slack, select.box->max().array() + slack);
    for (int v = 0; v < rest.rows(); ++v)
      if (box.contains(Eigen::Vector3d(rest.row(v)))) selected.push_back(v);
  } else {
    for (int v = 0; v < rest.rows(); ++v)
      if ((start.row(v).transpose() - place).norm() <= within) selected.push_back(v);
  }
  return selected;
}

}  // namespace flash::data
