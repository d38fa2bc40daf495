#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/law/feasible_place.h"
#include "sim/step/contact_set.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// A part of the top of a plate.
struct Tile {
  Vector2d low, high;
};

constexpr double half_length = 0.3, half_width = 0.2;  // of the plate [m]
const Tile whole{{-half_length, -half_width}, {half_length, half_width}};

/// Numbers that are the same on every machine.
class Draw {
 public:
  explicit Draw(unsigned seed) : engine_(seed) {}
  double number(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  bool chance(double share) { return number(0, 1) < share; }
  int below(int count) { return static_cast<int>(engine_() % static_cast<unsigned long>(count)); }
  /// Of either sign, over the decades from 10^low to 10^high.
  double decades(double low, double high) {
    return (chance(0.5) ? 1 : -1) * std::pow(10.0, number(low, high));
  }

 private:
  std::mt19937_64 engine_;
};

/// Splits a tile again and again, across and along: seams, junctions of three and corners of four.
void split(const Tile& tile, int depth, Draw& draw, std::vector<Tile>& tiles) {
  if (depth == 0 || draw.chance(0.1)) {
    tiles.push_back(tile);
    return;
  }
  const double share = draw.chance(0.5) ? 0.5 : draw.number(0.2, 0.8);
  const int axis = draw.below(2);
  Tile first = tile, second = tile;
  first.high[axis] = second.low[axis] = tile.low[axis] + share * (tile.high[axis] - tile.low[axis]);
  split(first, depth - 1, draw, tiles);
  split(second, depth - 1, draw, tiles);
}

/// One of the 24 ways to put a box along the axes.
Eigen::Matrix3d turned_axes(int which) {
  constexpr int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  for (int column = 0; column < 3; ++column)
    turn(orders[which % 6][column], column) = (which / 6 >> column & 1) != 0 ? -1 : 1;
  if (turn.determinant() < 0) turn.col(0) *= -1;
  return turn;
}

/// A box whose top, at z = 0 of the plate's frame, is the tile.
Obstacle box_under(const Tile& tile, double thickness, const Isometry3d& plate, int turn) {
  const Vector2d middle = 0.5 * (tile.low + tile.high), extent = 0.5 * (tile.high - tile.low);
  const Eigen::Matrix3d axes = turned_axes(turn);
  const Vector3d half(extent.x(), extent.y(), 0.5 * thickness);
  Box box{.half_extents = (axes.transpose() * half).cwiseAbs()};
  box.pose = plate * Eigen::Translation3d(middle.x(), middle.y(), -0.5 * thickness) * Eigen::AngleAxisd(axes);
  return {box};
}

/// A plate whole, or in tiles that are flush on top, and a step of it.
struct Plate {
  Sheet sheet;
  Environment environment;
  ContactStep step() const { return {sheet, environment, 0.01, {.speed = 1}}; }
};

/// A way that starts over the plate, often over a seam or a corner, and ends below its top or above it.
struct Way {
  Vector3d start, end;  ///< in the frame of the plate [m]
};

Way draw_way(const std::vector<Tile>& tiles, Draw& draw) {
  const Tile& tile = tiles[static_cast<std::size_t>(draw.below(static_cast<int>(tiles.size())))];
  Way way;
  for (int axis = 0; axis < 2; ++axis) {
    const double place = draw.number(tile.low[axis], tile.high[axis]);
    way.start[axis] = draw.chance(0.35) ? tile.low[axis] : draw.chance(0.5) ? tile.high[axis] : place;
    if (draw.chance(0.6)) way.start[axis] += draw.decades(-10, -2);
  }
  way.start.z() = draw.chance(0.5) ? 0 : std::abs(draw.decades(-10, -2));
  way.end = way.start;
  way.end.z() = draw.chance(0.2) ? draw.number(0, 1e-3) : -std::abs(draw.decades(-8, -1.5));
  if (draw.chance(0.6)) {
    const double length = std::abs(draw.decades(-9, -2));
    const int eighth = draw.below(8);
    way.end.x() += length * std::round(std::cos(eighth * M_PI / 4));
    way.end.y() += length * std::round(std::sin(eighth * M_PI / 4));
  }
  return way;
}

bool ends_over_plate(const Way& way) {
  const Vector2d reach = way.start.head<2>().cwiseAbs().cwiseMax(way.end.head<2>().cwiseAbs());
  return reach.x() < half_length - 0.005 && reach.y() < half_width - 0.005;
}

TEST(FlushTilings, AWayEndsAsOverOnePlate) {
  int compared = 0;
  for (unsigned seed = 0; seed < 600; ++seed) {
    SCOPED_TRACE(seed);
    Draw draw(seed);
    const auto vector = [&] { return Vector3d(draw.number(-1, 1), draw.number(-1, 1), draw.number(-1, 1)); };
    const auto pose = [&](double shift, double angle) {
      return Isometry3d(Eigen::Translation3d(shift * vector()) *
                        Eigen::AngleAxisd(draw.number(-angle, angle), vector().normalized()));
    };
    const Isometry3d at_start = seed % 2 == 0 ? Isometry3d::Identity() : pose(1, M_PI);
    const bool moves = seed % 3 == 0;
    const Isometry3d at_end = moves ? pose(0.02, 0.1) * at_start : at_start;
    std::vector<Tile> tiles;
    split(whole, 1 + static_cast<int>(seed % 4), draw, tiles);

    const double thickness = draw.chance(0.3) ? 1e-3 : 0.1;
    Plate one, many;
    one.environment.obstacles = {box_under(whole, thickness, Isometry3d::Identity(), 0)};
    for (const Tile& tile : tiles)
      many.environment.obstacles.push_back(
          box_under(tile, thickness, Isometry3d::Identity(), draw.below(48)));
    std::vector<Way> ways;
    while (ways.size() < 200) ways.push_back(draw_way(tiles, draw));
    const auto place_ways = [&](Plate& plate) {
      plate.sheet.bodies = {{.vertex_count = static_cast<int>(ways.size())}};
      plate.environment.schedule = std::make_shared<const Schedule>(Schedule{0, 0.01, {{at_start, at_end}}});
      for (Obstacle& obstacle : plate.environment.obstacles) obstacle.frame = 0;
      plate.environment.state.positions.resize(static_cast<Eigen::Index>(ways.size()), 3);
      for (std::size_t n = 0; n < ways.size(); ++n)
        plate.environment.state.positions.row(static_cast<Eigen::Index>(n)) = at_start * ways[n].start;
    };
    place_ways(one);
    place_ways(many);
    const ContactStep over_one = one.step(), over_many = many.step();
    ContactRoom room(many.environment.obstacles.size());
    for (std::size_t n = 0; n < ways.size(); ++n) {
      if (!ends_over_plate(ways[n])) continue;
      const int i = static_cast<int>(n);
      const Vector3<double> end = vector3(Vector3d(at_end * ways[n].end));
      // What tells a way beside a seam from one in it: three micrometres.
      EXPECT_NEAR(clearance_of(over_many.view(), over_many.start(i), end),
                  clearance_of(over_one.view(), over_one.start(i), end), 3e-6)
          << n;
      const Vector3d place = at_end.inverse() * vector3d(projected_out(over_many.view(), over_many.start(i),
                                                                       nullptr, end, room));
      const Vector3d expected(ways[n].end.x(), ways[n].end.y(), std::max(ways[n].end.z(), 0.0));
      EXPECT_LT((place - expected).norm(), 3e-6) << n;
      ++compared;
    }
  }
  EXPECT_GT(compared, 40'000);
}

/// The sheet's vertices stand over seams and corners of a tiling by its own grid.
data::Points dropped_on(const Sheet& sheet, const std::vector<Obstacle>& boxes, const Vector3d& velocity,
                        double friction, double time_step) {
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = friction;
  environment.obstacles = boxes;
  environment.state.positions.col(2).array() += 0.002;
  environment.state.velocities.rowwise() = velocity.transpose();
  Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-6});
  for (int n = 0; n < static_cast<int>(std::lround(0.15 / time_step)); ++n) {
    EXPECT_TRUE(solver.step(environment).converged);
    EXPECT_GT(environment.state.positions.col(2).minCoeff(), -1e-9);
  }
  return environment.state.positions;
}

