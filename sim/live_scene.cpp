#include "sim/live_scene.h"

#include <algorithm>
#include <deque>
#include <numeric>

#include "data/files/error.h"
#include "sim/device_copies.h"
#include "sim/device_pictures.h"
#include "sim/live_forces.h"
#include "sim/named.h"
#include "sim/scene/scene.h"
#include "sim/scene_worlds.h"
#include "sim/tensor_entries.h"

namespace flash::sim {

using data::InputError;
using data::Points;

namespace {

struct LiveEffector {
  EndEffector effector;
  std::vector<EndEffectorNumbers> numbers;  ///< in each of the worlds
  std::vector<double> start_poses, poses;   ///< environments x 7
  std::vector<bool> closed;                 ///< by environment
};

Tensor dense(const std::vector<double>& numbers, std::vector<std::int64_t> shape) {
  return {.data = numbers.data(), .shape = std::move(shape)};
}

}  // namespace

class LiveScene::Saved {
 public:
  struct Effector {
    std::vector<double> poses;
    std::vector<bool> closed;
  };
  std::vector<Checkpoint> worlds;
  std::vector<Effector> effectors;
};

struct LiveScene::Storage {
  int environments;
  int threads;
  double time_step;
  bool quasistatic;
  std::atomic<bool> stop = false;
  bool interrupted = false;
  std::vector<std::string> notices;
  std::vector<std::string> scene_names;  ///< of obstacles and end effectors of the file
  std::vector<Worlds> worlds;
  std::vector<State> starts;  ///< of the worlds
  std::vector<LiveObject> objects;
  std::deque<LiveEffector> effectors;  ///< whose numbers stay where they are
  std::vector<int> every;
  std::vector<WorldStatus> status;
  LiveForces forces;
  LiveCameras cameras;
  std::unique_ptr<DeviceCopies> copies;  ///< on the device that steps; null: the processor
  mutable std::unique_ptr<DevicePictures>
      pictures;  ///< of the bodies that there are, once they are asked for

  void check_environment(int e) const {
    if (e < 0 || e >= environments)
      throw InputError("environments: found " + std::to_string(e) + ", expected 0 to " +
                       std::to_string(environments - 1));
  }

  /// The environments that are meant, each once.
  std::span<const int> chosen_of(const Chosen& chosen) const {
    if (chosen.all()) return every;
    std::vector<bool> found(every.size());
    for (const int e : chosen.numbers()) {
      check_environment(e);
      if (found[static_cast<std::size_t>(e)])
        throw InputError("environments: found " + std::to_string(e) + " twice, expected each once");
      found[static_cast<std::size_t>(e)] = true;
    }
    return chosen.numbers();
  }

  const LiveObject& object(const std::string& name) const {
    return objects[number_of("object", name, names_of(objects))];
  }
  std::vector<std::string> effector_names() const {
    std::vector<std::string> names;
    for (const LiveEffector& live : effectors) names.push_back(live.effector.name);
    return names;
  }
  LiveEffector& effector(const std::string& name) {
    return effectors[number_of("end effector", name, effector_names())];
  }

  /// An environment where the objects that are not lost have it. Of its state the time alone is asked for.
  const Environment* latest(int e) const {
    const auto later = [e](const Worlds& a, const Worlds& b) {
      return a.given(e).state.time < b.given(e).state.time;
    };
    return &std::max_element(worlds.begin(), worlds.end(), later)->given(e);
  }

  /// What draws pictures on the device that steps.
  DevicePictures& on_device() const {
    if (!pictures) {
      std::vector<SeenMesh> moving;
      for (const LiveObject& object : objects)
        moving.push_back({.triangles = &object.triangles, .vertex_count = object.vertices});
      pictures = std::make_unique<DevicePictures>(copies->cuda_device(), cameras.meshes(std::move(moving)));
    }
    return *pictures;
  }

  /// What the views show of all objects together.
  void show() {
    for (const int e : every) {
      const auto index = static_cast<std::size_t>(e);
      status[index] = worlds.front().status(e);
      for (const Worlds& of_object : worlds) merge(of_object.status(e), status[index]);
    }
    forces.renew(worlds);
    if (copies) copies->renew();
  }

  bool is_given(const std::vector<Tensor>& given, std::size_t o, std::size_t w) const {
    return o < given.size() && !given[o].empty() && objects[o].worlds == w;
  }
  bool any_given(const std::vector<Tensor>& given, std::size_t w) const {
    for (std::size_t o = 0; o < objects.size(); ++o)
      if (is_given(given, o, w)) return true;
    return false;
  }

