#include "sim/batch.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include "data/files/error.h"
#include "data/machine/parallel.h"
#include "sim/cuda/phase_clock.h"
#include "sim/device_error.h"
#include "sim/device_shares.h"
#include "sim/environment_checks.h"
#include "sim/step/resultants.h"
#include "sim/worlds.h"
#include "sim/zeroed_numbers.h"

namespace flash::sim {

using data::Points;

namespace {

void copy_wrenches(const std::vector<Wrench>& wrenches, double* to) {
  for (const Wrench& wrench : wrenches) {
    to = std::copy(wrench.force.data(), wrench.force.data() + 3, to);
    to = std::copy(wrench.torque.data(), wrench.torque.data() + 3, to);
  }
}

}  // namespace

/// The worlds of environments of a batch on one device.
struct DeviceShare {
  std::vector<int> members;  ///< their numbers in the batch
  std::optional<Worlds> worlds;
};

struct Batch::Storage {
  std::shared_ptr<const SheetPlan> plan;
  BatchSettings settings;
  std::optional<Worlds> worlds;  ///< on the processor
  // On devices:
  std::vector<Environment> environments;
  std::vector<double> positions, velocities;
  std::vector<DeviceShare> shares;
  std::vector<Lost> lost;
  std::vector<std::string> why_lost;

  int step = 0;
  std::ptrdiff_t count = 0, vertices = 0, holds = 0, bodies = 0, obstacles = 0;
  std::vector<double> hold_forces;
  ZeroedNumbers kept;
  std::vector<StepStats> stats;
  std::vector<std::vector<ContactForce>> contacts;
  std::vector<double> body_resultants, obstacle_resultants;
  std::vector<double> phase_ticks;  ///< of devices
  std::mutex of_ticks;

  std::ptrdiff_t steps() const { return settings.steps - settings.first_step; }

  const State& state(int e) const {
    return worlds ? worlds->environment(e).state : environments[static_cast<std::size_t>(e)].state;
  }

  double* kept_at(std::ptrdiff_t e, std::ptrdiff_t index) {
    return kept.data() + (e * static_cast<std::ptrdiff_t>(settings.kept_steps.size()) + index) * 3 * vertices;
  }

  /// Keeps the positions of environment e where they are wanted.
  void keep(int e, int at, const Points& x) {
    const auto& wanted = settings.kept_steps;
    const auto found = std::lower_bound(wanted.begin(), wanted.end(), at);
    if (found == wanted.end() || *found != at) return;
    std::copy(x.data(), x.data() + x.size(), kept_at(e, found - wanted.begin()));
  }

  /// Copies the state of environment e of a device to where all are side by side.
  void show(int e) {
    const State& at = state(e);
    std::copy(at.positions.data(), at.positions.data() + 3 * vertices, positions.data() + e * 3 * vertices);
    std::copy(at.velocities.data(), at.velocities.data() + 3 * vertices,
              velocities.data() + e * 3 * vertices);
  }

  void add_ticks(std::span<const double> ticks) {
    const std::scoped_lock lock(of_ticks);
    phase_ticks.resize(ticks.size());
    for (std::size_t k = 0; k < ticks.size(); ++k) phase_ticks[k] += ticks[k];
  }

  /// Keeps what the step from `before` of environment e was like, number `own` of the worlds.
  void take(const Worlds& from, int own, int e, int before) {
    const StepReport& report = from.report(own);
    const std::ptrdiff_t place = e * steps() + before - settings.first_step;
    stats[place] = {report.residual,       report.penetration_max, report.iterations, report.solves,
                    report.factorizations, report.substeps,        report.converged};
    for (std::ptrdiff_t k = 0; k < holds; ++k)
      std::copy(report.hold_forces[k].data(), report.hold_forces[k].data() + 3,
                hold_forces.data() + (place * holds + k) * 3);
    keep(e, before + 1, from.environment(own).state.positions);
  }

  /// Keeps that environment e, which is lost, does not take the step from `before`.
  void skip(int e, int before) {
    stats[e * steps() + before - settings.first_step].residual = std::numeric_limits<double>::infinity();
    keep(e, before + 1, state(e).positions);
  }

