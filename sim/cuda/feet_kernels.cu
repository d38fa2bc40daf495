#include "sim/cuda/feet_kernels.h"

#include <cmath>

#include "sim/cuda/launch.h"

namespace flash::sim::cuda {
namespace {

constexpr int warp = 32;
constexpr int warps = 8;  // of a block
constexpr unsigned all_lanes = 0xffffffffu;
constexpr double on_surface = 1e-9;  // where away from the surface is not told any more [m]
static_assert(group_triangles == warp);

using Place = Vector3<double>;

__device__ int lane() { return static_cast<int>(threadIdx.x) % warp; }
/// Of the grid, along its first axis.
__device__ int warp_number() {
  return static_cast<int>(blockIdx.x) * warps + static_cast<int>(threadIdx.x) / warp;
}

__device__ double least_of_warp(double value) {
  for (int offset = warp / 2; offset > 0; offset /= 2)
    value = fmin(value, __shfl_xor_sync(all_lanes, value, offset));
  return value;
}

/// A number and whose it is. Of equal numbers the first owner's is the least.
struct Owned {
  double value;
  int owner;
};

__device__ Owned least_of_warp(Owned mine) {
  for (int offset = warp / 2; offset > 0; offset /= 2) {
    const Owned other = {__shfl_xor_sync(all_lanes, mine.value, offset),
                         __shfl_xor_sync(all_lanes, mine.owner, offset)};
    if (other.value < mine.value || (other.value == mine.value && other.owner < mine.owner)) mine = other;
  }
  return mine;
}

/// One surface: its numbers of triangles and boxes.
struct Surface {
  double *placed, *boxes;
};
__device__ Surface surface_at(const FeetNumbers& n, int surface) {
  const long slots = static_cast<long>(n.groups) * group_triangles;
  return {n.placed + 9 * slots * surface, n.boxes + 6L * n.groups * surface};
}

/// A warp places the triangles of a group, and bounds them.
__global__ void __launch_bounds__(warp* warps) place_kernel(const __grid_constant__ FeetNumbers n) {
  const int group = warp_number(), slots = n.groups * group_triangles;
  if (group >= n.groups) return;
  const Surface surface = surface_at(n, static_cast<int>(blockIdx.y));
  const SurfaceTime time = n.times[blockIdx.y];
  const Place* from = n.steps + static_cast<long>(time.from) * n.vertices;
  const Place* to = n.steps + static_cast<long>(time.to) * n.vertices;
  const auto place = [&](int vertex) {
    return (1 - time.fraction) * from[vertex] + time.fraction * to[vertex];
  };
  const int slot = group * group_triangles + lane();
  const Vector3<int> corners = n.corners[slot];
  const Place a = place(corners.x), b = place(corners.y), c = place(corners.z);
  const Place e = b - a, f = c - a;
  for (int k = 0; k < 3; ++k) {
    surface.placed[k * slots + slot] = a[k];
    surface.placed[(3 + k) * slots + slot] = e[k];
    surface.placed[(6 + k) * slots + slot] = f[k];
    const double low = least_of_warp(fmin(a[k], fmin(b[k], c[k])));
    const double high = -least_of_warp(-fmax(a[k], fmax(b[k], c[k])));
    if (lane() != 0) continue;
    surface.boxes[k * n.groups + group] = low;
    surface.boxes[(3 + k) * n.groups + group] = high;
  }
}

/// x / y, zero where y is.
__device__ double ratio(double x, double y) { return y > 0 ? x / y : 0; }
__device__ double clamped(double x) { return fmin(fmax(x, 0.0), 1.0); }

/// A triangle: corner a, b - a and c - a.
struct Corners {
  Place a, e, f;
};
__device__ Corners corners_of(const Surface& surface, int slots, int slot) {
  const auto read = [&](int first) {
    return Place{surface.placed[first * slots + slot], surface.placed[(first + 1) * slots + slot],
                 surface.placed[(first + 2) * slots + slot]};
  };
  return {read(0), read(3), read(6)};
}

/// The point a + b e + c f of a triangle that is nearest to a + v.
struct OnTriangle {
  double distance2, b, c;
};

/// The foot on the plane where that lies inside, else the nearest point of the edges.
__device__ OnTriangle nearest_on(const Corners& at, const Place& v) {
  const Place &e = at.e, &f = at.f;
  const double ee = dot(e, e), ef = dot(e, f), ff = dot(f, f), ve = dot(v, e), vf = dot(v, f);
  const Place normal = cross(e, f);
  const double area2 = dot(normal, normal);
  const double b = ff * ve - ef * vf, c = ee * vf - ef * ve;  // times area2
  if (area2 > 0 && b >= 0 && c >= 0 && b + c <= area2) {
    const double height = dot(v, normal);
    return {height * height / area2, b / area2, c / area2};
  }
  const auto on = [&](double on_e, double on_f) {
    const Place rest = v - on_e * e - on_f * f;
    return OnTriangle{dot(rest, rest), on_e, on_f};
  };
  const auto nearer = [](const OnTriangle& x, const OnTriangle& y) {
    return y.distance2 < x.distance2 ? y : x;
  };
  // Along f - e from b: (v - e) . (f - e) = vf - ve - ef + ee.
  const double s = clamped(ratio(vf - ve - ef + ee, ee - 2 * ef + ff));
  return nearer(nearer(on(clamped(ratio(ve, ee)), 0), on(0, clamped(ratio(vf, ff)))), on(1 - s, s));
}

__device__ double distance2(const Surface& surface, int slots, int slot, const Place& q) {
  const Corners at = corners_of(surface, slots, slot);
  return nearest_on(at, q - at.a).distance2;
}

/// Squared distance of q to the box of a group; infinite beyond the last.
__device__ double box_distance2(const Surface& surface, int groups, int group, const Place& q) {
  if (group >= groups) return INFINITY;
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double outside = fmax(
        0.0, fmax(surface.boxes[k * groups + group] - q[k], q[k] - surface.boxes[(3 + k) * groups + group]));
    sum += outside * outside;
  }
  return sum;
}

__device__ SurfaceFoot foot_of(const FeetNumbers& n, const Surface& surface, int slot,
                               const SurfaceTime& time, const Place& q) {
  const Corners at = corners_of(surface, n.groups * group_triangles, slot);
  const Place v = q - at.a;
  const OnTriangle nearest = nearest_on(at, v);
  const Place away = v - nearest.b * at.e - nearest.c * at.f;
  const double distance = norm(away);
  const Place along = distance < on_surface ? cross(at.e, at.f) : away;
  const double length = norm(along);
  const Place direction = length > 0 ? (1 / length) * along : along;
  const auto moved = [&](int vertex) {
    return n.steps[static_cast<long>(time.to) * n.vertices + vertex] -
           n.steps[static_cast<long>(time.from) * n.vertices + vertex];
  };
  const Vector3<int> corners = n.corners[slot];
  const Place move = (1 - nearest.b - nearest.c) * moved(corners.x) + nearest.b * moved(corners.y) +
                     nearest.c * moved(corners.z);
  return {distance, direction, n.steps_per_second * dot(direction, move)};
}

/// A warp finds the foot of a point: first in the group whose box is nearest, then in all whose boxes are
/// nearer than what was found.
__global__ void __launch_bounds__(warp* warps) search_kernel(const __grid_constant__ FeetNumbers n) {
  const int point = warp_number(), slots = n.groups * group_triangles;
  if (point >= n.points) return;
  const Surface surface = surface_at(n, n.surface_of[point]);
  const Place q = place_from(n.surface_from_cloud, n.cloud[point]);

  Owned box = {INFINITY, lane()};
  for (int group = lane(); group < n.groups; group += warp)
    if (const double outside = box_distance2(surface, n.groups, group, q); outside < box.value)
      box = {outside, group};
  const int first = least_of_warp(box).owner;

  Owned mine = {distance2(surface, slots, first * group_triangles + lane(), q),
                first * group_triangles + lane()};
  double best = least_of_warp(mine.value);
  for (int base = 0; base < n.groups; base += warp) {
    double outside = base + lane() == first ? INFINITY : box_distance2(surface, n.groups, base + lane(), q);
    while (const unsigned nearer = __ballot_sync(all_lanes, outside < best)) {
      const int at = __ffs(static_cast<int>(nearer)) - 1;
      if (lane() == at) outside = INFINITY;
      const int slot = (base + at) * group_triangles + lane();
      if (const double found = distance2(surface, slots, slot, q); found < mine.value) mine = {found, slot};
      best = least_of_warp(mine.value);
    }
  }
  const int slot = least_of_warp(mine).owner;
  const SurfaceFoot foot = foot_of(n, surface, slot, n.times[n.surface_of[point]], q);
  if (lane() == 0) n.feet[point] = foot;
}

unsigned blocks_for(int count) { return static_cast<unsigned>((count + warps - 1) / warps); }

}  // namespace

void place_and_search(const FeetNumbers& numbers, cudaStream_t stream) {
  if (numbers.points == 0) return;
  place_kernel<<<dim3(blocks_for(numbers.groups), static_cast<unsigned>(numbers.surfaces)), warp * warps, 0,
                 stream>>>(numbers);
  search_kernel<<<blocks_for(numbers.points), warp * warps, 0, stream>>>(numbers);
  check(cudaGetLastError());
}

}  // namespace flash::sim::cuda
