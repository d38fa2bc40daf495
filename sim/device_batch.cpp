#include "sim/device_batch.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "data/error.h"
#include "data/parallel.h"
#include "sim/cuda/most_obstacles.h"
#include "sim/cuda/most_vertices.h"
#include "sim/step/springs.h"
#ifdef FLASH_HAVE_CUDA
#include "sim/cuda/device_error.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/hold_motion.h"
#include "sim/cuda/replay_reader.h"
#include "sim/device_error.h"
#endif

namespace flash::sim {

std::string why_not_on_device(const Environment& environment) {
  if (!environment.solids.empty()) return "solids (element_type TETRAHEDRON) are simulated on the CPU alone";
  if (!environment.point_masses.empty()) return "point masses (attached_mass) are simulated on the CPU alone";
  if (environment.self_contact) return "self-contact (self_contact) is simulated on the CPU alone";
  if (std::any_of(environment.materials.begin(), environment.materials.end(),
                  [](const auto& material) { return std::isfinite(material.yield_curvature); }))
    return "bending that yields (yield_curvature) is simulated on the CPU alone";
  if (std::any_of(environment.materials.begin(), environment.materials.end(),
                  [](const auto& material) { return material.weave.is_of_membrane(); }))
    return "woven membranes (young_ratio, shear_ratio) are simulated on the CPU alone";
  if (environment.materials.size() > 1) return "several bodies in one environment";
  if (std::any_of(environment.obstacles.begin(), environment.obstacles.end(),
                  [](const Obstacle& obstacle) { return std::holds_alternative<Mesh>(obstacle.shape); }))
    return "obstacles of shape mesh are met on the CPU alone";
  if (environment.obstacles.size() > most_obstacles)
    return "more than " + std::to_string(most_obstacles) + " obstacles: found " +
           std::to_string(environment.obstacles.size());
  if (environment.state.positions.rows() > cuda::most_vertices)
    return "more than " + std::to_string(cuda::most_vertices) + " vertices: found " +
           std::to_string(environment.state.positions.rows());
  return {};
}

std::string why_not_on_device(const ProjectiveSettings& settings) {
  if (settings.acceleration != 0)
    return "the projective method runs without acceleration there: found a depth of " +
           std::to_string(settings.acceleration) + ", expected 0";
  if (settings.metric != ContactMetric::inertia)
    return "the projective method has the inertia metric there (LiteNonSmoothNewton); full and automatic are "
           "met on the CPU alone";
  return {};
}

namespace {

void check_on_device(const std::vector<Environment>& environments, const BatchSettings& settings) {
  if (settings.contacts)
    throw data::InputError(
        "--device cuda: forces of each contact and resultants of bodies (contacts) are told on the CPU "
        "alone");
  if (settings.projective)
    if (const std::string why = why_not_on_device(*settings.projective); !why.empty())
      throw data::InputError("--device cuda: " + why);
  for (const Environment& environment : environments)
    if (settings.projective && first_soft_hold(environment) != nullptr)
      throw data::InputError("--device cuda: the projective method knows rigid holds alone; use Newton's");
  for (const Environment& environment : environments)
    if (const std::string why = why_not_on_device(environment); !why.empty())
      throw data::InputError("--device cuda: " + why);
}

}  // namespace

#ifdef FLASH_HAVE_CUDA

namespace {

double time_step_of(const BatchSettings& settings) {
  return settings.projective ? settings.projective->time_step : settings.solver.time_step;
}

/// Environments of which devices gave no result, and what the first device said.
class Failures {
 public:
  void add(const std::string& why, const std::vector<int>& environments) {
    const std::scoped_lock lock(mutex_);
    if (environments_.empty()) why_ = why;
    environments_.insert(environments_.end(), environments.begin(), environments.end());
  }
  bool has(int environment) const {
    return std::find(environments_.begin(), environments_.end(), environment) != environments_.end();
  }
  void throw_any() const {
    if (!environments_.empty())
      throw DeviceError(why_, std::vector<std::size_t>(environments_.begin(), environments_.end()));
  }

