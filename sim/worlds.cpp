#include "sim/worlds.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>
#include <utility>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/machine/parallel.h"
#include "sim/device_limits.h"
#include "sim/device_worlds.h"
#include "sim/environment_checks.h"
#include "sim/step/body_law.h"
#include "sim/tensor_entries.h"
#include "sim/world_arguments.h"

namespace flash::sim {

using data::InputError;
using data::Points;

namespace {

using Shape = std::vector<std::int64_t>;

static_assert(std::is_standard_layout_v<WorldStatus> && sizeof(WorldStatus) % sizeof(double) == 0);
constexpr std::int64_t status_columns = sizeof(WorldStatus) / sizeof(double);

void copy_rows(const Points& rows, double* to) { std::copy(rows.data(), rows.data() + rows.size(), to); }

}  // namespace

struct Worlds::Storage {
  std::shared_ptr<const SheetPlan> plan;
  WorldSettings settings;
  std::vector<World> worlds;
  std::vector<int> every;  ///< 0, 1, ...
  std::int64_t vertices = 0, holds = 0, obstacles = 0;
  std::vector<double> positions, velocities;  ///< on the processor
  std::vector<double> hold_forces, obstacle_forces;
  std::vector<WorldStatus> status;
  std::unique_ptr<DeviceWorlds> device;  ///< null: the processor steps them

  int size() const { return static_cast<int>(worlds.size()); }
  World& at(int e) { return worlds[static_cast<std::size_t>(e)]; }
  double time_step() const {
    return settings.projective ? settings.projective->time_step : settings.solver.time_step;
  }

  /// The environments that are meant, each once.
  std::span<const int> numbers_of(const char* setter, const Chosen& environments) const {
    if (environments.all()) return every;
    check_chosen(setter, environments.numbers(), size());
    return environments.numbers();
  }

  const double* entries_of(const char* setter, const char* name, std::span<const int> chosen,
                           const Tensor& numbers, const Shape& shape_of_each) const {
    return sim::entries_of("worlds: " + std::string(setter) + ": " + name, chosen, numbers, shape_of_each);
  }

  /// Dense numbers where the environments are.
  Tensor view(const double* numbers, Shape shape) const {
    return {.data = numbers,
            .shape = std::move(shape),
            .device = settings.device,
            .device_number = device ? settings.cuda_device : 0};
  }
  Tensor view_of(std::span<const double> numbers, Shape shape) const {
    return view(device ? device->copy_of(numbers) : numbers.data(), std::move(shape));
  }

  /// On a device an end effector is an obstacle more, of which that has so many at most.
  void check_room_on_device(const Environment& environment) const {
    if (!device) return;
    Environment with_one_more = environment;
    with_one_more.obstacles.emplace_back();
    try {
      check_on_device({with_one_more}, settings);
    } catch (const InputError& error) {
      refuse_argument("add", error.what());
    }
  }

  void expect_hold(const char* setter, int hold) const {
    if (hold < 0 || hold >= holds)
      refuse_argument(setter,
                      "found hold " + std::to_string(hold) + ", expected one of " + std::to_string(holds));
  }

  /// Sets a material of one body to what `place(environment)` is of each, all or none.
  template <class Material, class Place>
  void set_materials(const Chosen& environments, std::span<const Material> materials, int body,
                     const Place& place) {
    const char* setter = "set_materials";
    const std::span<const int> which = numbers_of(setter, environments);
    if (materials.size() != which.size())
      refuse_argument(setter, "found " + std::to_string(materials.size()) + " materials, expected " +
                                  std::to_string(which.size()));
    constexpr bool solid = std::is_same_v<Material, data::SolidMaterial>;
    if (body < 0 || body >= std::ssize(plan->bodies) ||
        plan->bodies[static_cast<std::size_t>(body)].body.is_solid() != solid)
      refuse_argument(setter, "found body " + std::to_string(body) + ", expected one of " +
                                  (solid ? "tetrahedra" : "triangles"));
    Environment tried;
    for (std::size_t i = 0; i < which.size(); ++i) {
      const Environment& environment = at(which[i]).environment;
      tried.materials = environment.materials;
      tried.solids = environment.solids;
      place(tried) = materials[i];
      try {
        check_material(materials[i]);
        body_laws(*plan, tried);
        if (device) check_on_device({tried}, settings);
      } catch (const InputError& error) {
        refuse_argument(setter, environment_name(which[i]) + ": " + error.what());
      }
    }
    for (std::size_t i = 0; i < which.size(); ++i) {
      place(at(which[i]).environment) = materials[i];
      if (device) device->write_environment(which[i]);
    }
  }

