#include "data/mesh/shorts.h"

#include <algorithm>
#include <cmath>

#include "data/files/error.h"
#include "data/mesh/two_layers.h"

namespace flash::data {
namespace {

constexpr int between = 2;  // columns between the legs

/// The cells of one layer: columns of the left leg, those between, those of the right leg; rows from the hem
/// up, of which legs have the lower `crotch` by themselves.
struct Cells {
  int leg, up, crotch;

  int across() const { return 2 * leg + between; }
  bool has(int i, int j) const { return i <= leg || i >= leg + between || j >= crotch; }
};

Eigen::Vector2d place_of(const ShortsMesh& s, const Cells& cells, int i, int j, bool front) {
  const double column = s.leg / cells.leg, x = column * (i - 0.5 * cells.across());
  const double half = 0.5 * column * cells.across();
  const double dip = (front ? 1 : 1.0 / 3) * s.waist_dip * (1 - x * x / (half * half));
  const double below = std::max(0.0, s.length - s.rise - s.length * j / cells.up);
  const int outwards = i <= cells.leg ? -1 : i >= cells.leg + between ? 1 : 0;
  return {x + outwards * s.splay * below, (s.length - dip) * j / cells.up};
}

/// Whether both layers share the vertex of a column and a row.
bool is_sewn(const Cells& cells, int i, int j) {
  if (i == 0 || i == cells.across()) return true;
  const bool inner = i == cells.leg || i == cells.leg + between;
  return inner ? j <= cells.crotch : j == cells.crotch && i > cells.leg && i < cells.leg + between;
}

}  // namespace

TriangleMesh shorts(const ShortsMesh& s) {
  for (const double length : {s.leg, s.length, s.rise, s.apart, s.cell})
    if (!(length > 0)) throw InputError("mesh: shorts need sizes above zero");
  const auto count = [&](double length) { return static_cast<int>(std::lround(length / s.cell)); };
  const int up = count(s.length);
  const Cells cells{count(s.leg), up, up - count(s.rise)};
  if (cells.leg < 4 || cells.crotch < 2 || cells.crotch >= cells.up)
    throw InputError("mesh: shorts need cells of at most a quarter of a leg, and legs below the crotch");
  return two_layers({.last_column = cells.across(),
                     .last_row = cells.up,
                     .has = [&](int i, int j) { return cells.has(i, j); },
                     .is_sewn = [&](int i, int j) { return is_sewn(cells, i, j); },
                     .place = [&](int i, int j, bool front) { return place_of(s, cells, i, j, front); },
                     .apart = s.apart});
}

}  // namespace flash::data
