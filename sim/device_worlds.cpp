#include "sim/device_worlds.h"

#include <algorithm>
#include <utility>

#include "data/files/error.h"
#include "data/machine/parallel.h"
#ifdef FLASH_HAVE_CUDA
#include "sim/ask_device.h"
#include "sim/cuda/hold_motion.h"
#include "sim/cuda/mesh_order.h"
#include "sim/cuda/replay_reader.h"
#include "sim/device_copies.h"
#endif

namespace flash::sim {

#ifdef FLASH_HAVE_CUDA

namespace {

cuda::ReplaySettings settings_of(const WorldSettings& settings) {
  cuda::ReplaySettings own;
  own.time_step = settings.solver.time_step;
  own.max_iterations = settings.solver.max_iterations;
  own.tolerance = settings.solver.tolerance;
  own.stale_factor_solves = settings.solver.stale_factor_solves;
  own.exit_speed = settings.solver.exit_speed;
  own.halvings = settings.solver.halvings;
  own.restart_interval = settings.restart_interval;
  own.lost_residual = settings.lost_residual;
  return own;
}

std::vector<cuda::ReplayEnvironment> replay_environments(const std::vector<World>& worlds) {
  std::vector<cuda::ReplayEnvironment> all;
  for (const World& world : worlds) all.push_back(cuda::replay_environment(world.environment, nullptr));
  return all;
}

/// What moves a world by itself in its next steps.
struct NextSteps {
  int count = 0;
  std::shared_ptr<const cuda::HoldMotion> holds;
  std::shared_ptr<const cuda::SpringMotions> springs;
  std::shared_ptr<const Schedule> schedule;
  double time = 0;  ///< at which they start [s]
};

/// The poses of a driven world over its next steps, of which it has begun the first.
std::shared_ptr<const Schedule> poses_ahead(World& world, double time_step, int steps) {
  if (!world.driven || steps == 1) return world.environment.schedule;
  auto ahead = std::make_shared<Schedule>(*world.driven->schedule());
  double time = world.environment.state.time;
  for (int k = 1; k < steps; ++k) {
    time += time_step;
    world.driven->begin_step(time);
    for (std::size_t f = 0; f < ahead->frames.size(); ++f)
      ahead->frames[f].push_back(world.driven->schedule()->frames[f].back());
  }
  return ahead;
}

StepReport report_of(const cuda::ReplayStats& stats) {
  StepReport report;
  report.residual = stats.residual;
  report.penetration_max = stats.penetration;
  report.complementarity = stats.complementarity;
  report.kinetic = stats.kinetic;
  report.membrane = stats.membrane;
  report.bending = stats.bending;
  report.iterations = stats.iterations;
  report.solves = stats.solves;
  report.factorizations = stats.factorizations;
  report.substeps = stats.substeps;
  report.converged = stats.converged != 0;
  return report;
}

std::vector<Eigen::Vector3d> vectors_of(const double* numbers, std::size_t count) {
  std::vector<Eigen::Vector3d> vectors(count);
  for (std::size_t k = 0; k < count; ++k) vectors[k] = Eigen::Map<const Eigen::Vector3d>(numbers + 3 * k);
  return vectors;
}

class Stepper final : public DeviceWorlds {
 public:
  Stepper(std::shared_ptr<const SheetPlan> plan, std::vector<World>& worlds, const WorldSettings& settings)
      : worlds_(worlds),
        settings_(settings),
        memory_(std::move(plan), replay_environments(worlds), settings_of(settings)),
        readers_(memory_),
        is_here_(worlds.size(), 1) {
    for (const World& world : worlds) count_frames(world);
    memory_.tables.reserve(settings.steps_at_once, settings.positions_at_once);
  }

  void step(int count, std::span<const int> shown, const std::function<void(int)>& seen,
            const std::function<void(int)>& ended) override {
    if (count == 0)
      for (int e = 0; e < size(); ++e)
        if (ended) ended(e);
    std::vector<int> left(worlds_.size(), count);
    while (std::any_of(left.begin(), left.end(), [](int steps) { return steps > 0; })) {
      const std::vector<NextSteps> next = plan_steps(left);
      run(next, shown);
      for_each_world([&](int e) {
        const auto own = static_cast<std::size_t>(e);
        if (left[own] == 0) return;
        left[own] -= take_results(e, next[own].count, shown, seen);
        // One that is lost stays where it is.
        for (; worlds_[own].lost != Lost::no && left[own] > 0; --left[own]) {
          skip_step(worlds_[own]);
          if (seen) seen(e);
        }
        if (left[own] == 0 && ended) ended(e);
      });
    }
  }

  void write_state(int environment) override {
    const State& state = world(environment).environment.state;
    ask_device([&] { memory_.write_state(environment, state.positions, state.velocities, state.bristles); });
    is_here(environment) = 1;
  }

