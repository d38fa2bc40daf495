#include "sim/projective_batch.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "data/files/error.h"
#include "data/machine/parallel.h"
#include "sim/device_limits.h"
#include "sim/step/springs.h"
#ifdef FLASH_HAVE_CUDA
#include "sim/ask_device.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/hold_motion.h"
#include "sim/cuda/replay_reader.h"
#include "sim/device_shares.h"
#endif

namespace flash::sim {

namespace {

void check_projective(const std::vector<Environment>& environments, const ProjectiveSettings& settings) {
  if (const std::string why = why_not_on_device(settings); !why.empty())
    throw data::InputError("--device cuda: " + why);
  for (const Environment& environment : environments)
    if (first_soft_hold(environment) != nullptr)
      throw data::InputError("--device cuda: the projective method knows rigid holds alone; use Newton's");
  for (const Environment& environment : environments)
    if (const std::string why = why_not_on_device(environment); !why.empty())
      throw data::InputError("--device cuda: " + why);
}

}  // namespace

#ifdef FLASH_HAVE_CUDA

namespace {

/// Environments that run together: over which steps, and which.
struct Group {
  int first, count;
  std::vector<int> environments;
};

/// Environments that stand before step `end`. Those of a group are as far, have the same bending operator,
/// and run until one of their holds changes: a factor goes with what is held.
std::vector<Group> grouped(const SheetPlan& plan, const std::vector<Environment>& environments,
                           const std::vector<int>& at, int end, double time_step) {
  std::map<std::tuple<const BendingOperator*, int, int>, std::vector<int>> groups;
  for (std::size_t e = 0; e < environments.size(); ++e) {
    if (at[e] >= end) continue;
    const BendingOperator& bending = bending_operator(plan, environments[e].materials[0]);
    const int count = cuda::steps_before_a_hold_changes(environments[e], time_step, end - at[e]);
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
  own.time_step = settings.projective->time_step;
  own.projective = settings.projective;
  own.tolerance = settings.projective->tolerance;
  own.precision = settings.half_factor ? cuda::InversePrecision::half : cuda::InversePrecision::single;
  own.threads = settings.threads;
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
  held.resize(count);
  data::for_each_in_parallel(count, settings.threads, [&](std::size_t k) {
    Environment moved = at(k);
    motions[k] = std::make_shared<const cuda::HoldMotion>(
        cuda::motion_of_holds(moved, settings.projective->time_step, group.count));
    held[k] = std::move(moved.state.held);
  });
  std::vector<cuda::ReplayEnvironment> replays;
  for (std::size_t k = 0; k < count; ++k) {
    // Most environments of a batch are held alike.
    if (k > 0 && *motions[k] == *motions[k - 1]) motions[k] = motions[k - 1];
    replays.push_back(cuda::replay_environment(at(k), motions[k]));
  }
  return replays;
}

/// Takes what a reader has of environment e, its `in_replay`th, to the state at the end of the group.
void take_results(const cuda::BatchReplay& replay, cuda::ReplayReader& reader, const Group& group,
                  const BatchSettings& settings, int e, int in_replay, State& state,
                  const DeviceResults& results) {
  const std::vector<int>& kept = settings.kept_steps;
  const auto first = std::upper_bound(kept.begin(), kept.end(), group.first);
  const auto count = std::upper_bound(first, kept.end(), group.first + group.count) - first;
  if (count > 0)
    reader.read_kept(in_replay, 0, static_cast<int>(count),
                     results.kept_at(e, static_cast<int>(first - kept.begin())));
  std::vector<StepStats> stats;
  for (const cuda::ReplayStep& step : replay.stats(in_replay)) {
    stats.push_back({step.residual, step.penetration_max, step.iterations, step.solves, step.factorizations,
                     step.substeps, step.converged});
    state.time += settings.projective->time_step;
  }
  results.stepped({e, group.first, group.count, stats, replay.hold_forces(in_replay)});
  cuda::ReplayState end = reader.read_state(in_replay);
  state.positions = std::move(end.positions);
  state.velocities = std::move(end.velocities);
  state.bristles = std::move(end.bristles);
}

/// Runs a group, whose environments advance; `end`: the step at which they finish. Results are taken, and
/// used, by many threads: a search for scores may work on the device too.
void run(const std::shared_ptr<const SheetPlan>& plan, const Group& group, int end,
         const BatchSettings& settings, std::vector<Environment>& environments, const DeviceResults& results,
         DeviceFailures& failures) {
  std::vector<std::vector<HeldVertices>> held;
  cuda::BatchReplay replay(plan, replay_environments(group, settings, environments, held),
                           settings_of(settings, group.first, group.count));
  replay.advance(group.count);
  replay.synchronize(settings.solver.stop);
  if (settings.solver.stop != nullptr && *settings.solver.stop) throw data::Stopped();
  results.timed(replay.phase_ticks());
  cuda::IdleReaders readers(replay);
  data::for_each_in_parallel(group.environments.size(), settings.threads, [&](std::size_t k) {
    const int e = group.environments[k];
    State& state = environments[static_cast<std::size_t>(e)].state;
    try {
      ask_device([&] {
        auto reader = readers.take();
        take_results(replay, *reader, group, settings, e, static_cast<int>(k), state, results);
        readers.give_back(std::move(reader));
      });
      state.held = std::move(held[k]);
      if (group.first + group.count == end) results.finished(e);
    } catch (const DeviceError& error) {
      failures.add(error.why(), {e});
    }
  });
}

}  // namespace

void advance_projective(const std::shared_ptr<const SheetPlan>& plan, std::vector<Environment>& environments,
                        const BatchSettings& settings, int first, int steps, const DeviceResults& results) {
  check_projective(environments, *settings.projective);
  const std::vector<int> devices =
      settings.cuda_devices.empty() ? std::vector<int>{0} : settings.cuda_devices;
  std::vector<int> at(environments.size(), first);
  const int end = first + steps;
  DeviceFailures failures;
  const auto next = [&] { return grouped(*plan, environments, at, end, settings.projective->time_step); };
  for (auto groups = next(); !groups.empty(); groups = next())
    for (const Group& group : groups) {
      share_out(
          devices.size(), group.environments, failures,
          [&](std::size_t device, const std::vector<int>& part) {
            ask_device([&] {
              cuda::use_device(devices[device]);
              run(plan, {group.first, group.count, part}, end, settings, environments, results, failures);
            });
          });
      for (const int e : group.environments)
        at[static_cast<std::size_t>(e)] = failures.has(e) ? end : group.first + group.count;
    }
  failures.throw_any();
}

#else

void advance_projective(const std::shared_ptr<const SheetPlan>&, std::vector<Environment>& environments,
                        const BatchSettings& settings, int, int, const DeviceResults&) {
  check_projective(environments, *settings.projective);
  throw data::InputError("--device cuda: this program was built without CUDA");
}

#endif

}  // namespace flash::sim
