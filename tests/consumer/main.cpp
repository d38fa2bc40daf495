#include <iostream>

#include "sim/solver.h"

int main() {
  flash::data::TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 1, 0.1, 0, 1, 0, 0.1, 1;
  mesh.triangles.resize(1, 3);
  mesh.triangles << 0, 1, 2;
  const flash::sim::Sheet sheet = flash::sim::make_sheet(mesh);
  flash::sim::Environment falling;
  falling.state.positions = mesh.vertices;
  falling.state.velocities = flash::data::Points::Zero(3, 3);
  const flash::sim::SolverSettings settings;
  const auto rollout = flash::sim::simulate(sheet, {falling}, 10, settings, 1).front();
  std::cout << rollout.positions.back()(0, 2) - 1.0 << '\n';
}
