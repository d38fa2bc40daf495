#pragma once
#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "sysid/observe/score.h"

namespace flash::sysid {

/// A sheet rolled to a wavy cylinder that tightens and rises: an analytic surface without symmetry.
inline data::TriangleMesh flat_sheet(int cells) {
  return data::rectangle({.width = 0.4, .height = 0.3, .cells_x = cells, .cells_y = cells});
}

inline data::Points moving_sheet(const data::Points& rest, double t) {
  data::Points positions(rest.rows(), 3);
  for (Eigen::Index i = 0; i < rest.rows(); ++i) {
    const double u = rest(i, 0), v = rest(i, 1);
    const double angle = 3 * t * u + 0.4;
    positions.row(i) << u * std::cos(angle) + 0.03 * std::sin(9 * v), v + 0.1 * t * std::sin(5 * u + t),
        u * std::sin(angle) + 0.04 * std::cos(11 * u + 7 * v) + 0.3 * t * t;
  }
  return positions;
}

inline Motion moving_sheet_motion(const data::TriangleMesh& mesh, double step, int steps) {
  Motion motion{0, step, {}};
  for (int i = 0; i <= steps; ++i) motion.positions.push_back(moving_sheet(mesh.vertices, i * step));
  return motion;
}

}  // namespace flash::sysid
