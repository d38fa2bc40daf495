// How far tetrahedra lock: the tip of a cantilever under its own weight against Timoshenko's, over
// Poisson's ratio and cells through the thickness. For `make locking`.
#include <cmath>
#include <cstdio>
#include <vector>

#include "data/mesh/procedural_mesh.h"
#include "sim/newton/solver.h"
#include "sim/scene/solid.h"

namespace flash::sim {
namespace {

constexpr double length = 0.5, side = 0.1, youngs_modulus = 1e6, density = 10, gravity = 9.81;

/// How far the end goes down in the mean [m]; negative where the last step was not solved.
double drop_of_tip(int cells, double nu, data::ElementOrder order) {
  const Sheet beam = make_solid(data::tet_box({length, side, side}, {5 * cells, cells, cells}), {}, order);
  Environment environment;
  environment.solids[0] = {.youngs_modulus = youngs_modulus, .poissons_ratio = nu, .density = density};
  environment.gravity = {0, 0, -gravity};
  environment.state.positions = beam.rest.vertices;
  environment.state.velocities = data::Points::Zero(beam.rest.vertices.rows(), 3);
  std::vector<int> clamped, end;
  for (int i = 0; i < static_cast<int>(beam.rest.vertices.rows()); ++i) {
    if (beam.rest.vertices(i, 0) < 1e-9) clamped.push_back(i);
    if (beam.rest.vertices(i, 0) > length - 1e-9) end.push_back(i);
  }
  environment.holds = {{.vertices = clamped}};
  Solver solver(beam, {.time_step = 1.0, .tolerance = 1e-5});
  bool converged = true;
  for (int step = 0; step < 4; ++step) {
    converged = solver.step(environment).converged;
    environment.state.velocities.setZero();
  }
  double drop = 0;
  for (const int i : end) drop += beam.rest.vertices(i, 2) - environment.state.positions(i, 2);
  return converged ? drop / static_cast<double>(end.size()) : -1;
}

/// w L^4 / (8 E I) + w L^2 / (2 kappa G A), with Cowper's kappa of a rectangle (1966).
double timoshenko(double nu) {
  const double area = side * side, inertia = area * area / 12, weight = density * gravity * area;
  const double kappa = 10 * (1 + nu) / (12 + 11 * nu), shear = youngs_modulus / (2 * (1 + nu));
  return weight * std::pow(length, 4) / (8 * youngs_modulus * inertia) +
         weight * length * length / (2 * kappa * shear * area);
}

void print_table(data::ElementOrder order, const std::vector<int>& cells) {
  std::printf("%6s", "nu");
  for (const int n : cells) std::printf("  %2d cells", n);
  std::printf("\n");
  for (const double nu : {0.0, 0.3, 0.4, 0.45, 0.49, 0.499}) {
    std::printf("%6.3f", nu);
    for (const int n : cells) {
      std::printf("  %8.3f", drop_of_tip(n, nu, order) / timoshenko(nu));
      std::fflush(stdout);
    }
    std::printf("\n");
  }
}

}  // namespace
}  // namespace flash::sim

int main() {
  using flash::data::ElementOrder;
  std::printf(
      "Tip of a square cantilever, five times as long as thick, under its own weight: over Timoshenko's,\n"
      "by Poisson's ratio and cells through the thickness. Strains are small: all laws but TET_ARAP "
      "agree.\n\nLinear tetrahedra:\n");
  flash::sim::print_table(ElementOrder::linear, {2, 4, 8, 16});
  std::printf("\nQuadratic ones, which have as many vertices with half of the cells:\n");
  flash::sim::print_table(ElementOrder::quadratic, {1, 2, 4, 8});
}