  void write_velocities(int environment) override {
    ask_device(
        [&] { memory_.write_velocities(environment, world(environment).environment.state.velocities); });
  }

  void write_environment(int environment) override {
    ask_device([&] {
      memory_.write_environment(cuda::replay_environment(world(environment).environment, nullptr),
                                environment);
    });
  }

  void forget_solver(int environment) override {
    ask_device([&] { memory_.forget_solver(environment); });
  }

  void read_state(int environment) override {
    if (is_here(environment) != 0) return;
    ask_device([&] {
      auto reader = readers_.take();
      cuda::ReplayState read = reader->read_state(environment);
      readers_.give_back(std::move(reader));
      State& state = world(environment).environment.state;
      state.positions = std::move(read.positions);
      state.velocities = std::move(read.velocities);
      state.bristles = std::move(read.bristles);
    });
    is_here(environment) = 1;
  }

  std::vector<char> save(int environment) override {
    read_state(environment);
    return ask_device([&] { return memory_.save(environment); });
  }

  void load(int environment, const std::vector<char>& saved) override {
    write_environment(environment);
    ask_device([&] { memory_.load(environment, saved); });
    count_frames(world(environment));
    is_here(environment) = 1;
  }

  const double* positions() override { return ordered(positions_, memory_.positions); }
  const double* velocities() override { return ordered(velocities_, memory_.velocities); }

  const double* copy_of(std::span<const double> numbers) override { return copies_.of(numbers); }

  void renew() override {
    ask_device([&] {
      cuda::use_device(memory_.device);
      if (positions_.size() > 0) put_in_order(positions_, memory_.positions);
      if (velocities_.size() > 0) put_in_order(velocities_, memory_.velocities);
      cuda::check(cudaStreamSynchronize(cudaStreamPerThread));
    });
    copies_.renew();
  }

  void take_views(DeviceWorlds& before) override {
    auto& other = static_cast<Stepper&>(before);
    positions_ = std::move(other.positions_);
    velocities_ = std::move(other.velocities_);
    renew();
  }

  std::vector<double> phase_ticks() override {
    std::vector<double> ticks = ask_device([&] { return memory_.phase_ticks(); });
    const std::vector<double> before = std::exchange(ticks_before_, ticks);
    for (std::size_t k = 0; k < before.size(); ++k) ticks[k] -= before[k];
    return ticks;
  }

 private:
  int size() const { return static_cast<int>(worlds_.size()); }
  World& world(int e) { return worlds_[static_cast<std::size_t>(e)]; }
  char& is_here(int e) { return is_here_[static_cast<std::size_t>(e)]; }
  double time_step() const { return settings_.solver.time_step; }

  void count_frames(const World& of) {
    if (of.plan) frames_ = std::max(frames_, static_cast<int>(of.plan->frames.size()));
  }

  template <class Act>
  void for_each_world(const Act& act) const {
    data::for_each_in_parallel(worlds_.size(), settings_.threads,
                               [&](std::size_t e) { act(static_cast<int>(e)); });
  }

  /// The next steps of a world, at most so many: up to where another hold takes vertices from where they are
  /// then.
  NextSteps next_steps(int e, int most) {
    World& own = world(e);
    NextSteps next;
    if (own.lost != Lost::no) return next;
    goes_on(own, [&] {
      Environment& environment = own.environment;
      const auto misses = [](bool may_miss) { return may_miss; };
      if (cuda::closes_next(environment, time_step()) ||
          std::any_of(own.may_miss.begin(), own.may_miss.end(), misses))
        read_state(e);
      begin_step(own);
      const int count = cuda::steps_before_a_hold_closes(environment, time_step(), most);
      next.time = environment.state.time;
      next.schedule = environment.schedule = poses_ahead(own, time_step(), count);
      next.springs = cuda::motion_of_springs(environment, time_step(), count);
      next.holds =
          std::make_shared<const cuda::HoldMotion>(cuda::motion_of_holds(environment, time_step(), count));
      if (own.driven) environment.schedule = own.driven->schedule();
      next.count = count;
    });
    return next;
  }

  std::vector<NextSteps> plan_steps(const std::vector<int>& left) {
    std::vector<NextSteps> next(worlds_.size());
    for_each_world([&](int e) {
      const auto own = static_cast<std::size_t>(e);
      if (left[own] > 0) next[own] = next_steps(e, left[own]);
    });
    // Most environments of a batch are held alike.
    for (std::size_t e = 1; e < next.size(); ++e) {
      NextSteps &own = next[e], &before = next[e - 1];
      if (own.count == 0 || before.count == 0) continue;
      if (*own.holds == *before.holds) own.holds = before.holds;
      if (own.springs && before.springs && *own.springs == *before.springs) own.springs = before.springs;
    }
    return next;
  }

