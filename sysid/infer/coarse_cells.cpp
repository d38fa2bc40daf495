#include "sysid/infer/coarse_cells.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "data/text.h"

namespace flash::sysid {

double typical_cell(const data::TriangleMesh& mesh) {
  double areas = 0, squares = 0;
  for (const auto triangle : mesh.triangles.rowwise()) {
    const Eigen::Vector3d a = mesh.vertices.row(triangle[0]), b = mesh.vertices.row(triangle[1]),
                          c = mesh.vertices.row(triangle[2]);
    const double area = 0.5 * (b - a).cross(c - a).norm();
    areas += area;
    squares += area * area;
  }
  return std::sqrt(4 / std::numbers::sqrt3 * squares / areas);
}

std::string coarse_cells_text(const std::vector<Replay>& replays, const ReplayCandidate& candidate) {
  constexpr double kMost = 0.4;  // of the radius
  if (candidate.solid) return "";
  double cell = 0, gravity = 0;
  for (const Replay& replay : replays) {
    if (!replay.recording.has_table) continue;
    cell = std::max(cell, typical_cell(replay.recording.mesh));
    gravity = replay.recording.gravity.norm();
  }
  const data::SheetMaterial& material = candidate.material;
  const double radius = std::cbrt(material.bending_rigidity / (material.areal_density * gravity));
  if (!(cell > kMost * radius)) return "";
  const auto mm = [](double length) { return data::format_short(std::round(1e3 * length)) + " mm"; };
  return "cells of " + mm(cell) + " are coarse for a sheet that leaves the table in a fold of about " +
         mm(radius) +
         ": friction may be off by a few percent more than its interval says. Search on cells of " +
         data::format_short(std::floor(1e3 * kMost * radius)) + " mm";
}

}  // namespace flash::sysid
