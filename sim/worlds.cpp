#include "sim/worlds.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>
#include <utility>

#include "data/error.h"
#include "data/parallel.h"
#include "data/text.h"
#include "data/trajectory.h"
#include "sim/device_limits.h"
#include "sim/device_worlds.h"
#include "sim/environment_checks.h"
#include "sim/step/body_law.h"

namespace flash::sim {

using data::InputError;
using data::Points;

namespace {

using Shape = std::vector<std::int64_t>;

static_assert(std::is_standard_layout_v<WorldStatus> && sizeof(WorldStatus) % sizeof(double) == 0);
constexpr std::int64_t status_columns = sizeof(WorldStatus) / sizeof(double);

std::string name_of(const Shape& shape) {
  std::string name;
  for (const std::int64_t length : shape) name += (name.empty() ? "" : " x ") + std::to_string(length);
  return name.empty() ? "a number" : name;
}

bool is_dense(const Tensor& numbers) {
  if (numbers.strides.empty()) return true;
  if (numbers.strides.size() != numbers.shape.size()) return false;
  std::int64_t stride = 1;
  for (std::size_t k = numbers.shape.size(); k-- > 0; stride *= numbers.shape[k])
    if (numbers.shape[k] != 1 && numbers.strides[k] != stride) return false;
  return true;
}

[[noreturn]] void refuse(const char* setter, const std::string& what) {
  throw InputError("worlds: " + std::string(setter) + ": " + what);
}

std::string environment_name(int e) { return "environment " + std::to_string(e); }

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
    std::vector<bool> found(worlds.size());
    for (const int e : environments.numbers()) {
      if (e < 0 || e >= size())
        refuse(setter, "found " + environment_name(e) + ", expected 0 to " + std::to_string(size() - 1));
      if (found[static_cast<std::size_t>(e)])
        refuse(setter, "found " + environment_name(e) + " twice, expected each once");
      found[static_cast<std::size_t>(e)] = true;
    }
    return environments.numbers();
  }