  /// Copies what the views show of an environment to where all are side by side.
  void show(int e) {
    const World& world = at(e);
    const State& state = world.environment.state;
    if (!device) {
      copy_rows(state.positions, positions.data() + e * 3 * vertices);
      copy_rows(state.velocities, velocities.data() + e * 3 * vertices);
    }
    const StepReport& report = world.report;
    double* to = hold_forces.data() + e * 3 * holds;
    for (const Eigen::Vector3d& force : report.hold_forces) to = std::copy(force.begin(), force.end(), to);
    to = obstacle_forces.data() + e * 3 * obstacles;
    for (const Eigen::Vector3d& force : report.obstacle_forces)
      to = std::copy(force.begin(), force.end(), to);
    status[static_cast<std::size_t>(e)] = {.steps = static_cast<double>(world.steps),
                                           .time = state.time,
                                           .converged = report.converged ? 1.0 : 0.0,
                                           .residual = report.residual,
                                           .penetration = report.penetration_max,
                                           .parts = static_cast<double>(report.substeps),
                                           .lost = static_cast<double>(world.lost)};
  }
};

struct Checkpoint::Saved {
  std::shared_ptr<const SheetPlan> plan;
  bool projective;
  double time_step;
  Device device;
  std::vector<World> worlds;
  std::vector<std::vector<char>> on_device;  ///< what a device has of each
};

int Checkpoint::size() const { return saved_ ? static_cast<int>(saved_->worlds.size()) : 0; }

Worlds::Worlds(std::shared_ptr<const SheetPlan> plan, std::vector<Environment> environments,
               WorldSettings settings)
    : storage_(std::make_unique<Storage>()) {
  check_environments(*plan, environments);
  if (settings.device == Device::cuda) check_on_device(environments, settings);
  Storage& s = *storage_;
  s.plan = std::move(plan);
  s.settings = std::move(settings);
  s.vertices = s.plan->pattern.size;
  const auto count = static_cast<std::int64_t>(environments.size());
  for (Environment& environment : environments) {
    s.holds = std::ssize(environment.holds);
    s.obstacles = std::max<std::int64_t>(s.obstacles, std::ssize(environment.obstacles));
    s.worlds.push_back(make_world(std::move(environment), s.settings));
  }
  s.every.resize(environments.size());
  std::iota(s.every.begin(), s.every.end(), 0);
  if (s.settings.device == Device::cuda)
    s.device = device_worlds(s.plan, s.worlds, s.settings);
  else {
    s.positions.resize(3 * count * s.vertices);
    s.velocities.resize(3 * count * s.vertices);
  }
  s.hold_forces.resize(3 * count * s.holds);
  s.obstacle_forces.resize(3 * count * s.obstacles);
  s.status.resize(environments.size());
  for (const int e : s.every) s.show(e);
}

Worlds::~Worlds() = default;
Worlds::Worlds(Worlds&&) noexcept = default;
Worlds& Worlds::operator=(Worlds&&) noexcept = default;

int Worlds::size() const { return storage_->size(); }

EndEffectorNumbers Worlds::add(const EndEffector& effector, const Tensor& poses) {
  Storage& s = *storage_;
  check_end_effector(effector);
  const std::vector<Eigen::Isometry3d> at = poses_of("worlds: add: poses", s.every, poses);
  const auto frames_of = [](const World& world) { return world.plan ? std::ssize(world.plan->frames) : 0; };
  for (const int e : s.every) {
    const World &world = s.at(e), &first = s.at(0);
    if (world.steps != s.settings.first_step)
      refuse_argument("add", environment_name(e) + ": found " + std::to_string(world.steps) +
                                 " steps taken, expected an end effector before the first");
    if (frames_of(world) != frames_of(first) ||
        world.environment.obstacles.size() != first.environment.obstacles.size())
      refuse_argument("add",
                      environment_name(e) +
                          ": found other numbers of frames or obstacles, expected those of environment 0");
  }
  if (effector.collides) s.check_room_on_device(s.at(0).environment);
  EndEffectorNumbers numbers{.frame = 0, .hold = static_cast<int>(s.holds++), .obstacle = -1};
  if (effector.collides) numbers.obstacle = static_cast<int>(s.obstacles++);
  std::shared_ptr<const Schedule> before, after;
  for (const int e : s.every) {
    World& world = s.at(e);
    const Eigen::Isometry3d& pose = at[static_cast<std::size_t>(e)];
    // Environments that share a schedule and start alike share the longer one too.
    if (!after || world.plan != before || after->frames.back().front().matrix() != pose.matrix()) {
      before = world.plan;
      Schedule longer = before ? *before : Schedule{.time_step = s.time_step(), .frames = {}};
      numbers.frame = static_cast<int>(longer.frames.size());
      longer.frames.push_back({pose});
      after = std::make_shared<const Schedule>(std::move(longer));
    }
    add_end_effector(world, effector, after);
  }
  s.hold_forces.assign(s.worlds.size() * 3 * static_cast<std::size_t>(s.holds), 0.0);
  s.obstacle_forces.assign(s.worlds.size() * 3 * static_cast<std::size_t>(s.obstacles), 0.0);
  // What a device has of an environment is as large as its holds and obstacles ask for.
  if (s.device) {
    std::unique_ptr<DeviceWorlds> anew = device_worlds(s.plan, s.worlds, s.settings);
    anew->take_views(*s.device);
    s.device = std::move(anew);
  }
  return numbers;
}

void Worlds::set_poses(const Chosen& environments, int frame, const Tensor& poses) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.numbers_of("set_poses", environments);
  for (const int e : chosen) {
    const World& world = s.at(e);
    const std::ptrdiff_t frames = world.plan ? std::ssize(world.plan->frames) : 0;
    if (frame < 0 || frame >= frames)
      refuse_argument("set_poses", environment_name(e) + ": found frame " + std::to_string(frame) +
                                       ", expected one of the " + std::to_string(frames) +
                                       " of its schedule");
  }
  const std::vector<Eigen::Isometry3d> at = poses_of("worlds: set_poses: poses", chosen, poses);
  for (std::size_t i = 0; i < chosen.size(); ++i) set_pose(s.at(chosen[i]), frame, at[i], s.time_step());
}

