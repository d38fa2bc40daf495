#include <iostream>

#include "sim/batch.h"

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
  flash::sim::Batch batch(flash::sim::make_sheet_plan(sheet), {falling}, {.steps = 10});
  batch.advance(10);
  std::cout << batch.state(0).positions(0, 2) - 1.0 << '\n';
}
