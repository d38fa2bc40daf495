#include "sim/newton/solver_memory.h"

#include <algorithm>
#include <cmath>

#include "sim/newton/solver.h"

namespace flash::sim {

double solver_bytes(const Sheet& sheet) {
  constexpr double solid_bytes_per_vertex = 750;  // over the cube root of the number of vertices
  const auto vertices = static_cast<double>(sheet.rest.vertices.rows());
  const double solid = has_solids(sheet) ? solid_bytes_per_vertex * std::cbrt(vertices) : 0;
  return vertices * std::max(solver_bytes_per_vertex, solid);
}

}  // namespace flash::sim