void Worlds::set_gravity(const Chosen& environments, const Tensor& gravity) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.numbers_of("set_gravity", environments);
  const double* numbers = s.entries_of("set_gravity", "gravity", chosen, gravity, {3});
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    s.at(chosen[i]).environment.gravity = Eigen::Map<const Eigen::Vector3d>(numbers + 3 * i);
    if (s.device) s.device->write_environment(chosen[i]);
  }
}

void Worlds::set_friction(const Chosen& environments, int obstacle, std::span<const double> friction,
                          int body) {
  Storage& s = *storage_;
  const char* setter = "set_friction";
  const std::span<const int> chosen = s.numbers_of(setter, environments);
  if (friction.size() != chosen.size())
    refuse_argument(setter, "found " + std::to_string(friction.size()) + " coefficients, expected " +
                                std::to_string(chosen.size()));
  if (body < 0 || body >= std::ssize(s.plan->bodies))
    refuse_argument(setter, "found body " + std::to_string(body) + ", expected one of " +
                                std::to_string(s.plan->bodies.size()));
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::ptrdiff_t obstacles = std::ssize(s.at(chosen[i]).environment.obstacles);
    if (obstacle < 0 || obstacle >= obstacles)
      refuse_argument(setter, environment_name(chosen[i]) + ": found obstacle " + std::to_string(obstacle) +
                                  ", expected one of " + std::to_string(obstacles));
    if (!(friction[i] >= 0 && std::isfinite(friction[i])))
      refuse_argument(setter, environment_name(chosen[i]) + ": found " + data::format_short(friction[i]) +
                                  ", expected a number of 0 or more");
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    std::vector<double>& all =
        s.at(chosen[i]).environment.obstacles[static_cast<std::size_t>(obstacle)].friction;
    all.resize(std::max(all.size(), static_cast<std::size_t>(body) + 1), -1.0);
    all[static_cast<std::size_t>(body)] = friction[i];
    if (s.device) s.device->write_environment(chosen[i]);
  }
}

