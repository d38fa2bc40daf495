#include "sim/batch.h"

#include <algorithm>
#include <mutex>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include "data/error.h"
#include "data/parallel.h"
#include "sim/cuda/phase_clock.h"
#include "sim/cuda/projective_phases.h"
#include "sim/device_batch.h"
#include "sim/device_error.h"
#include "sim/step/resultants.h"
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

struct Batch::Storage {
  std::shared_ptr<const SheetPlan> plan;
  std::vector<Environment> environments;
  BatchSettings settings;
  std::vector<std::optional<Solver>> solvers;                       ///< of environments under way
  std::vector<std::optional<ProjectiveSolver>> projective_solvers;  ///< likewise
  int step = 0;
  std::ptrdiff_t vertices = 0, holds = 0, bodies = 0, obstacles = 0;
  std::vector<double> positions, velocities, hold_forces;
  ZeroedNumbers kept;
  std::vector<StepStats> stats;
  std::vector<std::vector<ContactForce>> contacts;
  std::vector<double> body_resultants, obstacle_resultants;
  std::vector<double> phase_ticks;  ///< of a device
  std::mutex of_ticks;

  std::ptrdiff_t steps() const { return settings.steps - settings.first_step; }

  double* kept_at(std::ptrdiff_t e, std::ptrdiff_t index) {
    return kept.data() + (e * static_cast<std::ptrdiff_t>(settings.kept_steps.size()) + index) * 3 * vertices;
  }

  /// Keeps the positions of environment e where they are wanted.
  void keep(int e, int at) {
    const auto& wanted = settings.kept_steps;
    const auto found = std::lower_bound(wanted.begin(), wanted.end(), at);
    if (found == wanted.end() || *found != at) return;
    const Points& x = environments[e].state.positions;
    std::copy(x.data(), x.data() + x.size(), kept_at(e, found - wanted.begin()));
  }

  /// Copies the state of environment e to where all are side by side.
  void show(int e) {
    const State& state = environments[e].state;
    std::copy(state.positions.data(), state.positions.data() + 3 * vertices,
              positions.data() + e * 3 * vertices);
    std::copy(state.velocities.data(), state.velocities.data() + 3 * vertices,
              velocities.data() + e * 3 * vertices);
  }

  /// Takes the next steps of all environments on the device.
  void advance_on_device(int before, int count, const std::function<void(int)>& finished) {
    DeviceResults results;
    results.stepped = [&](const DeviceSteps& taken) {
      const std::ptrdiff_t place = taken.environment * steps() + taken.first - settings.first_step;
      std::copy(taken.stats.begin(), taken.stats.end(), stats.begin() + place);
      std::copy(taken.hold_forces.begin(), taken.hold_forces.end(), hold_forces.begin() + 3 * place * holds);
    };
    results.kept_at = [&](int e, int index) { return kept_at(e, index); };
    results.timed = [&](std::span<const double> ticks) {
      const std::scoped_lock lock(of_ticks);
      phase_ticks.resize(ticks.size());
      for (std::size_t k = 0; k < ticks.size(); ++k) phase_ticks[k] += ticks[k];
    };
    results.finished = [&](int e) {
      show(e);
      if (finished) finished(e);
    };
    sim::advance_on_device(plan, environments, settings, before, count, results);
  }

  StepReport newton_step(int e, int before) {
    std::optional<Solver>& solver = solvers[e];
    if (!solver) solver.emplace(plan, settings.solver);
    if (before % restart_interval == 0) solver->forget();
    return solver->step(environments[e]);
  }

  StepReport projective_step(int e) {
    std::optional<ProjectiveSolver>& solver = projective_solvers[e];
    if (!solver) solver.emplace(plan, *settings.projective);
    return solver->step(environments[e]);
  }

  void take_step(int e, int before) {
    const StepReport report = settings.projective ? projective_step(e) : newton_step(e, before);
    const std::ptrdiff_t place = e * steps() + before - settings.first_step;
    stats[place] = {report.residual,       report.penetration_max, report.iterations, report.solves,
                    report.factorizations, report.substeps,        report.converged};
    for (std::ptrdiff_t k = 0; k < holds; ++k)
      std::copy(report.hold_forces[k].data(), report.hold_forces[k].data() + 3,
                hold_forces.data() + (place * holds + k) * 3);
    keep(e, before + 1);
  }

  /// Keeps the contacts of the last step of environment e, and their sums.
  void keep_contacts(int e) {
    const Environment& environment = environments[e];
    contacts[e] =
        solvers[e] ? solvers[e]->contacts(environment) : projective_solvers[e]->contacts(environment);
    const Resultants sums =
        resultants_of(contacts[e], static_cast<std::size_t>(bodies), static_cast<std::size_t>(obstacles));
    copy_wrenches(sums.bodies, body_resultants.data() + 6 * e * bodies);
    copy_wrenches(sums.obstacles, obstacle_resultants.data() + 6 * e * obstacles);
  }
};

