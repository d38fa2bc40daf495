#include "sysid/replay/coarse_cells.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "data/files/text.h"
#include "sysid/replay/half_cell.h"

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

namespace {

/// That bends the sheet over the edge of its fold, by area; 0 where there is none [N/m^2].
double weight_on_table(const Replay& replay, const ReplayCandidate& candidate) {
  return candidate.solid || !replay.recording.has_table
             ? 0
             : candidate.material.areal_density * replay.recording.gravity.norm();
}

}  // namespace

double coarse_below(const Replay& replay, const ReplayCandidate& heaviest, double most) {
  const double weight = weight_on_table(replay, heaviest);
  return weight > 0 ? weight * std::pow(typical_cell(replay.recording.mesh) / most, 3) : 0;
}

std::optional<CoarseCells> coarse_cells(const std::vector<Replay>& replays, const ReplayCandidate& candidate,
                                        double most) {
  const data::SheetMaterial& material = candidate.material;
  for (const Replay& replay : replays) {
    const double weight = weight_on_table(replay, candidate);
    if (!(weight > 0 && material.bending_rigidity > 0)) continue;
    const CoarseCells cells = {typical_cell(replay.recording.mesh),
                               std::cbrt(material.bending_rigidity / weight)};
    if (cells.cell > most * cells.radius) return cells;
  }
  return std::nullopt;
}

namespace {

/// Of the cells of the search: those of an answer. Chosen: by what they cost, four times the vertices; not
/// varied.
constexpr double kLeast = 0.5;

std::string mm(double length) { return data::format_short(std::round(1e4 * length) / 10) + " mm"; }

}  // namespace

std::vector<Replay> on_cells_for_fold(const std::vector<Replay>& replays, const ReplayCandidate& candidate) {
  for (const Replay& replay : replays)
    if (replay.settings.self_contact) return {};
  const auto coarse = coarse_cells(replays, candidate, most_of_fold_of_answer);
  if (!coarse) return {};
  // Cells that shrink towards a grasp take less of a sheet, the smaller the others are: the typical one does
  // not fall by the factor. Work: a cap.
  constexpr int kTries = 4;
  double factor = std::max(kLeast, made_for_fold * coarse->radius / coarse->cell);
  std::vector<Replay> smaller = on_smaller_cells(replays, factor);
  for (int k = 1; k < kTries && factor > kLeast; ++k) {
    const auto still = coarse_cells(smaller, candidate, most_of_fold_of_answer);
    if (!still) break;
    factor = std::max(kLeast, factor * made_for_fold * still->radius / still->cell);
    smaller = on_smaller_cells(replays, factor);
  }
  return smaller;
}

std::string cells_for_fold_text(const std::vector<Replay>& replays, const std::vector<Replay>& smaller) {
  return "the answer is simulated on cells of " + mm(typical_cell(smaller.front().recording.mesh)) +
         ", not on those of " + mm(typical_cell(replays.front().recording.mesh)) +
         ", for the fold in which the sheet leaves the table";
}

std::string coarse_cells_text(const CoarseCells& coarse) {
  // Typical cell over that of a specification, of right triangles. Work: for a text.
  constexpr double kOfPattern = 1.08;
  return "cells of " + mm(coarse.cell) + " are coarse for a sheet that leaves the table in a fold of about " +
         mm(coarse.radius) +
         ": friction and bending may be off by a few percent more than is said of them. Search on cells "
         "of " +
         mm(most_of_fold * coarse.radius / kOfPattern);
}

}  // namespace flash::sysid
