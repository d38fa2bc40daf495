#include "sysid/emulate/two_mesh_motions.h"

#include "data/machine/parallel.h"
#include "sysid/replay/surface_distance.h"

namespace flash::sysid {
namespace {

/// As `motion` on the other mesh; positions that are not kept stay empty.
Motion prolonged(const Motion& motion, const Eigen::SparseMatrix<double>& prolongation) {
  Motion result{motion.start, motion.step, {}, motion.forces};
  result.positions.reserve(motion.positions.size());
  for (const data::Points& positions : motion.positions)
    result.positions.emplace_back(positions.rows() > 0 ? data::Points(prolongation * positions)
                                                       : data::Points(0, 3));
  return result;
}

/// Empties the positions that no keyframe reads.
void keep_read(const Replay& replay, Motion& motion) {
  const std::vector<bool> read = steps_read(replay, motion.start, motion.step, motion.positions.size());
  for (std::size_t i = 0; i < read.size(); ++i)
    if (!read[i]) motion.positions[i].resize(0, 3);
}

/// At every point of a grid; empty where one diverged.
std::optional<std::vector<Motion>> motions_over(const Replay& replay, const std::vector<Axis>& axes,
                                                const GridSettings& grid, const MotionStore& store,
                                                const std::function<void()>& told) {
  const std::vector<std::vector<double>> points = cartesian_product(axes);
  std::vector<ReplayCandidate> candidates;
  for (const std::vector<double>& point : points) candidates.push_back(candidate_at(point, grid));
  std::vector<std::optional<Motion>> motions(points.size());
  store.run(replay, candidates, [&](std::size_t i, ReplayResult result) {
    keep_read(replay, result.motion);
    if (result.finite) motions[i] = std::move(result.motion);
    if (told) told();
  });
  std::vector<Motion> all;
  for (std::optional<Motion>& motion : motions) {
    if (!motion) return std::nullopt;
    all.push_back(std::move(*motion));
  }
  return all;
}

}  // namespace

std::vector<bool> steps_read(const Replay& replay, double start, double step, std::size_t count) {
  std::vector<bool> read(count, replay.recording.nuisance.time > 0);
  if (read.empty()) return read;
  read.front() = read.back() = true;
  for (const Observation& observation : replay.observations) {
    const double steps = (observation.t - start) / step;
    if (!(steps > 0) || steps >= static_cast<double>(count - 1)) continue;
    const auto below = static_cast<std::size_t>(steps);
    const double fraction = steps - static_cast<double>(below);
    if (fraction < 1 - kSameStep) read[below] = true;
    if (fraction > kSameStep) read[below + 1] = true;
  }
  return read;
}

void add(Motion& a, double share, const Motion& b) {
  for (std::size_t i = 0; i < a.positions.size(); ++i)
    if (a.positions[i].rows() > 0) a.positions[i] += share * b.positions[i];
  for (std::size_t i = 0; i < a.forces.size(); ++i) a.forces[i] += share * b.forces[i];
}

Eigen::SparseMatrix<double> prolongation(const data::TriangleMesh& from, const data::TriangleMesh& to) {
  const SurfaceDistance sheet(from.triangles, from.vertices);
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < to.vertices.rows(); ++i) {
    const SurfacePoint place = sheet.nearest(to.vertices.row(i).transpose());
    for (int k = 0; k < 3; ++k)
      if (place.barycentric[k] != 0)
        entries.emplace_back(static_cast<int>(i), from.triangles(place.triangle, k), place.barycentric[k]);
  }
  Eigen::SparseMatrix<double> matrix(to.vertices.rows(), from.vertices.rows());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

std::vector<Motion> TwoMeshMotions::at_points(const std::vector<std::vector<double>>& points, double share,
                                              int threads) const {
  if (!difference_) return coarse_.at_points(points, threads);
  const Eigen::MatrixXd of_coarse = coarse_.weights(points), of_difference = difference_->weights(points);
  std::vector<Motion> motions(points.size(), difference_->without_numbers());
  const std::size_t last = motions.front().positions.size();
  data::for_each_in_parallel(last + 1, threads, [&](std::size_t step) {
    Eigen::MatrixXd numbers = coarse_.numbers(step, of_coarse);
    if (step < last && numbers.rows() > 0) {
      Eigen::MatrixXd finer(3 * prolongation_->rows(), numbers.cols());
      for (Eigen::Index i = 0; i < numbers.cols(); ++i)
        Eigen::Map<data::Points>(finer.col(i).data(), prolongation_->rows(), 3) =
            *prolongation_ * Eigen::Map<const data::Points>(numbers.col(i).data(), numbers.rows() / 3, 3);
      numbers = std::move(finer);
    }
    if (share != 0 && numbers.rows() > 0) numbers += share * difference_->numbers(step, of_difference);
    for (std::size_t i = 0; i < points.size(); ++i)
      set_step(motions[i], step, numbers.col(static_cast<Eigen::Index>(i)));
  });
  return motions;
}

Motion TwoMeshMotions::at(const std::vector<double>& values, double share, int threads) const {
  return std::move(at_points({values}, share, threads).front());
}

Motion TwoMeshMotions::on_its_mesh(const Motion& motion) const {
  return prolongation_ ? prolonged(motion, *prolongation_) : motion;
}

MotionsAt motions_of(const std::vector<ModelledReplay>& models, double share) {
  return [&models, share](std::size_t r, const std::vector<std::vector<double>>& values) {
    std::vector<ReplayResult> results(values.size());
    std::vector<Motion> motions = models[r].model.at_points(values, share, models[r].replay.settings.threads);
    for (std::size_t i = 0; i < values.size(); ++i) {
      results[i].motion = std::move(motions[i]);
      results[i].converged = results[i].finite = true;
    }
    return results;
  };
}

std::vector<Axis> thinned(const std::vector<Axis>& axes) {
  std::vector<Axis> result = axes;
  for (Axis& axis : result) {
    if (axis.values.size() < 4) continue;
    std::vector<double> kept;
    for (std::size_t i = 0; i + 1 < axis.values.size(); i += 2) kept.push_back(axis.values[i]);
    kept.push_back(axis.values.back());
    axis.values = std::move(kept);
  }
  return result;
}

std::optional<MotionInterpolant> motion_interpolant(const Replay& replay, const GridSettings& grid,
                                                    const MotionStore& store,
                                                    const std::function<void()>& told) {
  const auto motions = motions_over(replay, grid.axes, grid, store, told);
  if (!motions) return std::nullopt;
  return MotionInterpolant(grid.axes, *motions, grid.threads);
}

std::optional<ModelledReplay> with_finer_mesh(const Replay& replay, const Replay& fine,
                                              const MotionInterpolant& motions, const std::vector<Axis>& axes,
                                              const GridSettings& grid, const MotionStore& store,
                                              const std::function<void()>& told) {
  auto differences = motions_over(fine, axes, grid, store, told);
  if (!differences) return std::nullopt;
  const auto matrix =
      std::make_shared<const Eigen::SparseMatrix<double>>(prolongation(replay.surface, fine.surface));
  const std::vector<std::vector<double>> points = cartesian_product(axes);
  data::for_each_in_parallel(points.size(), replay.settings.threads, [&](std::size_t i) {
    add((*differences)[i], -1, prolonged(motions.at(points[i]), *matrix));
  });
  return ModelledReplay{fine,
                        TwoMeshMotions(motions, MotionInterpolant(axes, *differences, grid.threads), matrix)};
}

}  // namespace flash::sysid