  /// The numbers that a setter is given, an entry for each environment of `chosen`.
  const double* entries_of(const char* setter, const char* name, std::span<const int> chosen,
                           const Tensor& numbers, const Shape& shape_of_each) const {
    Shape shape = {std::ssize(chosen)};
    shape.insert(shape.end(), shape_of_each.begin(), shape_of_each.end());
    const std::string of = std::string(name) + ": ";
    if (numbers.device != Device::cpu)
      refuse(setter, of + "found numbers on a CUDA device, expected the CPU's");
    if (numbers.type != NumberType::float64) refuse(setter, of + "found float32, expected float64");
    if (numbers.shape != shape)
      refuse(setter, of + "found " + name_of(numbers.shape) + " numbers, expected " + name_of(shape));
    if (!is_dense(numbers)) refuse(setter, of + "found strides with gaps, expected dense numbers");
    if (numbers.empty() && !chosen.empty())
      refuse(setter, of + "found no numbers, expected " + name_of(shape));
    const auto* first = static_cast<const double*>(numbers.data);
    const std::int64_t each =
        std::accumulate(shape_of_each.begin(), shape_of_each.end(), std::int64_t{1}, std::multiplies<>());
    for (std::size_t i = 0; i < chosen.size(); ++i)
      for (std::int64_t k = 0; k < each; ++k) {
        const double value = first[static_cast<std::int64_t>(i) * each + k];
        if (!std::isfinite(value))
          refuse(setter, of + environment_name(chosen[i]) + ": found " + data::format_short(value) + " at " +
                             std::to_string(k) + ", expected finite numbers");
      }
    return first;
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

  void expect_hold(const char* setter, int hold) const {
    if (hold < 0 || hold >= holds)
      refuse(setter, "found hold " + std::to_string(hold) + ", expected one of " + std::to_string(holds));
  }

  void check_grasp(int e, int hold, const Grasp& grasp) const {
    const Hold& own = worlds[static_cast<std::size_t>(e)].start_holds[static_cast<std::size_t>(hold)];
    const auto expect = [&](bool met, const std::string& what) {
      if (!met) refuse("grasp", environment_name(e) + ": hold " + std::to_string(hold) + ": " + what);
    };
    const bool others = !grasp.vertices.empty() || grasp.reach;
    expect(others || !own.vertices.empty() || own.reach,
           "found neither vertices nor a reach, expected one of them");
    expect(grasp.vertices.empty() || !grasp.reach, "found vertices and a reach, expected one of them");
    expect(!others || (own.targets.rows() == 0 && own.stiffness.size() == 0),
           "found other vertices than its own, expected those: it has targets or a stiffness for them");
    std::vector<int> sorted = grasp.vertices;
    std::sort(sorted.begin(), sorted.end());
    expect(sorted.empty() || (sorted.front() >= 0 && sorted.back() < vertices),
           "found a vertex that is not there, expected 0 to " + std::to_string(vertices - 1));
    expect(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(),
           "found a vertex twice, expected each once");
    if (!grasp.reach) return;
    const Reach& reach = *grasp.reach;
    expect(std::isfinite(reach.threshold) && reach.threshold >= 0,
           "found a threshold of " + data::format_short(reach.threshold) + " m, expected 0 or more");
    expect(reach.half_extents.allFinite() && reach.half_extents.minCoeff() >= 0,
           "found half extents below 0, expected 0 or more");
    expect(reach.first_vertex >= 0 && reach.first_vertex < vertices &&
               reach.first_vertex + std::max(reach.vertex_count, 0) <= vertices,
           "found a reach of vertices that are not there, expected 0 to " + std::to_string(vertices - 1));
  }

  /// Sets a material of one body to what `place(environment)` is of each, all or none.
  template <class Material, class Place>
  void set_materials(const Chosen& environments, std::span<const Material> materials, int body,
                     const Place& place) {
    const char* setter = "set_materials";
    const std::span<const int> which = numbers_of(setter, environments);
    if (materials.size() != which.size())
      refuse(setter, "found " + std::to_string(materials.size()) + " materials, expected " +
                         std::to_string(which.size()));
    constexpr bool solid = std::is_same_v<Material, data::SolidMaterial>;
    if (body < 0 || body >= std::ssize(plan->bodies) ||
        plan->bodies[static_cast<std::size_t>(body)].body.is_solid() != solid)
      refuse(setter, "found body " + std::to_string(body) + ", expected one of " +
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
        refuse(setter, environment_name(which[i]) + ": " + error.what());
      }
    }
    for (std::size_t i = 0; i < which.size(); ++i) {
      place(at(which[i]).environment) = materials[i];
      if (device) device->write_material(which[i]);
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

void Worlds::set_poses(const Chosen& environments, int frame, const Tensor& poses) {
  constexpr double unit_tolerance = 1e-3;  // as of files of trajectories
  Storage& s = *storage_;
  const std::span<const int> chosen = s.numbers_of("set_poses", environments);
  const double* numbers = s.entries_of("set_poses", "poses", chosen, poses, {7});
  const auto pose_of = [&](std::size_t i) {
    return Eigen::Map<const Eigen::Matrix<double, 7, 1>>(numbers + 7 * i);
  };
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const int e = chosen[i];
    const World& world = s.at(e);
    const std::ptrdiff_t frames = world.plan ? std::ssize(world.plan->frames) : 0;
    if (frame < 0 || frame >= frames)
      refuse("set_poses", environment_name(e) + ": found frame " + std::to_string(frame) +
                              ", expected one of the " + std::to_string(frames) + " of its schedule");
    const double length = pose_of(i).tail<4>().norm();
    if (!(std::abs(length - 1) <= unit_tolerance))
      refuse("set_poses", environment_name(e) + ": found a quaternion of length " +
                              data::format_short(length) + ", expected 1");
  }
  for (std::size_t i = 0; i < chosen.size(); ++i)
    set_pose(s.at(chosen[i]), frame, data::from_vector(pose_of(i)), s.time_step());
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
  for (const int e : chosen) s.check_grasp(e, hold, grasp);
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
    refuse("load", "found " + std::to_string(checkpoint.size()) + " environments, expected " +
                       std::to_string(chosen.size()));
  if (chosen.empty()) return;
  const Checkpoint::Saved& saved = *checkpoint.saved_;
  if (saved.plan != s.plan) refuse("load", "found environments of another plan, expected this one's");
  if (saved.projective != s.settings.projective.has_value() || saved.time_step != s.time_step())
    refuse("load", "found environments of another method or time step, expected these");
  if (saved.device != s.settings.device)
    refuse("load", "found environments of another kind of device, expected this one's");
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const Environment& environment = saved.worlds[i].environment;
    if (std::ssize(environment.holds) != s.holds || std::ssize(environment.obstacles) > s.obstacles)
      refuse("load", environment_name(chosen[i]) + ": found " + std::to_string(environment.holds.size()) +
                         " holds and " + std::to_string(environment.obstacles.size()) +
                         " obstacles, expected " + std::to_string(s.holds) + " and at most " +
                         std::to_string(s.obstacles));
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
