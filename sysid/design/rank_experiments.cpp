#include "sysid/design/rank_experiments.h"

#include <algorithm>
#include <cmath>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"
#include "sysid/design/virtual_experiment.h"
#include "sysid/replay/replay_mesh.h"

namespace flash::sysid {
namespace {

/// The sheet of a recording on cells as large as rank_experiments takes.
data::Recording with_few_vertices(const data::Recording& recording) {
  // Vertices of an experiment that is ranked. Chosen: by what a ranking costs; not varied.
  constexpr Eigen::Index kMost = 500;
  constexpr double kFolds = 2;  // Of a cell, until there are few vertices. Work.
  data::Recording coarse = recording;
  while (coarse.mesh.vertices.rows() > kMost) {
    const std::string specification = scaled_cell(coarse.mesh_spec, kFolds);
    if (specification.empty()) break;
    try {
      coarse.mesh = data::parse_mesh_spec(specification);
    } catch (const data::InputError&) {  // the cell is larger than a side
      break;
    }
    coarse.mesh_spec = specification;
  }
  return coarse;
}

}  // namespace

std::vector<PlannedExperiment> rank_experiments(const std::vector<Replay>& replays,
                                                const PlanSettings& settings, const MotionStore& store,
                                                const std::function<void(const std::string&)>& told) {
  std::vector<PlannedExperiment> experiments;
  const auto add = [&](const std::string& name, const auto& replay) {
    if (told) told(name);
    try {
      experiments.push_back(plan_experiment(name, {replay()}, settings, &store));
    } catch (const data::InputError&) {  // it diverges, or this sheet cannot be grasped so
    }
  };
  for (const Replay& replay : replays)
    add(replay.recording.name + " again", [&]() -> const Replay& { return replay; });
  const Replay& first = replays.front();
  const data::Recording sheet = with_few_vertices(first.recording);
  const data::SheetMaterial material = candidate_at(settings.at, settings.grid).material;
  for (const char* const kind : virtual_experiments)
    add(kind, [&] {
      return virtual_experiment(kind, sheet, material,
                                {first.settings.solver, first.settings.threads, 1,
                                 first.settings.clamp_slopes, first.settings.self_contact});
    });
  std::stable_sort(experiments.begin(), experiments.end(),
                   [](const auto& one, const auto& other) { return one.bits > other.bits; });
  return experiments;
}

Eigen::MatrixXd covariance_of_draws(const std::vector<Axis>& axes, const Eigen::MatrixXd& draws) {
  std::vector<Eigen::Index> searched;
  Eigen::MatrixXd coordinates = draws;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    if (axes[k].logarithmic) coordinates.col(column) = draws.col(column).array().log();
    if (axes[k].values.size() > 1) searched.push_back(column);
  }
  coordinates = coordinates(Eigen::all, searched).eval();
  const Eigen::MatrixXd from_mean = coordinates.rowwise() - coordinates.colwise().mean();
  return from_mean.transpose() * from_mean / static_cast<double>(std::max<Eigen::Index>(1, draws.rows() - 1));
}

}  // namespace flash::sysid