  /// Rows for all vertices of worlds number `w`: of each object those that are given, else those that `keep(
  /// environment)` points to.
  template <class Keep>
  std::vector<double> rows_for(std::size_t w, std::span<const int> chosen, const std::vector<Tensor>& given,
                               const Keep& keep) const {
    const std::ptrdiff_t each = 3 * starts[w].positions.rows();
    std::vector<double> rows;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const double* kept = keep(chosen[i]);
      rows.insert(rows.end(), kept, kept + each);
      for (std::size_t o = 0; o < objects.size(); ++o) {
        if (!is_given(given, o, w)) continue;
        const std::ptrdiff_t count = 3 * objects[o].vertices;
        const double* from =
            static_cast<const double*>(given[o].data) + static_cast<std::ptrdiff_t>(i) * count;
        std::copy(from, from + count, rows.end() - each + 3 * objects[o].first_vertex);
      }
    }
    return rows;
  }
};

LiveScene::LiveScene(const data::Scene& scene, int environments, int threads, const DeviceChoice& device)
    : storage_(std::make_unique<Storage>()) {
  if (environments < 1)
    throw InputError("environments: found " + std::to_string(environments) + ", expected 1 or more");
  Storage& s = *storage_;
  s.environments = environments;
  s.threads = threads;
  s.time_step = scene.time_step;
  s.quasistatic = scene.rest_motion.has_value();
  s.notices = scene.notices;
  // There is no last step: what moves by the file does so to the end of its trajectory.
  const std::vector<SceneBody> bodies = scene_bodies(scene, data::max_steps, s.notices);
  s.worlds = scene_worlds(scene, bodies, environments, {}, threads, device, &s.stop);
  for (std::size_t w = 0; w < bodies.size(); ++w) {
    s.starts.push_back(bodies[w].environment.state);
    const Sheet& sheet = bodies[w].sheet;
    for (std::size_t b = 0; b < sheet.bodies.size(); ++b)
      s.objects.push_back(live_object(sheet, b, scene.objects[s.objects.size()].name, w));
  }
  for (const auto& names : {names_of(scene.obstacles), names_of(scene.end_effectors)})
    s.scene_names.insert(s.scene_names.end(), names.begin(), names.end());
  s.every.resize(static_cast<std::size_t>(environments));
  std::iota(s.every.begin(), s.every.end(), 0);
  s.status.resize(s.every.size());
  s.cameras = LiveCameras(names_of(s.objects), rigid_bodies(scene, s.worlds.front().environment(0)));
  s.forces = LiveForces(s.worlds, obstacles());
  if (device.device == Device::cuda)
    s.copies = std::make_unique<DeviceCopies>(device.cuda_devices.empty() ? 0 : device.cuda_devices.front());
  s.show();
}

LiveScene::~LiveScene() = default;

int LiveScene::size() const { return storage_->environments; }
DeviceChoice LiveScene::device() const {
  if (!storage_->copies) return {};
  return {Device::cuda, {storage_->copies->cuda_device()}};
}
double LiveScene::time_step() const { return storage_->time_step; }
const std::vector<LiveObject>& LiveScene::objects() const { return storage_->objects; }
std::vector<std::string> LiveScene::end_effectors() const { return storage_->effector_names(); }
const std::vector<std::string>& LiveScene::notices() const { return storage_->notices; }

std::vector<std::string> LiveScene::obstacles() const {
  return names_of(storage_->worlds.front().given(0).obstacles);
}

void LiveScene::add_end_effector(const EndEffector& effector, const Tensor& poses) {
  Storage& s = *storage_;
  std::vector<std::string> taken = s.effector_names();
  for (const std::vector<std::string>& names : {s.scene_names, s.forces.names()})
    taken.insert(taken.end(), names.begin(), names.end());
  if (effector.name.empty()) throw InputError("name: found \"\", expected a name");
  if (std::find(taken.begin(), taken.end(), effector.name) != taken.end())
    throw InputError("name: found \"" + effector.name +
                     "\", which an obstacle, a hold or another end effector has, expected a new one");
  LiveEffector live;
  live.effector = effector;
  for (Worlds& of_object : s.worlds) live.numbers.push_back(of_object.add(effector, poses));
  const auto* numbers = static_cast<const double*>(poses.data);
  live.start_poses.assign(numbers, numbers + 7 * s.every.size());
  live.poses = live.start_poses;
  live.closed.resize(s.every.size());
  s.cameras.add_body(rigid_body(effector, live.numbers.front().frame));
  s.pictures.reset();
  s.forces.add(effector.name, live.numbers, s.environments);
  s.effectors.push_back(std::move(live));
}