TEST(FlushTilings, ASheetRestsAsOnOnePlate) {
  constexpr int cells = 6;
  const Sheet sheet =
      make_sheet(data::rectangle({.width = 0.12, .height = 0.12, .cells_x = cells, .cells_y = cells}));
  for (unsigned seed = 0; seed < 24; ++seed) {
    SCOPED_TRACE(seed);
    Draw draw(1000 + seed);
    std::vector<Tile> tiles;
    split(whole, 4, draw, tiles);
    std::vector<Obstacle> boxes;
    for (Tile tile : tiles) {
      for (double* edge : {&tile.low.x(), &tile.low.y(), &tile.high.x(), &tile.high.y()})
        *edge = 0.02 * std::round(*edge / 0.02);
      if ((tile.high - tile.low).minCoeff() > 0)
        boxes.push_back(box_under(tile, 0.05, Isometry3d::Identity(), 0));
    }
    const Vector3d along = seed % 3 == 0 ? Vector3d(Vector3d::Zero())
                                         : Vector3d(draw.number(-0.5, 0.5), draw.number(-0.5, 0.5), 0);
    const double friction = seed % 2 == 0 ? 0 : 0.3, time_step = seed % 4 < 2 ? 0.01 : 0.005;
    const data::Points many = dropped_on(sheet, boxes, along, friction, time_step),
                       one = dropped_on(sheet, {box_under(whole, 0.05, Isometry3d::Identity(), 0)}, along,
                                        friction, time_step);
    // What forces out of balance by 1e-6 of the weight do in 0.15 s, twenty times over.
    EXPECT_LT((many - one).rowwise().norm().maxCoeff(), 4e-6);
  }
}

}  // namespace
}  // namespace flash::sim