  /// Keeps the contacts of the last step of environment e, and their sums.
  void keep_contacts(int e) {
    contacts[e] = worlds->contacts(e);
    const Resultants sums =
        resultants_of(contacts[e], static_cast<std::size_t>(bodies), static_cast<std::size_t>(obstacles));
    copy_wrenches(sums.bodies, body_resultants.data() + 6 * e * bodies);
    copy_wrenches(sums.obstacles, obstacle_resultants.data() + 6 * e * obstacles);
  }

  /// Takes the next steps of all environments on the processor, of each to the end before another begins on
  /// its thread: its numbers stay near.
  void advance_on_processor(int before, int steps_further, const std::function<void(int)>& finished) {
    const int end = before + steps_further;
    std::vector<int> at(static_cast<std::size_t>(count), before);  // the step at which each stands
    worlds->step(
        steps_further, [&](int e) { take(*worlds, e, e, at[static_cast<std::size_t>(e)]++); },
        [&](int e) {
          if (settings.contacts && steps_further > 0) keep_contacts(e);
          if (end == settings.steps) worlds->drop_solver(e);
          if (finished) finished(e);
        });
  }

  std::vector<int> devices() const {
    return settings.cuda_devices.empty() ? std::vector<int>{0} : settings.cuda_devices;
  }

  /// The kept steps from `before` on up to `end`.
  std::span<const int> kept_between(int before, int end) const {
    const std::vector<int>& all = settings.kept_steps;
    return {std::upper_bound(all.begin(), all.end(), before), std::upper_bound(all.begin(), all.end(), end)};
  }

  /// The worlds of environments that are not lost, as they stand, with memory for steps up to `end`.
  DeviceShare make_share(const std::vector<int>& part, int cuda_device, int before, int end) const {
    DeviceShare share;
    std::vector<Environment> own;
    for (const int e : part) {
      if (lost[static_cast<std::size_t>(e)] != Lost::no) continue;
      share.members.push_back(e);
      own.push_back(environments[static_cast<std::size_t>(e)]);
    }
    if (own.empty()) return share;
    share.worlds.emplace(
        plan, std::move(own),
        WorldSettings{.solver = settings.solver,
                      .projective = settings.projective,
                      .first_step = before,
                      .threads = settings.threads,
                      .device = Device::cuda,
                      .cuda_device = cuda_device,
                      .steps_at_once = end - before,
                      .positions_at_once = static_cast<int>(kept_between(before, end).size())});
    return share;
  }

  /// Takes the next steps of the worlds of a device. Adds to the failures those that did not come to the end.
  void advance_share(DeviceShare& share, int before, int end, DeviceFailures& failures,
                     const std::function<void(int)>& finished) {
    std::vector<int> at(share.members.size(), before);
    std::vector<char> done(share.members.size(), 0);
    const auto member = [&](int own) { return share.members[static_cast<std::size_t>(own)]; };
    try {
      share.worlds->step(
          end - before,
          [&](int own) { take(*share.worlds, own, member(own), at[static_cast<std::size_t>(own)]++); },
          [&](int own) {
            const int e = member(own);
            const auto place = static_cast<std::size_t>(e);
            environments[place].state = share.worlds->environment(own).state;
            lost[place] = share.worlds->lost(own);
            why_lost[place] = share.worlds->why_lost(own);
            show(e);
            done[static_cast<std::size_t>(own)] = 1;
            if (finished) finished(e);
          },
          kept_between(before, end));
      add_ticks(share.worlds->phase_ticks());
    } catch (const DeviceError& error) {
      std::vector<int> others;
      for (std::size_t own = 0; own < done.size(); ++own)
        if (done[own] == 0) others.push_back(share.members[own]);
      if (others.size() == done.size()) throw;
      failures.add(error.why(), others);
    }
  }