void LiveScene::move_end_effector(const std::string& name, const Chosen& environments, const Tensor& poses) {
  Storage& s = *storage_;
  LiveEffector& live = s.effector(name);
  for (std::size_t w = 0; w < s.worlds.size(); ++w)
    s.worlds[w].set_poses(environments, live.numbers[w].frame, poses);
  const auto* from = static_cast<const double*>(poses.data);
  for (const int e : s.chosen_of(environments)) {
    std::copy(from, from + 7, live.poses.begin() + 7 * e);
    from += 7;
  }
}

void LiveScene::close(const std::string& name, const Chosen& environments) {
  Storage& s = *storage_;
  LiveEffector& live = s.effector(name);
  std::vector<int> closing;
  for (const int e : s.chosen_of(environments))
    if (!live.closed[static_cast<std::size_t>(e)]) closing.push_back(e);
  for (std::size_t w = 0; w < s.worlds.size(); ++w)
    s.worlds[w].grasp(closing, live.numbers[w].hold, {.may_miss = true});
  for (const int e : closing) live.closed[static_cast<std::size_t>(e)] = true;
}

void LiveScene::open(const std::string& name, const Chosen& environments) {
  Storage& s = *storage_;
  LiveEffector& live = s.effector(name);
  for (std::size_t w = 0; w < s.worlds.size(); ++w) s.worlds[w].release(environments, live.numbers[w].hold);
  for (const int e : s.chosen_of(environments)) live.closed[static_cast<std::size_t>(e)] = false;
}

std::vector<int> LiveScene::held(const std::string& name) const {
  const LiveEffector& live = storage_->effector(name);
  std::vector<int> counts(storage_->every.size());
  for (std::size_t w = 0; w < storage_->worlds.size(); ++w)
    for (std::size_t e = 0; e < counts.size(); ++e) {
      const std::vector<HeldVertices>& held = storage_->worlds[w].given(static_cast<int>(e)).state.held;
      const auto hold = static_cast<std::size_t>(live.numbers[w].hold);
      if (hold < held.size()) counts[e] += static_cast<int>(held[hold].vertices.size());
    }
  return counts;
}

void LiveScene::set_material(const std::string& object, const Chosen& environments,
                             const MaterialNumbers& numbers) {
  Storage& s = *storage_;
  const LiveObject& own = s.object(object);
  set_material_numbers(s.worlds[own.worlds], own.body, own.is_solid, s.chosen_of(environments), numbers);
}

MaterialNumbers LiveScene::material(const std::string& object) const {
  const LiveObject& own = storage_->object(object);
  return material_numbers(storage_->worlds[own.worlds], own.body, own.is_solid);
}

bool LiveScene::uses_material_friction(const std::string& object) const {
  const LiveObject& own = storage_->object(object);
  const Worlds& worlds = storage_->worlds[own.worlds];
  constexpr double none = -1;
  return std::any_of(storage_->every.begin(), storage_->every.end(), [&](int e) {
    const std::vector<Obstacle>& obstacles = worlds.given(e).obstacles;
    return std::any_of(obstacles.begin(), obstacles.end(), [&](const Obstacle& obstacle) {
      return friction_on(obstacle, own.body, none) == none;
    });
  });
}

void LiveScene::set_friction(const std::string& object, const std::string& obstacle,
                             const Chosen& environments, const std::vector<double>& friction) {
  Storage& s = *storage_;
  const LiveObject& own = s.object(object);
  const std::size_t number = number_of("obstacle", obstacle, obstacles());
  s.worlds[own.worlds].set_friction(environments, static_cast<int>(number), friction, own.body);
}

void LiveScene::set_gravity(const Chosen& environments, const Tensor& gravity) {
  for (Worlds& of_object : storage_->worlds) of_object.set_gravity(environments, gravity);
}