  void run(const std::vector<NextSteps>& next, std::span<const int> shown) {
    cuda::StepPlan plan;
    plan.kept_steps.assign(shown.begin(), shown.end());
    plan.flat.frames = frames_;
    for (std::size_t e = 0; e < next.size(); ++e) {
      plan.begins.push_back(static_cast<int>(worlds_[e].steps));
      plan.ends.push_back(plan.begins.back() + next[e].count);
    }
    const int most = plan.most_steps();
    if (most == 0) return;
    for (const NextSteps& own : next)
      plan.motions.push_back(
          own.count == 0 ? 0
                         : plan.flat.add({own.holds.get(), own.springs.get(), own.schedule.get(), own.time},
                                         time_step(), most, memory_.front_plan.position));
    ask_device([&] {
      memory_.run(plan);
      memory_.tables.fetch(memory_.stream);
      memory_.wait(settings_.solver.stop);
    });
    if (settings_.solver.stop != nullptr && *settings_.solver.stop) throw data::Stopped();
    for (std::size_t e = 0; e < next.size(); ++e)
      if (next[e].count > 0) is_here_[e] = 0;
  }

  /// Takes what the device says of so many steps of a world. Returns how many it has taken. Whoever sees a
  /// step is given what is here.
  int take_results(int e, int count, std::span<const int> shown, const std::function<void(int)>& seen) {
    World& own = world(e);
    State& state = own.environment.state;
    const std::size_t holds = own.environment.holds.size(), obstacles = own.environment.obstacles.size();
    const cuda::ReplayStats* stats = memory_.tables.stats(e);
    const double *of_holds = memory_.tables.hold_forces(e), *of_obstacles = memory_.tables.obstacle_forces(e);
    int taken = 0;
    if (count == 0) return taken;
    is_here(e) = 1;
    for (; taken < count && own.lost == Lost::no; ++taken) {
      const auto row = static_cast<std::size_t>(taken);
      StepReport report = report_of(stats[row]);
      memory_.tables.note_work(e, stats[row].work());
      report.hold_forces = vectors_of(of_holds + 3 * row * holds, holds);
      report.obstacle_forces = vectors_of(
          of_obstacles + 3 * row * static_cast<std::size_t>(memory_.most_obstacles_each), obstacles);
      const double start = state.time;
      state.time += time_step();
      end_step(own, settings_, std::move(report), start, true);
      if (const auto at = std::lower_bound(shown.begin(), shown.end(), own.steps);
          at != shown.end() && *at == own.steps)
        read_shown(e, static_cast<int>(at - shown.begin()));
      if (seen) seen(e);
    }
    is_here(e) = 0;
    return taken;
  }

  void read_shown(int e, int index) {
    ask_device([&] {
      auto reader = readers_.take();
      reader->read_kept(e, index, 1, world(e).environment.state.positions.data());
      readers_.give_back(std::move(reader));
    });
  }

  const double* ordered(cuda::DeviceArray<double>& to, const cuda::DeviceArray<cuda::Point>& from) {
    return ask_device([&] {
      cuda::use_device(memory_.device);
      if (to.size() == 0) {
        to = cuda::DeviceArray<double>(3 * from.size());
        put_in_order(to, from);
        cuda::check(cudaStreamSynchronize(cudaStreamPerThread));
      }
      return static_cast<const double*>(to.data());
    });
  }

  /// In order with the default stream, on which others may still read: what steps does not wait for that.
  void put_in_order(const cuda::DeviceArray<double>& to, const cuda::DeviceArray<cuda::Point>& from) {
    cuda::put_in_mesh_order(from.data(), memory_.order.data(), memory_.layout.size, memory_.count, to.data(),
                            cudaStreamPerThread);
  }

  std::vector<World>& worlds_;
  const WorldSettings& settings_;
  cuda::ReplayMemory memory_;
  cuda::IdleReaders readers_;
  std::vector<char> is_here_;  ///< whether the state of a world is that of the device
  int frames_ = 0;             ///< of the schedules, at most
  cuda::DeviceArray<double> positions_, velocities_;
  DeviceCopies copies_{memory_.device};
  std::vector<double> ticks_before_;  ///< those that were asked for
};

}  // namespace

std::unique_ptr<DeviceWorlds> device_worlds(std::shared_ptr<const SheetPlan> plan, std::vector<World>& worlds,
                                            const WorldSettings& settings) {
  return ask_device([&] {
    cuda::use_device(settings.cuda_device);
    return std::make_unique<Stepper>(std::move(plan), worlds, settings);
  });
}

#else

std::unique_ptr<DeviceWorlds> device_worlds(std::shared_ptr<const SheetPlan>, std::vector<World>&,
                                            const WorldSettings&) {
  throw data::InputError("--device cuda: this program was built without CUDA");
}

#endif

}  // namespace flash::sim
