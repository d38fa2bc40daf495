#include "sim/law/mesh_gap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace flash::sim {
inline namespace FLASH_LEVEL {
namespace {

using V = Vector3<double>;

constexpr double on_surface = 1e-9;    ///< distance up to which a place is on the triangles [m]
constexpr double lift = 1e-8;          ///< by which a way that starts on a surface starts above it [m]
constexpr double crease_reach = 1e-4;  ///< distance beyond the nearest up to which other surfaces count [m]
constexpr double least_turn = 1e-6;    ///< sin^2 between triangles that are two surfaces, as in solve_lcp
constexpr double same_surface = 0.5;   ///< cosine between triangles of one smooth surface, as in `lands`
constexpr double beside = -0.1;        ///< cosine between those of a way in and out again that rounds an edge

double sign_of(double x) { return x < 0 ? -1.0 : 1.0; }

/// Signed distance to what is nearest. `side`: of the surface that the vertex belongs on, 1 where the normals
/// point.
MeshGap gap_to_place(const SurfaceMesh& mesh, double margin, const SurfacePlace& place, const V& point,
                     double side) {
  MeshGap gap;
  gap.triangle = place.triangle;
  if (place.triangle < 0) {
    gap.distance = std::numeric_limits<double>::quiet_NaN();
    return gap;
  }
  const SurfaceTriangle& t = mesh.triangles[place.triangle];
  const V out = point - place.point;
  if (place.feature == SurfaceFeature::face || place.distance < on_surface) {
    gap.normal = side * t.normal;
    gap.distance = (place.feature == SurfaceFeature::face ? dot(gap.normal, point - t.corners[0])
                                                          : dot(gap.normal, out)) -
                   margin;
    return gap;
  }
  const double sign = side * sign_of(dot(pseudonormal(mesh, place), out));
  gap.normal = (sign / place.distance) * out;
  gap.distance = sign * place.distance - margin;
  // An edge without a margin is sharp: a vertex on it is on one of its triangles.
  if (margin == 0 || sign < 0) return gap;
  if (place.feature == SurfaceFeature::corner) {
    gap.ball_curvature = 1 / place.distance;
    return gap;
  }
  const V along = t.corners[(place.number + 1) % 3] - t.corners[place.number];
  gap.curvature_direction = (1 / (norm(along) * square_root(place.distance))) * cross(along, gap.normal);
  return gap;
}

/// The side that a place is on: of a closed mesh always outside.
double side_at(const SurfaceMesh& mesh, const SurfacePlace& place, const V& point) {
  if (mesh.closed || place.triangle < 0) return 1;
  return sign_of(dot(pseudonormal(mesh, place), point - place.point));
}

/// A triangle that a place is straight above.
struct Facing {
  int triangle;
  double side;
  V normal, foot;
};

/// Whether two triangles that meet at one place are two surfaces there: in a crease each comes
/// before the other.
bool are_two_surfaces(const SurfaceMesh& mesh, const Facing& a, const Facing& b) {
  const V turn = cross(a.normal, b.normal);
  if (dot(turn, turn) < least_turn && dot(a.normal, b.normal) > 0) return false;
  if (norm(a.foot - b.foot) > lift) return true;
  const auto before = [&](const Facing& one, const Facing& other) {
    const SurfaceTriangle& t = mesh.triangles[other.triangle];
    return std::any_of(t.corners, t.corners + 3,
                       [&](const V& corner) { return dot(one.normal, corner - one.foot) > on_surface; });
  };
  return before(a, b) && before(b, a);
}

/// Of more than there is room for: the first, the one that differs most from it, and the one that spans most
/// with both.
void keep_the_widest(std::vector<MeshGap>& gaps) {
  if (gaps.size() <= most_mesh_surfaces) return;
  const V first = gaps[0].normal;
  const auto less_alike = [&](const MeshGap& a, const MeshGap& b) {
    return dot(first, a.normal) < dot(first, b.normal);
  };
  std::iter_swap(gaps.begin() + 1, std::min_element(gaps.begin() + 1, gaps.end(), less_alike));
  const V edge = cross(first, gaps[1].normal);
  std::iter_swap(gaps.begin() + 2,
                 std::max_element(gaps.begin() + 2, gaps.end(), [&](const MeshGap& a, const MeshGap& b) {
                   return std::abs(dot(edge, a.normal)) < std::abs(dot(edge, b.normal));
                 }));
  gaps.resize(most_mesh_surfaces);
}

/// The surfaces at a place that is outside: what is nearest, and each triangle beside it that the place is
/// straight above. They come in the order of the triangles, so that rounding does not exchange them.
std::vector<MeshGap> surfaces_at(const SurfaceMesh& mesh, double margin, const SurfacePlace& nearest,
                                 const V& point, double side) {
  std::vector<MeshGap> gaps = {gap_to_place(mesh, margin, nearest, point, side)};
  if (!(gaps[0].distance <= crease_reach)) return gaps;
  const std::vector<SurfacePlace> places = near_on(mesh, point, nearest.distance + crease_reach);
  // Of triangles that are as near the first is taken, so that rounding does not choose.
  for (const SurfacePlace& place : places)
    if (place.distance <= nearest.distance + 1e-12) {
      gaps[0] = gap_to_place(mesh, margin, place, point, mesh.closed ? 1 : side_at(mesh, place, point));
      gaps[0].triangle = place.triangle;
      break;
    }
  std::vector<Facing> found = {
      {gaps[0].triangle, side, gaps[0].normal, point - (gaps[0].distance + margin) * gaps[0].normal}};
  for (const SurfacePlace& place : places) {
    const SurfaceTriangle& t = mesh.triangles[place.triangle];
    const double height = dot(t.normal, point - t.corners[0]);
    if (place.triangle == gaps[0].triangle || (mesh.closed && height < -on_surface)) continue;
    const Facing facing{place.triangle, mesh.closed ? 1 : sign_of(height),
                        (mesh.closed ? 1 : sign_of(height)) * t.normal, point - height * t.normal};
    if (norm(place.point - facing.foot) > on_surface) continue;
    if (!std::all_of(found.begin(), found.end(),
                     [&](const Facing& other) { return are_two_surfaces(mesh, facing, other); }))
      continue;
    found.push_back(facing);
    MeshGap gap;
    gap.normal = facing.normal;
    gap.distance = facing.side * height - margin;
    gap.triangle = place.triangle;
    gaps.push_back(gap);
  }
  std::sort(gaps.begin(), gaps.end(),
            [](const MeshGap& a, const MeshGap& b) { return a.triangle < b.triangle; });
  keep_the_widest(gaps);
  return gaps;
}

/// The place where a way starts, above the triangles that it starts on.
V lifted(const SurfaceMesh& mesh, double margin, const SurfacePlace& nearest, const V& from, double side) {
  if (nearest.distance >= lift) return from;
  V place = from;
  for (const MeshGap& gap : surfaces_at(mesh, margin, nearest, from, side)) place = place + lift * gap.normal;
  return place;
}

/// What a way goes through and does not come out of as it may.
struct Barrier {
  int triangle = -1;    ///< by which it goes in; -1: there is none
  double side = 1;      ///< of it that the way comes from
  bool passed = false;  ///< whether it comes out, on the far side
};

Barrier barrier_on(const SurfaceMesh& mesh, const V& from, const V& to) {
  Barrier barrier;
  int within = 0;
  double last = -1;
  bool last_in = false;
  const double length = norm(to - from);
  for (const SurfaceCrossing& crossing : crossings_of(mesh, from, to)) {
    if (!mesh.closed && within == 0) barrier.side = crossing.along_normal ? -1 : 1;
    const bool in = crossing.along_normal == (barrier.side < 0);
    // Through an edge or a corner it meets more than one triangle.
    const bool again = last_in == in && (crossing.share - last) * length <= 1e-12;
    last = crossing.share;
    last_in = in;
    if (again) continue;
    if (in && within++ == 0) barrier.triangle = crossing.triangle;
    if (in || within == 0 || --within > 0) continue;
    const V &entry = mesh.triangles[barrier.triangle].normal,
            &exit = mesh.triangles[crossing.triangle].normal;
    if (dot(entry, exit) < beside) {
      barrier.passed = true;
      return barrier;
    }
    barrier.triangle = -1;
  }
  return barrier;
}

/// Against the barrier on its way, or against what is nearest where that is of the same smooth surface.
MeshGap gap_behind(const SurfaceMesh& mesh, double margin, const Barrier& barrier,
                   const SurfacePlace& nearest, const V& to) {
  const SurfaceTriangle& t = mesh.triangles[barrier.triangle];
  MeshGap entry;
  entry.triangle = barrier.triangle;
  entry.normal = barrier.side * t.normal;
  entry.distance = dot(entry.normal, to - t.corners[0]) - margin;
  const MeshGap near = gap_to_place(mesh, margin, nearest, to, barrier.side);
  // Of a part that reaches into this one the nearest triangle may lie within.
  const bool same_part = mesh.triangles[nearest.triangle].part == t.part;
  const bool smooth = same_part && !barrier.passed && near.distance <= 0 && !is_on_border(mesh, nearest) &&
                      dot(near.normal, entry.normal) > same_surface;
  // In a bend it may be before the plane of the triangle that it went in by.
  return smooth || (same_part && !(entry.distance < 0)) ? near : entry;
}

/// Whether a way from inside leaves by a triangle that is not on the far side of `normal`.
bool comes_out_beside(const SurfaceMesh& mesh, const V& normal, const V& from, const V& to) {
  for (const SurfaceCrossing& crossing : crossings_of(mesh, from, to))
    if (!mesh.closed || crossing.along_normal)
      return mesh.closed && dot(mesh.triangles[crossing.triangle].normal, normal) >= beside;
  return true;
}

/// Of what starts inside, on its way out.
MeshGap gap_of_leaving(const SurfaceMesh& mesh, double margin, const SurfacePlace& start, const V& from,
                       const SurfacePlace& end, const V& to, const V& way_out) {
  const double side = side_at(mesh, start, from);
  const MeshGap at_start = gap_to_place(mesh, margin, start, from, side),
                near = gap_to_place(mesh, margin, end, to, mesh.closed ? 1 : side_at(mesh, end, to));
  if (near.distance > on_surface && (!is_zero(way_out) || comes_out_beside(mesh, at_start.normal, from, to)))
    return near;
  if (mesh.closed && !is_zero(way_out)) {
    const double depth = depth_of(mesh, margin, from, way_out);
    if (depth < no_such_side) {
      MeshGap gap;
      gap.normal = way_out;
      gap.distance = dot(way_out, to - from) - depth;
      gap.depth = depth;
      gap.triangle = near.triangle;
      return gap;
    }
  }
  MeshGap gap;
  if (dot(near.normal, at_start.normal) > same_surface) {
    gap = near;
  } else {
    gap.normal = at_start.normal;
    gap.distance = at_start.distance + dot(at_start.normal, to - from);
    gap.triangle = at_start.triangle;
  }
  gap.depth = -at_start.distance;
  return gap;
}

MeshGaps filled(const std::vector<MeshGap>& gaps) {
  MeshGaps all;
  for (std::size_t k = 0; k < most_mesh_surfaces; ++k) all.surfaces[k] = gaps[k < gaps.size() ? k : 0];
  return all;
}

}  // namespace

MeshGap gap_at(const SurfaceMesh& mesh, double margin, const Vector3<double>& place) {
  const SurfacePlace nearest = nearest_on(mesh, place);
  return gap_to_place(mesh, margin, nearest, place, side_at(mesh, nearest, place));
}

MeshGaps gaps_after(const SurfaceMesh& mesh, double margin, const Vector3<double>& from,
                    const Vector3<double>& to, const Vector3<double>& way_out) {
  const SurfacePlace end = nearest_on(mesh, to);
  const double side = side_at(mesh, end, to);
  const MeshGap near = gap_to_place(mesh, margin, end, to, side);
  // The surface is farther away than the way is long.
  if (!(end.distance <= norm(to - from) + margin + lift) && !(near.distance < 0)) return filled({near});
  const SurfacePlace start = nearest_on(mesh, from);
  if (start.triangle < 0 || end.triangle < 0) return filled({near});
  const double start_side = side_at(mesh, start, from);
  if (gap_to_place(mesh, margin, start, from, start_side).distance < -inside_depth) {
    MeshGaps leaving = filled({gap_of_leaving(mesh, margin, start, from, end, to, way_out)});
    leaving.starts_inside = true;
    return leaving;
  }
  const Barrier barrier = barrier_on(mesh, lifted(mesh, margin, start, from, start_side), to);
  if (barrier.triangle >= 0) {
    const MeshGap behind = gap_behind(mesh, margin, barrier, end, to);
    // A way that ends on the triangles is not behind them.
    if (!(behind.distance + margin >= -on_surface)) return filled({behind});
  }
  return filled(surfaces_at(mesh, margin, end, to, side));
}

double depth_of(const SurfaceMesh& mesh, double margin, const Vector3<double>& place,
                const Vector3<double>& direction) {
  if (!mesh.closed) return no_such_side;
  const SurfaceNode& all = mesh.nodes[0];
  const double length = norm(all.high - all.low) + margin;
  for (const SurfaceCrossing& crossing : crossings_of(mesh, place, place + length * direction))
    if (crossing.along_normal) return crossing.share * length + margin;
  return no_such_side;
}

SurfaceGap<double> gap_to_mesh(const MovingObstacle<double>& obstacle, const Vector3<double>& point) {
  const MeshGap found = gap_at(*obstacle.mesh, obstacle.radius, place_in(obstacle.end, point));
  SurfaceGap<double> gap;
  gap.distance = found.distance;
  gap.normal = direction_from(obstacle.end, found.normal);
  gap.curvature_direction = direction_from(obstacle.end, found.curvature_direction);
  gap.ball_curvature = found.ball_curvature;
  return gap;
}

SurfaceGap<double> gap_after_mesh(const MovingObstacle<double>& obstacle, const Vector3<double>& start,
                                  const Vector3<double>& point, double time_step,
                                  const WayOut<double>& way_out) {
  const V from = place_in(obstacle.start, start), to = place_in(obstacle.end, point),
          out = direction_in(obstacle.start, way_out.direction);
  const auto equal = [](const V& a, const V& b) { return a.x == b.x && a.y == b.y && a.z == b.z; };
  MeshMemory own;
  MeshMemory& memory = obstacle.memory == nullptr ? own : *obstacle.memory;
  if (!memory.known || !equal(memory.from, from) || !equal(memory.to, to) || !equal(memory.way_out, out))
    memory = {true, from, to, out, gaps_after(*obstacle.mesh, obstacle.radius, from, to, out)};
  const MeshGap& found = memory.gaps.surfaces[obstacle.surface];
  SurfaceGap<double> gap;
  gap.distance = found.distance;
  gap.normal = direction_from(obstacle.end, found.normal);
  gap.curvature_direction = direction_from(obstacle.end, found.curvature_direction);
  gap.ball_curvature = found.ball_curvature;
  gap.surface_moved = material_motion(obstacle, point);
  return memory.gaps.starts_inside ? let_out(gap, found.depth, time_step, way_out) : gap;
}

double depth_along_mesh(const MovingObstacle<double>& obstacle, const Vector3<double>& start,
                        const Vector3<double>& way) {
  return depth_of(*obstacle.mesh, obstacle.radius, place_in(obstacle.start, start),
                  direction_in(obstacle.start, way));
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
