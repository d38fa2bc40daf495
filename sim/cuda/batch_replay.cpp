#include "sim/cuda/batch_replay.h"

#include <chrono>
#include <thread>

#include "sim/cuda/replay_checks.h"
#include "sim/cuda/replay_memory.h"

namespace flash::sim::cuda {

using data::Points;

BatchReplay::BatchReplay(std::shared_ptr<const SheetPlan> plan,
                         const std::vector<ReplayEnvironment>& environments, ReplaySettings settings) {
  check_replay(*plan, environments, settings);
  memory_ = std::make_unique<ReplayMemory>(*plan, environments, std::move(settings));
}
BatchReplay::~BatchReplay() = default;
BatchReplay::BatchReplay(BatchReplay&&) noexcept = default;

int BatchReplay::size() const { return memory_->count; }
int BatchReplay::step() const { return memory_->step; }
int BatchReplay::teams() const { return memory_->teams; }
int BatchReplay::team_blocks() const { return memory_->team_blocks; }
void BatchReplay::advance(int steps) { memory_->advance(steps); }
void BatchReplay::synchronize(const std::atomic<bool>* stop) {
  const ReplayMemory& m = *memory_;
  while (stop != nullptr && !*stop && cudaStreamQuery(m.stream) == cudaErrorNotReady)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (stop != nullptr && *stop) *m.stop = 1;
  m.wait();
}

Points BatchReplay::positions(int environment) const {
  return memory_->points(memory_->positions, static_cast<std::size_t>(environment));
}
Points BatchReplay::velocities(int environment) const {
  return memory_->points(memory_->velocities, static_cast<std::size_t>(environment));
}
Points BatchReplay::bristles(int environment) const {
  const ReplayMemory& m = *memory_;
  const int obstacles = m.obstacle_counts[static_cast<std::size_t>(environment)];
  Points all(static_cast<Eigen::Index>(obstacles) * m.layout.size, 3);
  for (int k = 0; k < obstacles; ++k)
    all.middleRows(static_cast<Eigen::Index>(k) * m.layout.size, m.layout.size) =
        m.points(m.bristles, static_cast<std::size_t>(environment) * m.numbers.most_obstacles_each +
                                 static_cast<std::size_t>(k));
  return all;
}

Points BatchReplay::kept_positions(int environment, int index) const {
  const ReplayMemory& m = *memory_;
  m.wait();
  const std::size_t place =
      static_cast<std::size_t>(environment) * m.settings.kept_steps.size() + static_cast<std::size_t>(index);
  Points positions(m.layout.size, 3);
  m.kept.read(place * 3 * m.size(), 3 * m.size(), positions.data());
  return positions;
}

std::vector<double> BatchReplay::hold_forces(int environment) const {
  const ReplayMemory& m = *memory_;
  m.wait();
  const std::size_t each =
      3 * static_cast<std::size_t>(m.numbers.stats_each) * static_cast<std::size_t>(m.numbers.hold_count);
  return m.hold_forces.read(static_cast<std::size_t>(environment) * each, each);
}

std::vector<double> BatchReplay::phase_ticks() const {
  const ReplayMemory& m = *memory_;
  m.wait();
  if (m.projection) return m.projection->phase_ticks();
  std::vector<double> ticks(replay_phases, 0.0);
  for (const TeamMemory& team : m.team_memory.read(0, m.team_memory.size())) {
    long long clocks[replay_phases];
    copy_to_end(clocks, team.clocks, sizeof(clocks), cudaMemcpyDeviceToHost);
    for (int k = 0; k < replay_phases; ++k)
      ticks[static_cast<std::size_t>(k)] += static_cast<double>(clocks[k]);
  }
  return ticks;
}

std::vector<ReplayStep> BatchReplay::stats(int environment) const {
  const ReplayMemory& m = *memory_;
  m.wait();
  const auto each = static_cast<std::size_t>(m.numbers.stats_each);
  return steps_of(m.stats.read(static_cast<std::size_t>(environment) * each, each));
}

}  // namespace flash::sim::cuda