  /// Takes the next steps of all environments on devices. Where a device has room for its whole share, that
  /// stays there.
  void advance_on_devices(int before, int steps_further, const std::function<void(int)>& finished) {
    const int end = before + steps_further;
    const std::vector<int> numbers = devices();
    shares.resize(numbers.size());
    std::vector<int> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), 0);
    DeviceFailures failures;
    share_out(numbers.size(), all, failures, [&](std::size_t device, const std::vector<int>& part) {
      DeviceShare& share = shares[device];
      if (!share.worlds || share.members != part) {
        share = {};  // so that both need not fit
        share = make_share(part, numbers[device], before, end);
        for (const int e : part) {
          if (lost[static_cast<std::size_t>(e)] == Lost::no) continue;
          for (int k = before; k < end; ++k) skip(e, k);
          if (finished) finished(e);
        }
      }
      if (share.worlds) advance_share(share, before, end, failures, finished);
    });
    if (end == settings.steps) shares.clear();
    failures.throw_any();
  }

  void advance_on_device(int before, int steps_further, const std::function<void(int)>& finished) {
    if (settings.solver.stop != nullptr && *settings.solver.stop) throw data::Stopped();
    if (settings.contacts)
      throw data::InputError(
          "--device cuda: forces of each contact and resultants of bodies (contacts) are told on the CPU "
          "alone");
    advance_on_devices(before, steps_further, finished);
  }
};

namespace {

void check(const BatchSettings& settings) {
  const auto require = [](bool met, const char* what) {
    if (!met) throw std::invalid_argument(what);
  };
  require(settings.first_step >= 0 && settings.steps >= settings.first_step,
          "batch: the steps have to ascend from first_step to steps");
  const std::vector<int>& kept = settings.kept_steps;
  require(std::adjacent_find(kept.begin(), kept.end(), std::greater_equal<>()) == kept.end(),
          "batch: kept_steps have to ascend");
  require(kept.empty() || (kept.front() >= settings.first_step && kept.back() <= settings.steps),
          "batch: kept_steps have to lie between first_step and steps");
}

/// A view of densely stored numbers, the last index fastest.
View<double> dense(const double* numbers, std::vector<std::ptrdiff_t> shape) {
  View<double> view{numbers, std::move(shape), {}};
  view.strides.resize(view.shape.size());
  std::ptrdiff_t stride = 1;
  for (std::size_t k = view.shape.size(); k-- > 0; stride *= view.shape[k]) view.strides[k] = stride;
  return view;
}

}  // namespace

Batch::Batch(std::shared_ptr<const SheetPlan> plan, std::vector<Environment> environments,
             BatchSettings settings)
    : storage_(std::make_unique<Storage>()) {
  check(settings);
  Storage& s = *storage_;
  s.plan = std::move(plan);
  s.settings = std::move(settings);
  s.step = s.settings.first_step;
  s.count = std::ssize(environments);
  s.vertices = s.plan->pattern.size;
  s.holds = environments.empty() ? 0 : std::ssize(environments.front().holds);
  s.kept = ZeroedNumbers(3 * s.count * s.vertices * s.settings.kept_steps.size());
  s.stats.resize(s.count * s.steps());
  s.hold_forces.resize(3 * s.holds * s.stats.size());
  s.contacts.resize(s.count);
  if (s.settings.contacts) {
    s.bodies = std::ssize(s.plan->bodies);
    for (const Environment& environment : environments)
      s.obstacles = std::max(s.obstacles, std::ssize(environment.obstacles));
    s.body_resultants.resize(6 * s.count * s.bodies);
    s.obstacle_resultants.resize(6 * s.count * s.obstacles);
  }
  if (s.settings.device == Device::cpu) {
    s.worlds.emplace(s.plan, std::move(environments),
                     WorldSettings{.solver = s.settings.solver,
                                   .projective = s.settings.projective,
                                   .first_step = s.settings.first_step,
                                   .threads = s.settings.threads});
  } else {
    check_environments(*s.plan, environments);
    s.environments = std::move(environments);
    s.positions.resize(3 * s.count * s.vertices);
    s.velocities.resize(3 * s.count * s.vertices);
    s.lost.resize(s.count, Lost::no);
    s.why_lost.resize(s.count);
    for (int e = 0; e < size(); ++e) s.show(e);
  }
  for (int e = 0; e < size(); ++e) s.keep(e, s.step, s.state(e).positions);
}

Batch::~Batch() = default;
Batch::Batch(Batch&&) noexcept = default;