void Worlds::set_materials(const Chosen& environments, std::span<const data::SheetMaterial> materials,
                           int body) {
  storage_->set_materials(
      environments, materials, body, [body](Environment & environment) -> auto& {
        return environment.materials[static_cast<std::size_t>(body)];
      });
}

void Worlds::set_materials(const Chosen& environments, std::span<const data::SolidMaterial> materials,
                           int body) {
  storage_->set_materials(
      environments, materials,
      body, [body](Environment & environment) -> auto& { return environment.solids.at(body); });
}

void Worlds::grasp(const Chosen& environments, int hold, const Grasp& grasp) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.numbers_of("grasp", environments);
  s.expect_hold("grasp", hold);
  for (const int e : chosen)
    check_grasp(e, hold, s.at(e).start_holds[static_cast<std::size_t>(hold)], grasp, s.vertices);
  for (const int e : chosen) sim::grasp(s.at(e), hold, grasp);
}

void Worlds::release(const Chosen& environments, int hold) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.numbers_of("release", environments);
  s.expect_hold("release", hold);
  for (const int e : chosen) sim::release(s.at(e), hold);
}

void Worlds::set_velocities(const Chosen& environments, const Tensor& velocities) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.numbers_of("set_velocities", environments);
  const double* numbers = s.entries_of("set_velocities", "velocities", chosen, velocities, {s.vertices, 3});
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (s.device) s.device->read_state(chosen[i]);
    s.at(chosen[i]).environment.state.velocities =
        Eigen::Map<const Points>(numbers + static_cast<std::int64_t>(i) * 3 * s.vertices, s.vertices, 3);
    if (s.device) s.device->write_velocities(chosen[i]);
    s.show(chosen[i]);
  }
  if (s.device) s.device->renew();
}

void Worlds::reset(const Chosen& environments, const Tensor& positions, const Tensor& velocities) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.numbers_of("reset", environments);
  const auto entries_of = [&](const char* name, const Tensor& tensor) -> const double* {
    return tensor.empty() ? nullptr : s.entries_of("reset", name, chosen, tensor, {s.vertices, 3});
  };
  const double *x = entries_of("positions", positions), *v = entries_of("velocities", velocities);
  const auto rows_of = [&](const double* numbers, std::size_t i) {
    return Eigen::Map<const Points>(numbers + static_cast<std::int64_t>(i) * 3 * s.vertices, s.vertices, 3);
  };
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    World& world = s.at(chosen[i]);
    sim::reset(world, s.settings);
    State& state = world.environment.state;
    if (x != nullptr)
      state = {.time = state.time,
               .positions = rows_of(x, i),
               .velocities = Points::Zero(s.vertices, 3),
               .held = {}};
    if (v != nullptr) state.velocities = rows_of(v, i);
    if (s.device) s.device->write_state(chosen[i]);
    s.show(chosen[i]);
  }
  if (s.device) s.device->renew();
}

void Worlds::step(int count, const std::function<void(int)>& seen, const std::function<void(int)>& finished,
                  std::span<const int> positions_at) {
  Storage& s = *storage_;
  const std::atomic<bool>* stop = s.settings.solver.stop;
  const auto throw_if_stopped = [&] {
    if (stop != nullptr && *stop) throw data::Stopped();
  };
  if (s.device) {
    throw_if_stopped();
    s.device->step(count, positions_at, seen, [&](int e) {
      s.show(e);
      if (finished) finished(e);
    });
    return s.device->renew();
  }
  data::for_each_in_parallel(s.worlds.size(), s.settings.threads, [&](std::size_t index) {
    const int e = static_cast<int>(index);
    throw_if_stopped();
    for (int k = 0; k < count; ++k) {
      take_step(s.plan, s.settings, s.worlds[index]);
      // A solver that was stopped in a step did not solve it as well as it can: the step is no result.
      throw_if_stopped();
      if (seen) seen(e);
    }
    s.show(e);
    if (finished) finished(e);
  });
}

