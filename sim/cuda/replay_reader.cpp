#include "sim/cuda/replay_reader.h"

#include <algorithm>
#include <optional>

#include "sim/cuda/device_arena.h"
#include "sim/cuda/device_error.h"
#include "sim/cuda/pinned_array.h"
#include "sim/cuda/replay_memory.h"

namespace flash::sim::cuda {

/// Where numbers of one environment stand on the host.
struct ReplayReader::Memory {
  /// Environments of which so many are read sooner than memory is pinned.
  static constexpr int few = 256;

  const ReplayMemory& replay;
  std::size_t steps, holds, vertices, kept_steps, obstacles;
  std::optional<PinnedArray<Point>> pinned;
  std::vector<Point> pageable;
  Point* points = nullptr;  ///< positions, velocities and bristles
  ReplayStats* stats = nullptr;
  double *forces = nullptr, *kept = nullptr;

  explicit Memory(const ReplayMemory& of)
      : replay(of),
        steps(static_cast<std::size_t>(of.numbers.stats_each)),
        holds(static_cast<std::size_t>(of.numbers.hold_count)),
        vertices(of.size()),
        kept_steps(of.settings.kept_steps.size()),
        obstacles(static_cast<std::size_t>(of.numbers.most_obstacles_each)) {
    const std::size_t size = lay_out(nullptr) / sizeof(Point) + 1;
    try {
      if (of.count > few) pinned.emplace(size);
    } catch (const OutOfMemory&) {  // what a system lets be pinned is limited; other memory does as well
    }
    if (!pinned) pageable.resize(size);
    lay_out(reinterpret_cast<char*>(pinned ? pinned->data() : pageable.data()));
  }

  /// Returns the bytes that it takes.
  std::size_t lay_out(char* begin) {
    DeviceArena arena(begin);
    points = arena.take<Point>((2 + obstacles) * vertices);
    stats = arena.take<ReplayStats>(steps);
    forces = arena.take<double>(3 * steps * holds);
    kept = arena.take<double>(3 * kept_steps * vertices);
    return arena.used();
  }
};

ReplayReader::ReplayReader(const BatchReplay& replay) {
  replay.memory_->wait();
  memory_ = std::make_unique<Memory>(*replay.memory_);
}
ReplayReader::~ReplayReader() = default;

ReplayResult ReplayReader::read(int environment, double* kept) {
  Memory& m = *memory_;
  const ReplayMemory& replay = m.replay;
  use_device(replay.device);
  const auto e = static_cast<std::size_t>(environment);
  const auto fetch = [e](const auto& array, std::size_t each, auto* to) {
    if (each > 0)
      check(cudaMemcpyAsync(to, array.data() + e * each, each * sizeof(*to), cudaMemcpyDeviceToHost,
                            cudaStreamPerThread));
  };
  fetch(replay.stats, m.steps, m.stats);
  fetch(replay.hold_forces, 3 * m.steps * m.holds, m.forces);
  fetch(replay.kept, 3 * m.kept_steps * m.vertices, m.kept);
  fetch(replay.positions, m.vertices, m.points);
  fetch(replay.velocities, m.vertices, m.points + m.vertices);
  fetch(replay.bristles, m.obstacles * m.vertices, m.points + 2 * m.vertices);
  check(cudaStreamSynchronize(cudaStreamPerThread));

  ReplayResult result;
  result.stats = steps_of({m.stats, m.steps});
  result.hold_forces.assign(m.forces, m.forces + 3 * m.steps * m.holds);
  std::copy(m.kept, m.kept + 3 * m.kept_steps * m.vertices, kept);
  const auto size = static_cast<Eigen::Index>(m.vertices);
  result.positions.resize(size, 3);
  result.velocities.resize(size, 3);
  result.bristles.resize(replay.obstacle_counts[e] * size, 3);
  const std::vector<int>& order = replay.layout.order;
  put_points(m.points, order, result.positions);
  put_points(m.points + m.vertices, order, result.velocities);
  for (int k = 0; k < replay.obstacle_counts[e]; ++k)
    put_points(m.points + (2 + static_cast<std::size_t>(k)) * m.vertices, order,
               result.bristles.middleRows(k * size, size));
  return result;
}

}  // namespace flash::sim::cuda
