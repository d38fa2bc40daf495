#pragma once
#include <functional>
#include <vector>

#include "data/mesh/procedural_mesh.h"
#include "sim/newton/solver.h"
#include "sim/scene/solid.h"

namespace flash::sim {

/// A box of tetrahedra from the origin to `size` [m].
inline Sheet solid_box(const Eigen::Vector3d& size, const Eigen::Vector3i& cells,
                       data::ElementOrder order = data::ElementOrder::linear) {
  return make_solid(data::tet_box(size, cells), {}, order);
}

/// A solid at rest in its rest shape, without obstacles or supports.
inline Environment solid_environment(const Sheet& sheet, const data::SolidMaterial& material) {
  Environment environment;
  environment.solids[0] = material;
  environment.state.positions = sheet.rest.vertices;
  environment.state.velocities = data::Points::Zero(sheet.rest.vertices.rows(), 3);
  return environment;
}

/// The vertices where `holds` is true of the rest position.
inline std::vector<int> vertices_where(const Sheet& sheet,
                                       const std::function<bool(const Eigen::Vector3d&)>& holds) {
  std::vector<int> vertices;
  for (int i = 0; i < static_cast<int>(sheet.rest.vertices.rows()); ++i)
    if (holds(sheet.rest.vertices.row(i).transpose())) vertices.push_back(i);
  return vertices;
}

/// The vertices on the plane where a coordinate at rest is `value`.
inline std::vector<int> face_of(const Sheet& sheet, int axis, double value) {
  return vertices_where(sheet, [&](const Eigen::Vector3d& x) { return std::abs(x[axis] - value) < 1e-9; });
}

/// A roller: the vertices are held along one axis, at `place` [m].
inline Hold roller(const Sheet& sheet, std::vector<int> vertices, int axis, double place) {
  Hold hold;
  hold.axes = {axis == 0, axis == 1, axis == 2};
  hold.targets = sheet.rest.vertices(vertices, Eigen::all);
  hold.targets.col(axis).setConstant(place);
  hold.vertices = std::move(vertices);
  return hold;
}

/// Long steps without velocity until no vertex moves: the equilibrium. Returns the last step's report.
inline StepReport settle(const Sheet& sheet, Environment& environment, double tolerance = 1e-8) {
  Solver solver(sheet, {.time_step = 1.0, .tolerance = tolerance});
  StepReport report;
  for (int step = 0; step < 40; ++step) {
    const data::Points before = environment.state.positions;
    report = solver.step(environment);
    environment.state.velocities.setZero();
    if ((environment.state.positions - before).rowwise().norm().maxCoeff() < 1e-12) break;
  }
  return report;
}

}  // namespace flash::sim