 private:
  std::mutex mutex_;
  std::string why_;
  std::vector<int> environments_;
};

/// Environments that run together: over which steps, and which.
struct Group {
  int first, count;
  std::vector<int> environments;
};

/// The groups of environments that stand at the step `at` of each, up to the step `end`.
std::vector<Group> grouped(const SheetPlan& plan, const std::vector<Environment>& environments,
                           const std::vector<int>& at, int end, const BatchSettings& settings) {
  std::map<std::tuple<const BendingOperator*, int, int>, std::vector<int>> groups;
  for (std::size_t e = 0; e < environments.size(); ++e) {
    if (at[e] >= end) continue;
    const data::SheetMaterial& material = environments[e].materials[0];
    const BendingOperator& bending = bending_operator(plan, material);
    // A factor of the projective method goes with what is held.
    const auto steps_alike =
        settings.projective ? cuda::steps_before_a_hold_changes : cuda::steps_before_a_hold_closes;
    const int count = steps_alike(environments[e], time_step_of(settings), end - at[e]);
    groups[{&bending, at[e], count}].push_back(static_cast<int>(e));
  }
  std::vector<Group> all;
  for (auto& [key, members] : groups) all.push_back({std::get<1>(key), std::get<2>(key), std::move(members)});
  // Results come in the order of the environments.
  std::sort(all.begin(), all.end(),
            [](const Group& a, const Group& b) { return a.environments[0] < b.environments[0]; });
  return all;
}

cuda::ReplaySettings settings_of(const BatchSettings& settings, int first, int count) {
  cuda::ReplaySettings own;
  own.time_step = time_step_of(settings);
  own.max_iterations = settings.solver.max_iterations;
  own.tolerance = settings.solver.tolerance;
  own.stale_factor_solves = settings.solver.stale_factor_solves;
  own.exit_speed = settings.solver.exit_speed;
  own.halvings = settings.solver.halvings;
  if (settings.projective) {
    own.projective = settings.projective;
    own.tolerance = settings.projective->tolerance;
    own.precision = settings.half_factor ? cuda::InversePrecision::half : cuda::InversePrecision::single;
    own.threads = settings.threads;
    own.restart_interval = restart_interval;
  }
  own.first_step = first;
  own.steps = first + count;
  for (const int step : settings.kept_steps)
    if (step > first && step <= first + count) own.kept_steps.push_back(step);
  return own;
}

/// Environments of a group as the device takes them; `held`: what their holds have at its end.
std::vector<cuda::ReplayEnvironment> replay_environments(const Group& group, const BatchSettings& settings,
                                                         const std::vector<Environment>& environments,
                                                         std::vector<std::vector<HeldVertices>>& held) {
  const std::size_t count = group.environments.size();
  const auto at = [&](std::size_t k) -> const Environment& {
    return environments[static_cast<std::size_t>(group.environments[k])];
  };
  std::vector<std::shared_ptr<const cuda::HoldMotion>> motions(count);
  std::vector<std::shared_ptr<const cuda::SpringMotions>> springs(count);
  held.resize(count);
  data::for_each_in_parallel(count, settings.threads, [&](std::size_t k) {
    springs[k] = cuda::motion_of_springs(at(k), time_step_of(settings), group.count);
    Environment moved = at(k);
    motions[k] = std::make_shared<const cuda::HoldMotion>(
        cuda::motion_of_holds(moved, time_step_of(settings), group.count));
    held[k] = std::move(moved.state.held);
  });
  std::vector<cuda::ReplayEnvironment> replays;
  for (std::size_t k = 0; k < count; ++k) {
    // Most environments of a batch are held alike.
    if (k > 0 && *motions[k] == *motions[k - 1]) motions[k] = motions[k - 1];
    if (k > 0 && springs[k] && springs[k - 1] && *springs[k] == *springs[k - 1]) springs[k] = springs[k - 1];
    replays.push_back(cuda::replay_environment(at(k), motions[k], springs[k]));
  }
  return replays;
}

/// Readers of a replay that no thread uses at the moment.
class IdleReaders {
 public:
  explicit IdleReaders(const cuda::BatchReplay& replay) : replay_(replay) {}

  std::unique_ptr<cuda::ReplayReader> take() {
    {
      const std::scoped_lock lock(mutex_);
      if (!idle_.empty()) {
        auto reader = std::move(idle_.back());
        idle_.pop_back();
        return reader;
      }
    }
    return std::make_unique<cuda::ReplayReader>(replay_);
  }
  void give_back(std::unique_ptr<cuda::ReplayReader> reader) {
    const std::scoped_lock lock(mutex_);
    idle_.push_back(std::move(reader));
  }