Tensor Worlds::positions() const {
  const Storage& s = *storage_;
  return s.view(s.device ? s.device->positions() : s.positions.data(), {size(), s.vertices, 3});
}
Tensor Worlds::velocities() const {
  const Storage& s = *storage_;
  return s.view(s.device ? s.device->velocities() : s.velocities.data(), {size(), s.vertices, 3});
}
Tensor Worlds::hold_forces() const {
  return storage_->view_of(storage_->hold_forces, {size(), storage_->holds, 3});
}
Tensor Worlds::obstacle_forces() const {
  return storage_->view_of(storage_->obstacle_forces, {size(), storage_->obstacles, 3});
}
Tensor Worlds::status() const {
  const std::vector<WorldStatus>& status = storage_->status;
  const double* first = status.empty() ? nullptr : &status.front().steps;
  return storage_->view_of(std::span(first, status.size() * status_columns), {size(), status_columns});
}

const WorldStatus& Worlds::status(int environment) const {
  return storage_->status[static_cast<std::size_t>(environment)];
}
Lost Worlds::lost(int environment) const { return storage_->at(environment).lost; }
const std::string& Worlds::why_lost(int environment) const { return storage_->at(environment).why_lost; }
const Environment& Worlds::environment(int environment) const {
  if (storage_->device) storage_->device->read_state(environment);
  return storage_->at(environment).environment;
}
const Environment& Worlds::given(int environment) const { return storage_->at(environment).environment; }
const StepReport& Worlds::report(int environment) const { return storage_->at(environment).report; }
std::vector<ContactForce> Worlds::contacts(int environment) const {
  return contacts_of(storage_->at(environment));
}

void Worlds::drop_solver(int environment) {
  World& world = storage_->at(environment);
  world.newton.reset();
  world.projective.reset();
  if (storage_->device) storage_->device->forget_solver(environment);
}

std::vector<double> Worlds::phase_ticks() const {
  return storage_->device ? storage_->device->phase_ticks() : std::vector<double>();
}

Checkpoint Worlds::save(const Chosen& environments) const {
  const Storage& s = *storage_;
  Checkpoint::Saved saved{s.plan, s.settings.projective.has_value(), s.time_step(), s.settings.device, {},
                          {}};
  for (const int e : s.numbers_of("save", environments)) {
    if (s.device) saved.on_device.push_back(s.device->save(e));
    saved.worlds.push_back(copy_of(s.worlds[static_cast<std::size_t>(e)]));
  }
  Checkpoint checkpoint;
  checkpoint.saved_ = std::make_shared<const Checkpoint::Saved>(std::move(saved));
  return checkpoint;
}

void Worlds::load(const Chosen& environments, const Checkpoint& checkpoint) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.numbers_of("load", environments);
  if (checkpoint.size() != std::ssize(chosen))
    refuse_argument("load", "found " + std::to_string(checkpoint.size()) + " environments, expected " +
                                std::to_string(chosen.size()));
  if (chosen.empty()) return;
  const Checkpoint::Saved& saved = *checkpoint.saved_;
  if (saved.plan != s.plan)
    refuse_argument("load", "found environments of another plan, expected this one's");
  if (saved.projective != s.settings.projective.has_value() || saved.time_step != s.time_step())
    refuse_argument("load", "found environments of another method or time step, expected these");
  if (saved.device != s.settings.device)
    refuse_argument("load", "found environments of another kind of device, expected this one's");
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const Environment& environment = saved.worlds[i].environment;
    if (std::ssize(environment.holds) != s.holds || std::ssize(environment.obstacles) > s.obstacles)
      refuse_argument("load", environment_name(chosen[i]) + ": found " +
                                  std::to_string(environment.holds.size()) + " holds and " +
                                  std::to_string(environment.obstacles.size()) + " obstacles, expected " +
                                  std::to_string(s.holds) + " and at most " + std::to_string(s.obstacles));
  }
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    s.at(chosen[i]) = copy_of(saved.worlds[i]);
    if (s.device) s.device->load(chosen[i], saved.on_device[i]);
    double* unused = s.obstacle_forces.data() + chosen[i] * 3 * s.obstacles;
    std::fill(unused, unused + 3 * s.obstacles, 0.0);
    s.show(chosen[i]);
  }
  if (s.device) s.device->renew();
}

}  // namespace flash::sim
