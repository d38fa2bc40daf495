// Compiled once for each instruction level, as sim/kernels.
#include "sim/law/lanes.h"
#include "sysid/replay/surface_tree.h"

namespace flash::sysid {
inline namespace FLASH_LEVEL {
namespace {

using sim::lane_count;
using sim::Lanes;
using sim::load_lanes;
using sim::select;
using sim::store_lanes;

Lanes clamped(const Lanes& x) {
  const Lanes zero{}, one = zero + 1.0;
  const Lanes positive = select(x < 0.0, zero, x);
  return select(positive > 1.0, one, positive);
}

/// Squared distances from `query` to the triangles from `first` on.
Lanes distances(const TrianglePacket& t, int first, const double* query) {
  const auto at = [first](const double* numbers) { return load_lanes(numbers + first); };
  const Lanes ex = at(t.e[0]), ey = at(t.e[1]), ez = at(t.e[2]);
  const Lanes fx = at(t.f[0]), fy = at(t.f[1]), fz = at(t.f[2]);
  const Lanes vx = query[0] - at(t.a[0]), vy = query[1] - at(t.a[1]), vz = query[2] - at(t.a[2]);
  const Lanes ve = vx * ex + vy * ey + vz * ez, vf = vx * fx + vy * fy + vz * fz;
  const Lanes vn = vx * at(t.n[0]) + vy * at(t.n[1]) + vz * at(t.n[2]);
  const Lanes ee = at(t.ee), ef = at(t.ef), ff = at(t.ff), zero{};
  const auto squared_length = [&](const Lanes& s, const Lanes& r) {  // of v - s e - r f
    const Lanes x = vx - s * ex - r * fx, y = vy - s * ey - r * fy, z = vz - s * ez - r * fz;
    return Lanes(x * x + y * y + z * z);
  };
  const Lanes on_e = squared_length(clamped(ve * at(t.inverse_ee)), zero);
  const Lanes on_f = squared_length(zero, clamped(vf * at(t.inverse_ff)));
  // Along g = f - e from b: (v - e) . g = vf - ve - ef + ee.
  const Lanes s = clamped((vf - ve - ef + ee) * at(t.inverse_gg));
  const Lanes on_g = squared_length(1.0 - s, s);
  const Lanes on_two = select(on_e < on_f, on_e, on_f);
  const Lanes on_edges = select(on_g < on_two, on_g, on_two);
  const Lanes inverse_determinant = at(t.inverse_determinant);
  const Lanes weight_b = (ff * ve - ef * vf) * inverse_determinant;
  const Lanes weight_c = (ee * vf - ef * ve) * inverse_determinant;
  const auto inside = (weight_b >= 0.0) & (weight_c >= 0.0) & (weight_b + weight_c <= 1.0);
  return select(inside, Lanes(vn * vn * inverse_determinant), on_edges);  // |n|^2 is the determinant
}

/// x / y where y is positive, else zero.
Lanes ratio(const Lanes& x, const Lanes& y) { return select(y > 0.0, Lanes(x / y), Lanes{}); }

double least_of(const double* numbers) {
  double least = numbers[0];
  for (int lane = 1; lane < surface_width; ++lane) least = numbers[lane] < least ? numbers[lane] : least;
  return least;
}
double most_of(const double* numbers) {
  double most = numbers[0];
  for (int lane = 1; lane < surface_width; ++lane) most = numbers[lane] > most ? numbers[lane] : most;
  return most;
}

void move_packet(const MovedSurface& surface, int index) {
  TrianglePacket& packet = surface.moved[index];
  const TriangleCorners& corners = surface.corners[index];
  BoxNode& node = surface.boxes[index / surface_width];
  alignas(64) double b[3][surface_width], c[3][surface_width], low[3][surface_width], high[3][surface_width];
  for (int lane = 0; lane < surface_width; ++lane)
    for (int k = 0; k < 3; ++k) {
      packet.a[k][lane] = surface.positions[3 * corners.of[0][lane] + k];
      b[k][lane] = surface.positions[3 * corners.of[1][lane] + k];
      c[k][lane] = surface.positions[3 * corners.of[2][lane] + k];
    }
  for (int first = 0; first < surface_width; first += lane_count) {
    Lanes e[3], f[3], g[3];
    for (int k = 0; k < 3; ++k) {
      const Lanes at = load_lanes(packet.a[k] + first), to_b = load_lanes(b[k] + first),
                  to_c = load_lanes(c[k] + first);
      e[k] = to_b - at;
      f[k] = to_c - at;
      g[k] = to_c - to_b;
      const Lanes lower = select(to_b < at, to_b, at), higher = select(to_b > at, to_b, at);
      store_lanes(e[k], packet.e[k] + first);
      store_lanes(f[k], packet.f[k] + first);
      store_lanes(select(to_c < lower, to_c, lower), low[k] + first);
      store_lanes(select(to_c > higher, to_c, higher), high[k] + first);
    }
    const auto product = [](const Lanes* u, const Lanes* v) {
      return Lanes(u[0] * v[0] + u[1] * v[1] + u[2] * v[2]);
    };
    const Lanes n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
    for (int k = 0; k < 3; ++k) store_lanes(n[k], packet.n[k] + first);
    const Lanes area2 = product(n, n), zero{}, one = zero + 1.0;
    const Lanes ee = product(e, e), ff = product(f, f);
    store_lanes(ee, packet.ee + first);
    store_lanes(ff, packet.ff + first);
    store_lanes(product(e, f), packet.ef + first);
    store_lanes(ratio(one, ee), packet.inverse_ee + first);
    store_lanes(ratio(one, ff), packet.inverse_ff + first);
    store_lanes(ratio(one, product(g, g)), packet.inverse_gg + first);
    store_lanes(select(area2 > 0.0, Lanes(one / area2), Lanes(zero + NAN)),
                packet.inverse_determinant + first);
  }
  for (int k = 0; k < 3; ++k) {
    node.low[k][index % surface_width] = least_of(low[k]);
    node.high[k][index % surface_width] = most_of(high[k]);
  }
}

void move(const MovedSurface& surface) {
  for (int packet = 0; packet < surface.packets; ++packet) move_packet(surface, packet);
}

void search_packet(const SurfaceTree& tree, int packet, const double* query, double& best, int& slot) {
  alignas(64) double distance2[surface_width];
  for (int first = 0; first < surface_width; first += lane_count)
    store_lanes(distances(tree.packets[packet], first, query), distance2 + first);
  for (int i = 0; i < surface_width; ++i) {
    if (distance2[i] < best) {
      best = distance2[i];
      slot = packet * surface_width + i;
    }
  }
}

void search(const SurfaceTree& tree, int level, int index, const double* query, double& best, int& slot) {
  const BoxNode& node = tree.levels[level][index];
  alignas(64) double distance2[surface_width];
  for (int first = 0; first < surface_width; first += lane_count) {
    Lanes sum{};
    for (int k = 0; k < 3; ++k) {
      const Lanes below = load_lanes(node.low[k] + first) - query[k],
                  above = query[k] - load_lanes(node.high[k] + first);
      const Lanes farther = select(below > above, below, above);
      const Lanes outside = select(farther < 0.0, Lanes{}, farther);
      sum += outside * outside;
    }
    store_lanes(sum, distance2 + first);
  }
  // Few boxes are nearer than what was found by a hint.
  int near[surface_width], count = 0;
  for (int i = 0; i < surface_width; ++i) {
    near[count] = i;
    count += distance2[i] < best ? 1 : 0;
  }
  for (; count > 0; --count) {
    int at = 0;
    for (int i = 1; i < count; ++i)
      if (distance2[near[i]] < distance2[near[at]]) at = i;
    const int nearest = near[at];
    if (!(distance2[nearest] < best)) return;
    near[at] = near[count - 1];
    const int child = index * surface_width + nearest;
    if (level == 0)
      search_packet(tree, child, query, best, slot);
    else
      search(tree, level - 1, child, query, best, slot);
  }
}

}  // namespace

extern const SurfaceKernels surface_kernels;
const SurfaceKernels surface_kernels = {move, search_packet, search};

}  // namespace FLASH_LEVEL
}  // namespace flash::sysid