 private:
  const cuda::BatchReplay& replay_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<cuda::ReplayReader>> idle_;
};

/// Takes what a reader has of environment e, its `in_replay`th, to the state at the end of the group.
void take_results(cuda::ReplayReader& reader, const Group& group, const BatchSettings& settings, int e,
                  int in_replay, State& state, const DeviceResults& results) {
  const std::vector<int>& kept = settings.kept_steps;
  const auto first = std::upper_bound(kept.begin(), kept.end(), group.first);
  const bool keeps = first != kept.end() && *first <= group.first + group.count;
  cuda::ReplayResult result =
      reader.read(in_replay, keeps ? results.kept_at(e, static_cast<int>(first - kept.begin())) : nullptr);
  std::vector<StepStats> stats;
  for (const cuda::ReplayStep& step : result.stats) {
    stats.push_back({step.residual, step.penetration_max, step.iterations, step.solves, step.factorizations,
                     step.substeps, step.converged});
    state.time += time_step_of(settings);
  }
  results.stepped({e, group.first, group.count, stats, result.hold_forces});
  state.positions = std::move(result.positions);
  state.velocities = std::move(result.velocities);
  state.bristles = std::move(result.bristles);
}

/// Runs a group, whose environments advance; `end`: the step at which they finish. Results are taken, and
/// used, by many threads: a search for scores may work on the device too.
void run(const std::shared_ptr<const SheetPlan>& plan, const Group& group, int end,
         const BatchSettings& settings, std::vector<Environment>& environments, const DeviceResults& results,
         Failures& failures) {
  std::vector<std::vector<HeldVertices>> held;
  cuda::BatchReplay replay(plan, replay_environments(group, settings, environments, held),
                           settings_of(settings, group.first, group.count));
  replay.advance(group.count);
  replay.synchronize(settings.solver.stop);
  if (settings.solver.stop != nullptr && *settings.solver.stop) throw data::Stopped();
  results.timed(replay.phase_ticks());
  IdleReaders readers(replay);
  data::for_each_in_parallel(group.environments.size(), settings.threads, [&](std::size_t k) {
    const int e = group.environments[k];
    State& state = environments[static_cast<std::size_t>(e)].state;
    try {
      auto reader = readers.take();
      take_results(*reader, group, settings, e, static_cast<int>(k), state, results);
      readers.give_back(std::move(reader));
      state.held = std::move(held[k]);
      if (group.first + group.count == end) results.finished(e);
    } catch (const cuda::DeviceError& error) {
      failures.add(error.what(), {e});
    } catch (const DeviceError& error) {
      failures.add(error.why(), {e});
    }
  });
}

/// Runs a group in parts that fit into the device's memory.
void run_in_waves(const std::shared_ptr<const SheetPlan>& plan, const Group& group, int end,
                  const BatchSettings& settings, std::vector<Environment>& environments,
                  const DeviceResults& results, Failures& failures) {
  std::size_t at_once = group.environments.size();
  for (std::size_t begin = 0; begin < group.environments.size();) {
    const std::size_t count = std::min(at_once, group.environments.size() - begin);
    const auto from = group.environments.begin() + static_cast<std::ptrdiff_t>(begin);
    const Group wave = {group.first, group.count, {from, from + static_cast<std::ptrdiff_t>(count)}};
    begin += count;
    try {
      run(plan, wave, end, settings, environments, results, failures);
    } catch (const cuda::OutOfMemory& error) {
      if (count == 1) {
        failures.add(error.what(), wave.environments);
        continue;
      }
      begin -= count;
      at_once = (count + 1) / 2;
    } catch (const cuda::DeviceError& error) {
      failures.add(error.what(), wave.environments);
    }
  }
}

/// Runs a group on all devices at the same time. Each takes every so many-th environment: neighbours in a
/// search take about as long.
void run_on_devices(const std::shared_ptr<const SheetPlan>& plan, const Group& group, int end,
                    const BatchSettings& settings, std::vector<Environment>& environments,
                    const DeviceResults& results, Failures& failures) {
  const std::vector<int> devices =
      settings.cuda_devices.empty() ? std::vector<int>{0} : settings.cuda_devices;
  const std::size_t count = std::min(devices.size(), group.environments.size());
  std::vector<Group> parts(count, Group{group.first, group.count, {}});
  for (std::size_t k = 0; k < group.environments.size(); ++k)
    parts[k % count].environments.push_back(group.environments[k]);
  data::for_each_in_parallel(count, static_cast<int>(count), [&](std::size_t part) {
    try {
      cuda::use_device(devices[part]);
    } catch (const cuda::DeviceError& error) {
      return failures.add(error.what(), parts[part].environments);
    }
    run_in_waves(plan, parts[part], end, settings, environments, results, failures);
  });
}

}  // namespace

void advance_on_device(const std::shared_ptr<const SheetPlan>& plan, std::vector<Environment>& environments,
                       const BatchSettings& settings, int first, int steps, const DeviceResults& results) {
  check_on_device(environments, settings);
  std::vector<int> at(environments.size(), first);
  const int end = first + steps;
  Failures failures;
  for (auto groups = grouped(*plan, environments, at, end, settings); !groups.empty();
       groups = grouped(*plan, environments, at, end, settings))
    for (const Group& group : groups) {
      run_on_devices(plan, group, end, settings, environments, results, failures);
      for (const int e : group.environments)
        at[static_cast<std::size_t>(e)] = failures.has(e) ? end : group.first + group.count;
    }
  failures.throw_any();
}

#else

void advance_on_device(const std::shared_ptr<const SheetPlan>&, std::vector<Environment>& environments,
                       const BatchSettings& settings, int, int, const DeviceResults&) {
  check_on_device(environments, settings);
  throw data::InputError("--device cuda: this program was built without CUDA");
}

#endif

}  // namespace flash::sim