namespace {

bool frames_exist(const Environment& environment) {
  const int frames = environment.schedule ? static_cast<int>(environment.schedule->frames.size()) : 0;
  const auto exists = [&](int frame) { return frame >= base_frame && frame < frames; };
  return std::all_of(environment.holds.begin(), environment.holds.end(),
                     [&](const Hold& hold) { return exists(hold.frame); }) &&
         std::all_of(environment.obstacles.begin(), environment.obstacles.end(),
                     [&](const Obstacle& obstacle) { return exists(obstacle.frame); });
}

bool solids_match(const SheetPlan& plan, const Environment& environment) {
  for (std::size_t b = 0; b < plan.bodies.size(); ++b)
    if (plan.bodies[b].body.is_solid() != (environment.solids.count(static_cast<int>(b)) > 0)) return false;
  return true;
}

void check(const SheetPlan& plan, const std::vector<Environment>& environments,
           const BatchSettings& settings) {
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
  for (const Environment& environment : environments) {
    require(environment.state.positions.rows() == plan.pattern.size &&
                environment.state.velocities.rows() == plan.pattern.size,
            "batch: every environment needs a position and a velocity for each vertex of the plan");
    require(environment.state.bristles.rows() == 0 ||
                environment.state.bristles.rows() ==
                    plan.pattern.size * static_cast<Eigen::Index>(environment.obstacles.size()),
            "batch: an environment needs bristles for each vertex on each obstacle, or none");
    require(environment.holds.size() == environments.front().holds.size(),
            "batch: all environments need the same number of holds");
    require(solids_match(plan, environment),
            "batch: every environment needs a solid material for each body of tetrahedra, and for no other");
    for (const Hold& hold : environment.holds) check_stiffness(hold);
    require(frames_exist(environment),
            "batch: a hold or an obstacle names a frame that the schedule does not have");
  }
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
  check(*plan, environments, settings);
  Storage& s = *storage_;
  s.plan = std::move(plan);
  s.environments = std::move(environments);
  s.settings = std::move(settings);
  s.step = s.settings.first_step;
  s.vertices = s.plan->pattern.size;
  const std::size_t count = s.environments.size(), numbers = count * 3 * s.vertices;
  s.holds = count > 0 ? static_cast<std::ptrdiff_t>(s.environments.front().holds.size()) : 0;
  s.solvers.resize(count);
  s.projective_solvers.resize(count);
  s.positions.resize(numbers);
  s.velocities.resize(numbers);
  s.kept = ZeroedNumbers(numbers * s.settings.kept_steps.size());
  s.stats.resize(count * s.steps());
  s.hold_forces.resize(3 * s.holds * s.stats.size());
  s.contacts.resize(count);
  if (s.settings.contacts) {
    s.bodies = std::ssize(s.plan->bodies);
    for (const Environment& environment : s.environments)
      s.obstacles = std::max(s.obstacles, std::ssize(environment.obstacles));
    s.body_resultants.resize(6 * count * s.bodies);
    s.obstacle_resultants.resize(6 * count * s.obstacles);
  }
  for (int e = 0; e < size(); ++e) {
    s.keep(e, s.step);
    s.show(e);
  }
}

Batch::~Batch() = default;
Batch::Batch(Batch&&) noexcept = default;

int Batch::size() const { return static_cast<int>(storage_->environments.size()); }
int Batch::step() const { return storage_->step; }

void Batch::advance(int steps, const std::function<void(int)>& finished) {
  Storage& s = *storage_;
  if (s.step < 0) throw std::invalid_argument("batch: it cannot advance after it has thrown");
  if (steps < 0 || steps > s.settings.steps - s.step)
    throw std::invalid_argument("batch: it cannot advance beyond its last step");
  const std::atomic<bool>* stop = s.settings.solver.stop;
  const auto throw_if_stopped = [&] {
    if (stop != nullptr && *stop) throw data::Stopped();
  };
  const int first = std::exchange(s.step, -1);
  if (s.settings.device == Device::cuda) {
    throw_if_stopped();
    s.advance_on_device(first, steps, finished);
    s.step = first + steps;
    return;
  }
  data::for_each_in_parallel(s.environments.size(), s.settings.threads, [&](std::size_t index) {
    const int e = static_cast<int>(index);
    throw_if_stopped();
    for (int k = 0; k < steps; ++k) {
      s.take_step(e, first + k);
      // A solver that was stopped in a step did not solve it as well as it can: the step is no result.
      throw_if_stopped();
    }
    s.show(e);
    if (s.settings.contacts && steps > 0) s.keep_contacts(e);
    if (first + steps == s.settings.steps) {
      s.solvers[e].reset();
      s.projective_solvers[e].reset();
    }
    if (finished) finished(e);
  });
  s.step = first + steps;
}

const State& Batch::state(int environment) const { return storage_->environments[environment].state; }

View<double> Batch::positions() const {
  return dense(storage_->positions.data(), {size(), storage_->vertices, 3});
}

View<double> Batch::velocities() const {
  return dense(storage_->velocities.data(), {size(), storage_->vertices, 3});
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
  const char* const* names =
      storage_->settings.projective ? cuda::projective_phase_names : cuda::replay_phase_names;
  std::vector<PhaseShare> shares;
  for (std::size_t k = 0; k < ticks.size(); ++k) shares.push_back({names[k], ticks[k] / all});
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