void LiveScene::set_velocities(const std::string& object, const Chosen& environments,
                               const Tensor& velocities) {
  Storage& s = *storage_;
  const std::size_t number = number_of("object", object, names_of(s.objects));
  const LiveObject& own = s.objects[number];
  const std::span<const int> chosen = s.chosen_of(environments);
  entries_of("velocities", chosen, velocities, {own.vertices, 3});
  std::vector<Tensor> given(s.objects.size());
  given[number] = velocities;
  Worlds& worlds = s.worlds[own.worlds];
  const std::vector<double> rows = s.rows_for(
      own.worlds, chosen, given, [&](int e) { return worlds.environment(e).state.velocities.data(); });
  worlds.set_velocities(environments,
                        dense(rows, {std::ssize(chosen), s.starts[own.worlds].positions.rows(), 3}));
}

void LiveScene::reset(const Chosen& environments, const std::vector<Tensor>& positions,
                      const std::vector<Tensor>& velocities) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.chosen_of(environments);
  for (const auto& [what, given] :
       {std::pair("positions: ", &positions), std::pair("velocities: ", &velocities)})
    for (std::size_t o = 0; o < given->size(); ++o)
      if (!(*given)[o].empty())
        entries_of(what + s.objects.at(o).name, chosen, (*given)[o], {s.objects[o].vertices, 3});
  for (std::size_t w = 0; w < s.worlds.size(); ++w) {
    if (!s.any_given(positions, w) && !s.any_given(velocities, w)) {
      s.worlds[w].reset(environments);
      continue;
    }
    Points still = s.starts[w].velocities;  // but for objects whose positions are given
    for (std::size_t o = 0; o < s.objects.size(); ++o)
      if (s.is_given(positions, o, w))
        still.middleRows(s.objects[o].first_vertex, s.objects[o].vertices).setZero();
    const std::vector<double> x =
        s.rows_for(w, chosen, positions, [&](int) { return s.starts[w].positions.data(); });
    const std::vector<double> v = s.rows_for(w, chosen, velocities, [&](int) { return still.data(); });
    const std::vector<std::int64_t> shape = {std::ssize(chosen), still.rows(), 3};
    s.worlds[w].reset(environments, dense(x, shape), dense(v, shape));
  }
  for (LiveEffector& live : s.effectors)
    for (const int e : chosen) {
      std::copy_n(live.start_poses.begin() + 7 * e, 7, live.poses.begin() + 7 * e);
      live.closed[static_cast<std::size_t>(e)] = false;
    }
  if (std::ssize(chosen) == s.environments) s.interrupted = false;
  s.show();
}

void LiveScene::step(int count) {
  Storage& s = *storage_;
  if (count < 0) throw InputError("count: found " + std::to_string(count) + ", expected 0 or more");
  if (s.interrupted)
    throw InputError(
        "found environments whose last step was interrupted, expected a reset or a load of all before the "
        "next");
  s.interrupted = true;
  s.stop = false;
  if (s.quasistatic) {
    for (int k = 0; k < count; ++k) {
      sim::step(s.worlds, s.threads);
      stop_motion(s.worlds);
    }
  } else {
    // A device is given what moves in all steps of a call.
    constexpr int most_on_device = 100;
    const int part = s.copies ? std::min(count, most_on_device) : count;
    for (int taken = 0; taken < count; taken += part)
      sim::step(s.worlds, s.threads, std::min(part, count - taken));
  }
  s.interrupted = false;
  s.show();
}

void LiveScene::stop() { storage_->stop = true; }

Tensor LiveScene::positions(const std::string& object) const {
  const LiveObject& own = storage_->object(object);
  return rows_of(own, storage_->worlds[own.worlds].positions());
}

Tensor LiveScene::velocities(const std::string& object) const {
  const LiveObject& own = storage_->object(object);
  return rows_of(own, storage_->worlds[own.worlds].velocities());
}

Tensor LiveScene::force(const std::string& name) const {
  return dense(storage_->forces.of(name), {size(), 3});
}

std::vector<std::string> LiveScene::forces() const { return storage_->forces.names(); }

data::Points LiveScene::held_places(const std::string& name, int environment) const {
  const Storage& s = *storage_;
  s.check_environment(environment);
  return s.forces.held_places(name, s.worlds, environment);
}

Tensor LiveScene::pose(const std::string& end_effector) const {
  return dense(storage_->effector(end_effector).poses, {size(), 7});
}