int Batch::size() const { return static_cast<int>(storage_->count); }
int Batch::step() const { return storage_->step; }

void Batch::advance(int steps, const std::function<void(int)>& finished) {
  Storage& s = *storage_;
  if (s.step < 0) throw std::invalid_argument("batch: it cannot advance after it has thrown");
  if (steps < 0 || steps > s.settings.steps - s.step)
    throw std::invalid_argument("batch: it cannot advance beyond its last step");
  const int first = std::exchange(s.step, -1);
  if (s.worlds)
    s.advance_on_processor(first, steps, finished);
  else
    s.advance_on_device(first, steps, finished);
  s.step = first + steps;
}

Lost Batch::lost(int environment) const {
  const Storage& s = *storage_;
  return s.worlds ? s.worlds->lost(environment) : s.lost[static_cast<std::size_t>(environment)];
}

std::string Batch::why_lost(int environment) const {
  const Storage& s = *storage_;
  return s.worlds ? s.worlds->why_lost(environment) : s.why_lost[static_cast<std::size_t>(environment)];
}

const State& Batch::state(int environment) const { return storage_->state(environment); }

View<double> Batch::positions() const {
  const Storage& s = *storage_;
  return dense(s.worlds ? static_cast<const double*>(s.worlds->positions().data) : s.positions.data(),
               {size(), s.vertices, 3});
}

View<double> Batch::velocities() const {
  const Storage& s = *storage_;
  return dense(s.worlds ? static_cast<const double*>(s.worlds->velocities().data) : s.velocities.data(),
               {size(), s.vertices, 3});
}

View<double> Batch::kept_positions() const {
  const Storage& s = *storage_;
  return dense(s.kept.data(), {size(), std::ssize(s.settings.kept_steps), s.vertices, 3});
}

View<double> Batch::hold_forces() const {
  const Storage& s = *storage_;
  return dense(s.hold_forces.data(), {size(), s.steps(), s.holds, 3});
}

std::span<const StepStats> Batch::stats(int environment) const {
  const auto steps = static_cast<std::size_t>(storage_->steps());
  return std::span(storage_->stats).subspan(environment * steps, steps);
}

std::span<const ContactForce> Batch::contacts(int environment) const {
  return storage_->contacts[environment];
}

View<double> Batch::body_resultants() const {
  return dense(storage_->body_resultants.data(), {size(), storage_->bodies, 6});
}

View<double> Batch::obstacle_resultants() const {
  return dense(storage_->obstacle_resultants.data(), {size(), storage_->obstacles, 6});
}

std::vector<PhaseShare> Batch::phases() const {
  const std::vector<double>& ticks = storage_->phase_ticks;
  const double all = std::accumulate(ticks.begin(), ticks.end(), 0.0);
  std::vector<PhaseShare> shares;
  for (std::size_t k = 0; k < ticks.size(); ++k)
    shares.push_back({cuda::replay_phase_names[k], ticks[k] / all});
  return shares;
}

Eigen::Map<const Points> Batch::kept_positions(int environment, int index) const {
  return {storage_->kept_at(environment, index), storage_->vertices, 3};
}

void replay_in_batches(const std::shared_ptr<const SheetPlan>& plan, std::size_t count, int at_once,
                       const BatchSettings& settings,
                       const std::function<Environment(std::size_t)>& environment_of,
                       const std::function<void(std::size_t, const Batch&, int)>& finished) {
  if (at_once <= 0) throw std::invalid_argument("batch: at least one environment has to run at once");
  for (std::size_t first = 0; first < count; first += at_once) {
    std::vector<Environment> environments(std::min(count - first, static_cast<std::size_t>(at_once)));
    data::for_each_in_parallel(environments.size(), settings.threads,
                               [&](std::size_t e) { environments[e] = environment_of(first + e); });
    Batch batch(plan, std::move(environments), settings);
    try {
      batch.advance(settings.steps - settings.first_step, [&](int e) { finished(first + e, batch, e); });
    } catch (const DeviceError& error) {
      throw error.renumbered([first](std::size_t e) { return first + e; });
    }
  }
}

}  // namespace flash::sim
