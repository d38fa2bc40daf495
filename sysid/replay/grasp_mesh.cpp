#include "sysid/replay/grasp_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/procedural_mesh.h"
#include "data/meshing/remesh.h"
#include "sysid/replay/recorded_grasp.h"
#include "sysid/replay/recorded_mesh.h"

namespace flash::sysid {
namespace {

using Eigen::Vector3d;

/// Cells of a mesh, or a patch, over those at a grasp. Measured: with kFinest, D of a lift on cells of 20 mm
/// is 2.8 % high where it was 53 % (docs/validation/grasp.md).
constexpr double kFiner = 5;
/// Likewise at a straight edge across the sheet, where nothing is singular. Chosen: not varied.
constexpr double kStraight = 2;
/// Cells at a grasp over those at a corner of the patch. Measured: as kFiner.
constexpr double kFinest = 8;

/// Below zero inside [m].
double box_distance(const Eigen::AlignedBox3d& box, const Vector3d& place) {
  const double outside = box.exteriorDistance(place);
  if (outside > 0) return outside;
  return -std::min((place - box.min()).minCoeff(), (box.max() - place).minCoeff());
}

/// The corner of a rest shape that a selection names, and the directions into the sheet along its sides.
struct RestCorner {
  Vector3d place;
  Eigen::Vector2d inwards;
};

RestCorner rest_corner(const data::Points& rest, const std::array<int, 2>& corner) {
  RestCorner found{rest.colwise().minCoeff().transpose(), Eigen::Vector2d::Ones()};
  for (int axis = 0; axis < 2; ++axis)
    if (corner[std::size_t(axis)] == 1) {
      found.place[axis] = rest.col(axis).maxCoeff();
      found.inwards[axis] = -1;
    }
  return found;
}

/// Where a place of the start lies in the rest shape.
Vector3d place_at_rest(const data::Recording& recording, const Vector3d& place) {
  if (recording.start_mesh.empty()) return recording.base_from_object.inverse() * place;
  Eigen::Index nearest;
  (recording.start.rowwise() - place.transpose()).rowwise().squaredNorm().minCoeff(&nearest);
  return recording.mesh.vertices.row(nearest).transpose();
}

/// The edge of a box, with those of its corners that lie in the sheet. One across the whole sheet has none.
data::Outline box_outline(const data::Points& rest, const Eigen::AlignedBox3d& box) {
  data::Outline outline{[box](const Vector3d& x) { return box_distance(box, x); }};
  const Vector3d low = rest.colwise().minCoeff().transpose(), high = rest.colwise().maxCoeff().transpose();
  const Vector3d slack = Vector3d::Constant(1e-9 * (high - low).maxCoeff());
  for (int axis = 0; axis < 2; ++axis)
    if (box.min()[axis] <= low[axis] + slack[axis] && box.max()[axis] >= high[axis] - slack[axis])
      return outline;
  const Eigen::AlignedBox3d sheet(low - slack, high + slack);
  for (const double x : {box.min().x(), box.max().x()})
    for (const double y : {box.min().y(), box.max().y()}) {
      const Vector3d corner(x, y, low.z());
      const bool is_new =
          std::find(outline.corners.begin(), outline.corners.end(), corner) == outline.corners.end();
      if (sheet.contains(corner) && is_new) outline.corners.push_back(corner);
    }
  return outline;
}

/// The edge of a patch. `within`: its size [m].
data::Outline patch_outline(const data::Recording& recording, const data::RecordedGrasp& grasp,
                            double within) {
  const data::Selection& select = grasp.select;
  const data::Points& rest = recording.mesh.vertices;
  if (select.corner) {
    const RestCorner corner = rest_corner(rest, *select.corner);
    data::Outline outline{[place = corner.place, within](const Vector3d& x) {
      return (x - place).head<2>().cwiseAbs().maxCoeff() - within;
    }};
    // A patch across a whole strip has a straight edge.
    const Eigen::RowVector3d sides = rest.colwise().maxCoeff() - rest.colwise().minCoeff();
    if (within < sides.head<2>().minCoeff())
      outline.corners = {corner.place + within * Vector3d(corner.inwards.x(), corner.inwards.y(), 0)};
    return outline;
  }
  if (select.box) return box_outline(rest, *select.box);
  if (select.position) {
    const Vector3d place = place_at_rest(
        recording, data::pose_at(trajectory_of(recording, grasp), grasp.from) * *select.position);
    return {[place, within](const Vector3d& x) { return (x - place).norm() - within; }};
  }
  Eigen::AlignedBox3d box;
  for (const int vertex : select.vertices) box.extend(rest.row(vertex).transpose());
  return box_outline(rest, box);
}

/// Where a point holds the sheet.
Vector3d held_point(const data::Recording& recording, const data::RecordedGrasp& grasp) {
  const data::Selection& select = grasp.select;
  if (select.corner) return rest_corner(recording.mesh.vertices, *select.corner).place;
  if (select.position)
    return place_at_rest(recording,
                         data::pose_at(trajectory_of(recording, grasp), grasp.from) * *select.position);
  return recording.mesh.vertices.row(data::select_vertices(recording, grasp).front()).transpose();
}

/// The sheet without its start where that is a rigid one, which is made again.
data::PlacedSheet placed(const data::Recording& recording) { return {recording.mesh, recording.start}; }

/// Puts a finer sheet in place of the recording's. What was selected by vertices takes those on the edges
/// between them too.
void take(const data::PlacedSheet& sheet, data::Recording& recording) {
  const auto first = static_cast<int>(recording.mesh.vertices.rows());
  const auto add_between = [&](data::Selection& select) {
    std::set<int> chosen(select.vertices.begin(), select.vertices.end());
    for (std::size_t k = 0; !chosen.empty() && k < sheet.added.size(); ++k)
      if (chosen.contains(sheet.added[k][0]) && chosen.contains(sheet.added[k][1])) {
        select.vertices.push_back(first + static_cast<int>(k));
        chosen.insert(select.vertices.back());
      }
  };
  for (data::RecordedGrasp& grasp : recording.grasps) add_between(grasp.select);
  for (data::RecordedSupport& support : recording.supports) add_between(support.select);
  for (data::RecordedLoad& load : recording.loads) add_between(load.select);
  recording.mesh = sheet.rest;
  recording.start = sheet.start;
}

/// Moves the cells along one side of a corner: a vertex at a distance `was` goes to `size`, others evenly,
/// and none from `reach` on [m].
void move_rows(const RestCorner& corner, int axis, double was, double size, double reach,
               data::Points& rest) {
  for (Eigen::Index i = 0; i < rest.rows(); ++i) {
    const double u = (rest(i, axis) - corner.place[axis]) * corner.inwards[axis];
    const double moved = u <= was    ? u * size / was
                         : u < reach ? size + (u - was) * (reach - size) / (reach - was)
                                     : u;
    rest(i, axis) = corner.place[axis] + moved * corner.inwards[axis];
  }
}

void start_as_at_rest(data::Recording& recording) {
  recording.start = (recording.mesh.vertices * recording.base_from_object.linear().transpose()).rowwise() +
                    recording.base_from_object.translation().transpose();
}

/// The row of vertices nearest to a distance from a corner, but that at the corner itself [m].
double nearest_row(const data::Points& rest, const RestCorner& corner, int axis, double within) {
  constexpr double kSame = 1e-9;  // Of a side. Work: rounding.
  const Eigen::ArrayXd all = (rest.col(axis).array() - corner.place[axis]) * corner.inwards[axis];
  double nearest = all.maxCoeff();
  const double least = kSame * nearest;
  for (const double u : all)
    if (u > least && std::abs(u - within) < std::abs(nearest - within)) nearest = u;
  return nearest;
}

/// Whether the vertices of a specification stand in rows along both sides.
bool has_rows(const std::string& mesh) {
  const std::vector<std::string_view> words = data::split(mesh, ":");
  return words.size() == 4 && words[0] == "sheet" && words[3] != "jittered" && words[3] != "delaunay";
}

/// Moves the rows of a pattern so that one lies on the edge of each patch at a corner: which cells there are
/// does not decide how much of the sheet is held.
void fit_rows(const ReplaySettings& settings, data::Recording& recording) {
  constexpr double kSame = 1e-9;  // Of a distance. Work: rounding.
  // Of what gives way as rows move onto a patch: a larger patch is as large as the strip. Work.
  constexpr double kMost = 0.9;
  data::Points& rest = recording.mesh.vertices;
  const Eigen::RowVector3d sides = rest.colwise().maxCoeff() - rest.colwise().minCoeff();
  for (const data::RecordedGrasp& grasp : recording.grasps) {
    if (!has_grasp_size(grasp, settings)) continue;
    const RestCorner corner = rest_corner(rest, *grasp.select.corner);
    const double within = size_of_patch(grasp, settings);
    for (int axis = 0; axis < 2; ++axis) {
      const double row = nearest_row(rest, corner, axis, within), most = std::max(row, within);
      const double half = 0.5 * sides[axis],
                   reach = most < kMost * half ? std::min(3 * most, half) : sides[axis];
      if (std::abs(row - within) > kSame * within && most < kMost * reach)  // else across a whole strip
        move_rows(corner, axis, row, within, reach, rest);
    }
  }
  start_as_at_rest(recording);
}

/// Whether a patch reaches across a side, but for rounding [m].
bool spans(double within, double side) { return within >= (1 - 1e-9) * side; }

/// Whether a specification is of a rectangle and names how its cells are cut.
bool names_pattern(const std::string& mesh) {
  return !mesh.starts_with("sheet:") || data::split(mesh, ":").size() > 3;
}

}  // namespace

double size_of_patch(const data::RecordedGrasp& grasp, const ReplaySettings& settings) {
  return shape_of(grasp, settings) == data::GraspShape::pinch
             ? grasp.depth
             : settings.grasp_within.value_or(grasp.select.within);
}

std::vector<data::Outline> grasp_outlines(const data::Recording& recording, const ReplaySettings& settings) {
  std::vector<data::Outline> outlines;
  const double cell = data::edge_lengths(recording.mesh).mean;
  for (const data::RecordedGrasp& grasp : recording.grasps) {
    const data::GraspShape shape = shape_of(grasp, settings);
    double size = cell, finer = kFiner;
    if (shape == data::GraspShape::point) {
      const Vector3d point = held_point(recording, grasp);
      outlines.push_back({[point](const Vector3d& x) { return (x - point).norm(); }, 0, {point}});
    } else {
      const double within = size_of_patch(grasp, settings);
      outlines.push_back(patch_outline(recording, grasp, within));
      if (grasp.select.corner || grasp.select.position) size = std::min(size, within);
      if (outlines.back().corners.empty() && !grasp.select.position) finer = kStraight;
    }
    outlines.back().near = settings.grasp_cell ? settings.cell_scale * *settings.grasp_cell
                           : grasp.cell > 0    ? grasp.cell
                                               : size / finer;
    outlines.back().near_corner = outlines.back().near / kFinest;
  }
  return outlines;
}

Eigen::RowVector3d patch_middle(const data::Recording& recording, const data::RecordedGrasp& grasp) {
  const data::Points& rest = recording.mesh.vertices;
  if (grasp.select.corner) {
    const RestCorner corner = rest_corner(rest, *grasp.select.corner);
    Eigen::RowVector3d middle = corner.place.transpose();
    const Eigen::RowVector3d sides = rest.colwise().maxCoeff() - rest.colwise().minCoeff();
    for (int axis = 0; axis < 2; ++axis)
      middle[axis] += 0.5 * std::min(grasp.select.within, sides[axis]) * corner.inwards[axis];
    return middle;
  }
  return rest(data::select_vertices(recording, grasp), Eigen::all).colwise().mean();
}

bool are_graded(const data::Recording& recording, const ReplaySettings& settings) {
  if (recording.is_solid() || recording.grasps.empty() || settings.grasp_cell == 0) return false;
  const bool as_named = data::is_mesh_spec(recording.mesh_spec) && names_pattern(recording.mesh_spec);
  return !as_named || settings.grasp_cell;
}

void grade_towards_grasps(const ReplaySettings& settings, data::Recording& recording) {
  if (!are_graded(recording, settings)) {
    if (has_rows(recording.mesh_spec) && settings.grasp_cell != 0 && recording.start_mesh.empty())
      fit_rows(settings, recording);
    return;
  }
  if (!names_pattern(recording.mesh_spec)) {
    const std::optional<double> cell = data::parse_number(data::split(recording.mesh_spec, ":")[2]);
    place_mesh(data::remeshed(recording.mesh, *cell), recording);
  }
  for (data::RecordedGrasp& grasp : recording.grasps) grasp.cell = 0;
  const std::vector<data::Outline> outlines = grasp_outlines(recording, settings);
  for (std::size_t k = 0; k < outlines.size(); ++k) recording.grasps[k].cell = outlines[k].near;
  take(data::aligned_with(data::refined_towards(placed(recording), outlines), outlines), recording);
}

void halve_cells(data::Recording& recording) { take(data::halved_cells(placed(recording)), recording); }

void refine_grasps(const ReplaySettings& settings, double part, data::Recording& recording) {
  std::vector<data::Outline> outlines = grasp_outlines(recording, settings);
  for (data::Outline& outline : outlines) {
    outline.near *= part;
    outline.near_corner *= part;
  }
  take(data::refined_towards(placed(recording), outlines), recording);
}

bool has_grasp_size(const data::RecordedGrasp& grasp, const ReplaySettings& settings) {
  return grasp.select.corner && shape_of(grasp, settings) == data::GraspShape::clamp;
}

std::optional<double> grasp_size(const data::Recording& recording, const ReplaySettings& settings) {
  if (recording.is_solid()) return std::nullopt;
  const Eigen::RowVector3d sides =
      recording.mesh.vertices.colwise().maxCoeff() - recording.mesh.vertices.colwise().minCoeff();
  for (const data::RecordedGrasp& grasp : recording.grasps)
    if (has_grasp_size(grasp, settings) && !spans(size_of_patch(grasp, settings), sides.head<2>().minCoeff()))
      return size_of_patch(grasp, settings);
  return std::nullopt;
}

void resize_grasps(double size, ReplaySettings& settings, data::Recording& recording) {
  data::Points& rest = recording.mesh.vertices;
  const Eigen::RowVector3d sides = rest.colwise().maxCoeff() - rest.colwise().minCoeff();
  for (data::RecordedGrasp& grasp : recording.grasps) {
    if (!has_grasp_size(grasp, settings)) continue;
    const RestCorner corner = rest_corner(rest, *grasp.select.corner);
    const double was = size_of_patch(grasp, settings);
    for (int axis = 0; axis < 2; ++axis) {
      if (spans(was, sides[axis])) continue;  // across a whole strip
      const double reach = std::min(3 * std::max(was, size), sides[axis]);
      if (!(std::max(was, size) < 0.9 * reach))
        throw data::InputError("grasp_size: found " + data::format_short(size) + " m, expected less than " +
                               data::format_short(0.9 * sides[axis]) + " m, most of a side of the sheet");
      move_rows(corner, axis, was, size, reach, rest);
    }
    grasp.select.within = size;
  }
  if (settings.grasp_within) settings.grasp_within = size;
  start_as_at_rest(recording);
}

}  // namespace flash::sysid
