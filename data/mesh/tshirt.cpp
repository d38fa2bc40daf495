#include "data/mesh/tshirt.h"

#include <algorithm>
#include <cmath>

#include "data/files/error.h"
#include "data/mesh/two_layers.h"

namespace flash::data {
namespace {

/// The cells of one layer: columns of the torso from 0 to `across`, those of the sleeves beside them,
/// `sleeve` on each side; rows from the hem up, of which sleeves have the upper `armhole`.
struct Cells {
  int across, up, sleeve, armhole;

  /// How many columns a place lies beyond the side of the torso.
  int beyond(int i) const { return std::max({-i, i - across, 0}); }

  bool has(int i, int j) const { return beyond(i) == 0 || j >= up - armhole; }
};

Cells cells_of(const TshirtMesh& s) {
  const auto count = [&](double length) { return static_cast<int>(std::lround(length / s.cell)); };
  // The middle is a column, for the neck to be even.
  return {2 * count(0.5 * s.width), count(s.length), count(s.sleeve), count(s.armhole)};
}

/// Where a column of the torso ends on top [m].
double top_at(const TshirtMesh& s, double x, bool front) {
  const double half = 0.5 * s.neck, beside = std::abs(x) - half;
  if (beside >= 0) return s.length - s.shoulder_drop * beside / (0.5 * s.width - half);
  return s.length - (front ? 1 : 1.0 / 3) * s.neck_depth * (1 - x * x / (half * half));
}

Eigen::Vector2d place_of(const TshirtMesh& s, const Cells& cells, int i, int j, bool front) {
  const double outwards = s.sleeve * cells.beyond(i) / cells.sleeve;
  const double inside = s.width * (static_cast<double>(std::clamp(i, 0, cells.across)) / cells.across - 0.5);
  return {inside + (i < 0 ? -outwards : outwards),
          top_at(s, inside, front) * j / cells.up - s.sleeve_slope * outwards};
}

/// Whether both layers share the vertex of a column and a row.
bool is_sewn(const TshirtMesh& s, const Cells& cells, int i, int j) {
  if (cells.beyond(i) > 0) return j == cells.up || j == cells.up - cells.armhole;
  if (j == cells.up) return 2 * std::abs(place_of(s, cells, i, j, true).x()) >= s.neck;
  return (i == 0 || i == cells.across) && j <= cells.up - cells.armhole;
}

}  // namespace

TriangleMesh tshirt(const TshirtMesh& s) {
  for (const double length : {s.width, s.length, s.sleeve, s.armhole, s.neck, s.apart, s.cell})
    if (!(length > 0)) throw InputError("mesh: a T-shirt needs sizes above zero");
  const Cells cells = cells_of(s);
  if (std::min({cells.across, cells.sleeve, cells.armhole}) < 4 || cells.up <= cells.armhole)
    throw InputError(
        "mesh: a T-shirt needs cells of at most a quarter of its sleeves, and armholes below its length");

  return two_layers({.first_column = -cells.sleeve,
                     .last_column = cells.across + cells.sleeve,
                     .last_row = cells.up,
                     .has = [&](int i, int j) { return cells.has(i, j); },
                     .is_sewn = [&](int i, int j) { return is_sewn(s, cells, i, j); },
                     .place = [&](int i, int j, bool front) { return place_of(s, cells, i, j, front); },
                     .apart = s.apart});
}

}  // namespace flash::data
