#include "sim/cuda/batch_replay.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "sim/cuda/replay_checks.h"
#include "sim/cuda/replay_memory.h"

namespace flash::sim::cuda {

using data::Points;

struct BatchReplay::Replay {
  ReplayMemory memory;
  int step;

  Replay(std::shared_ptr<const SheetPlan> plan, const std::vector<ReplayEnvironment>& environments,
         const ReplaySettings& settings)
      : memory(std::move(plan), environments, settings), step(settings.first_step) {}
};

namespace {

/// All steps of a replay.
StepPlan whole(const std::vector<ReplayEnvironment>& environments, const ReplaySettings& settings,
               const std::vector<int>& position) {
  StepPlan plan;
  plan.begins.assign(environments.size(), settings.first_step);
  plan.ends.assign(environments.size(), settings.steps);
  plan.kept_steps = settings.kept_steps;
  for (const ReplayEnvironment& e : environments)
    if (e.schedule != nullptr)
      plan.flat.frames = std::max(plan.flat.frames, static_cast<int>(e.schedule->frames.size()));
  for (const ReplayEnvironment& e : environments)
    plan.motions.push_back(plan.flat.add({e.holds.get(), e.springs.get(), e.schedule.get(), e.time},
                                         settings.time_step, settings.steps - settings.first_step, position));
  return plan;
}

}  // namespace

BatchReplay::BatchReplay(std::shared_ptr<const SheetPlan> plan,
                         const std::vector<ReplayEnvironment>& environments, ReplaySettings settings) {
  check_replay(*plan, environments, settings);
  replay_ = std::make_unique<Replay>(plan, environments, settings);
  ReplayMemory& m = replay_->memory;
  m.open(whole(environments, settings, m.front_plan.position));
  m.keep_start(environments);
}
BatchReplay::~BatchReplay() = default;
BatchReplay::BatchReplay(BatchReplay&&) noexcept = default;

const ReplayMemory& BatchReplay::memory() const { return replay_->memory; }

int BatchReplay::size() const { return memory().count; }
int BatchReplay::step() const { return replay_->step; }
int BatchReplay::teams() const { return memory().teams; }
int BatchReplay::team_blocks() const { return memory().team_blocks; }

void BatchReplay::advance(int steps) {
  Replay& r = *replay_;
  require(steps >= 0 && steps <= r.memory.settings.steps - r.step, "it cannot advance beyond its last step");
  if (steps == 0) return;
  r.memory.wait();
  r.memory.go_on(r.step, r.step + steps);
  r.step += steps;
}

void BatchReplay::synchronize(const std::atomic<bool>* stop) { memory().wait(stop); }

Points BatchReplay::positions(int environment) const {
  return memory().points(memory().positions, static_cast<std::size_t>(environment));
}
Points BatchReplay::velocities(int environment) const {
  return memory().points(memory().velocities, static_cast<std::size_t>(environment));
}
Points BatchReplay::bristles(int environment) const {
  const ReplayMemory& m = memory();
  const int obstacles = m.obstacle_counts[static_cast<std::size_t>(environment)];
  Points all(static_cast<Eigen::Index>(obstacles) * m.layout.size, 3);
  for (int k = 0; k < obstacles; ++k)
    all.middleRows(static_cast<Eigen::Index>(k) * m.layout.size, m.layout.size) =
        m.points(m.bristles, static_cast<std::size_t>(environment) * m.numbers.most_obstacles_each +
                                 static_cast<std::size_t>(k));
  return all;
}

Points BatchReplay::kept_positions(int environment, int index) const {
  const ReplayMemory& m = memory();
  m.wait();
  Points positions(m.layout.size, 3);
  copy_to_end(positions.data(), m.tables.kept(environment, index), 3 * m.size() * sizeof(double),
              cudaMemcpyDeviceToHost);
  return positions;
}

std::vector<double> BatchReplay::hold_forces(int environment) const {
  const ReplayMemory& m = memory();
  m.wait();
  const std::size_t each =
      3 * static_cast<std::size_t>(m.numbers.stats_each) * static_cast<std::size_t>(m.numbers.hold_count);
  std::vector<double> forces(each);
  if (each > 0)
    copy_to_end(forces.data(), m.numbers.hold_forces + static_cast<std::size_t>(environment) * each,
                each * sizeof(double), cudaMemcpyDeviceToHost);
  return forces;
}

std::vector<double> BatchReplay::phase_ticks() const { return memory().phase_ticks(); }

std::vector<ReplayStep> BatchReplay::stats(int environment) const {
  const ReplayMemory& m = memory();
  m.wait();
  const auto each = static_cast<std::size_t>(m.numbers.stats_each);
  std::vector<ReplayStats> stats(each);
  if (each > 0)
    copy_to_end(stats.data(), m.numbers.stats + static_cast<std::size_t>(environment) * each,
                each * sizeof(ReplayStats), cudaMemcpyDeviceToHost);
  return steps_of(stats);
}

}  // namespace flash::sim::cuda
