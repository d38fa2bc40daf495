#pragma once
#include <cmath>
#include <random>

#include "data/mesh/mesh.h"
#include "data/mesh/procedural_mesh.h"

namespace flash::data {

/// A sheet rolled about the y axis: the x of its points runs along a circle of `radius` [m], the middle of
/// `width` on top.
inline Points rolled(const Points& flat, double radius, double width) {
  Points points = flat;
  for (auto row : points.rowwise()) {
    const double angle = (row[0] - width / 2) / radius, r = radius + row[2];
    row << r * std::sin(angle), row[1], r * std::cos(angle);
  }
  return points;
}

/// A disc about the origin laid on a sphere of `radius` [m]: distances from the pole stay.
inline Points capped(const Points& flat, double radius) {
  Points points = flat;
  for (auto row : points.rowwise()) {
    const double r = std::hypot(row[0], row[1]), R = radius + row[2];
    const double share = r > 0 ? R * std::sin(r / radius) / r : 0;
    row << row[0] * share, row[1] * share, R * std::cos(r / radius);
  }
  return points;
}

/// Points spread evenly over a rectangle from the origin on, with normal noise of standard deviation `noise`
/// across it [m].
inline Points drawn_rectangle(double width, double height, int count, double noise, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> even;
  std::normal_distribution<double> normal;
  Points points(count, 3);
  for (auto row : points.rowwise())
    row << width * even(random), height * even(random), noise * normal(random);
  return points;
}

}  // namespace flash::data