Tensor LiveScene::status() const {
  constexpr std::int64_t columns = sizeof(WorldStatus) / sizeof(double);
  return {.data = &storage_->status.front().steps, .shape = {size(), columns}};
}

Tensor LiveScene::on_device(const Tensor& view) const {
  return storage_->copies && view.device == Device::cpu ? storage_->copies->of(view) : view;
}

const std::string& LiveScene::why_lost(int environment) const {
  for (const Worlds& of_object : storage_->worlds)
    if (of_object.lost(environment) != Lost::no) return of_object.why_lost(environment);
  return storage_->worlds.front().why_lost(environment);
}

std::shared_ptr<const LiveScene::Saved> LiveScene::save(const Chosen& environments) const {
  const Storage& s = *storage_;
  const std::span<const int> chosen = s.chosen_of(environments);
  if (s.interrupted)
    throw InputError("found environments whose last step was interrupted, expected whole ones");
  auto saved = std::make_shared<Saved>();
  for (const Worlds& of_object : s.worlds) saved->worlds.push_back(of_object.save(environments));
  for (const LiveEffector& live : s.effectors) {
    Saved::Effector& effector = saved->effectors.emplace_back();
    for (const int e : chosen) {
      effector.poses.insert(effector.poses.end(), live.poses.begin() + 7 * e,
                            live.poses.begin() + 7 * (e + 1));
      effector.closed.push_back(live.closed[static_cast<std::size_t>(e)]);
    }
  }
  return saved;
}

void LiveScene::load(const Chosen& environments, const Saved& saved) {
  Storage& s = *storage_;
  const std::span<const int> chosen = s.chosen_of(environments);
  if (saved.effectors.size() != s.effectors.size() || saved.worlds.size() != s.worlds.size())
    throw InputError("state: found one of another scene or of other end effectors, expected these");
  for (std::size_t w = 0; w < s.worlds.size(); ++w) s.worlds[w].load(environments, saved.worlds[w]);
  for (std::size_t k = 0; k < s.effectors.size(); ++k)
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const Saved::Effector& effector = saved.effectors[k];
      std::copy_n(effector.poses.begin() + 7 * static_cast<std::ptrdiff_t>(i), 7,
                  s.effectors[k].poses.begin() + 7 * chosen[i]);
      s.effectors[k].closed[static_cast<std::size_t>(chosen[i])] = effector.closed[i];
    }
  if (std::ssize(chosen) == s.environments) s.interrupted = false;
  s.show();
}

std::vector<std::string> LiveScene::instances() const { return storage_->cameras.instances(); }

data::TriangleMesh LiveScene::surface(const std::string& instance, int environment) const {
  const Storage& s = *storage_;
  s.check_environment(environment);
  const std::size_t number = number_of("instance", instance, instances());
  if (number < s.objects.size()) {
    const LiveObject& object = s.objects[number];
    const data::Points& positions = s.worlds[object.worlds].environment(environment).state.positions;
    return {positions.middleRows(object.first_vertex, object.vertices), object.triangles};
  }
  return surface_now(s.cameras.bodies()[number - s.objects.size()], *s.latest(environment));
}

std::vector<std::string> LiveScene::cameras() const { return storage_->cameras.names(); }

const LiveCamera& LiveScene::camera(const std::string& name) const { return storage_->cameras.camera(name); }

void LiveScene::add_camera(const LiveCamera& camera, const Tensor& poses) {
  storage_->cameras.add(camera, storage_->every, poses);
}

void LiveScene::set_camera(const std::string& name, const Chosen& environments, const Tensor& poses) {
  storage_->cameras.set_poses(name, storage_->chosen_of(environments), poses);
}

void LiveScene::render(const std::string& camera, const Chosen& environments, const DepthPictures& pictures,
                       Device at) const {
  const Storage& s = *storage_;
  const std::span<const int> chosen = s.chosen_of(environments);
  std::vector<SeenMesh> objects;
  for (const LiveObject& object : s.objects)
    objects.push_back(seen(object, s.worlds[object.worlds].positions(), chosen));
  std::vector<const Environment*> now;
  for (const int e : chosen) now.push_back(s.latest(e));
  const CameraViews views = s.cameras.views(camera, chosen, now, std::move(objects));
  if (!s.copies)
    sim::render(views.lens, views.base_from_camera, views.meshes, pictures, s.threads);
  else
    s.on_device().render(views.lens, views.base_from_camera, views.meshes, pictures, at);
}

}  // namespace flash::sim
