#include "python/bindings/simulation.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <chrono>
#include <exception>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "data/files/error.h"
#include "python/bindings/arrays.h"
#include "python/bindings/cameras.h"
#include "sim/named.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

using Environments = std::vector<int>;  ///< by their numbers

/// Environments as they stood.
struct SavedState {
  std::shared_ptr<const sim::LiveScene::Saved> saved;
};

std::vector<sim::Tensor> tensors_of(const std::vector<std::optional<Numbers>>& arrays) {
  std::vector<sim::Tensor> tensors;
  for (const std::optional<Numbers>& array : arrays)
    tensors.push_back(array ? tensor_of(*array) : sim::Tensor());
  return tensors;
}

/// The choice of one device.
sim::DeviceChoice one_device(const std::string& name) {
  sim::DeviceChoice choice = sim::choose_device(name);
  if (choice.cuda_devices.size() > 1)
    throw data::InputError("--device: found \"" + name + "\", expected one device");
  return choice;
}

sim::Tensor column_of(const sim::Tensor& rows, int column) {
  sim::Tensor tensor = rows;
  tensor.data = static_cast<const double*>(rows.data) + column;
  tensor.shape = {rows.shape[0]};
  tensor.strides = {rows.shape[1]};
  return tensor;
}

}  // namespace

void check_device(const std::string& device) { one_device(device); }

Simulation::Simulation(const data::Scene& scene, int environments, int threads, const std::string& device) {
  sim::DeviceChoice choice = one_device(device);
  if (choice.device == sim::Device::cuda) {
    const sim::KeptCudaDevice kept;
    try {
      live_ = std::make_shared<sim::LiveScene>(scene, environments, threads, choice);
    } catch (const std::exception& error) {
      if (device != "auto") throw;
      why_not_cuda_ = error.what();
    }
  }
  if (!live_) live_ = std::make_shared<sim::LiveScene>(scene, environments, threads);
  choice = live_->device();
  on_cuda_ = choice.device == sim::Device::cuda;
  if (on_cuda_) device_ = "cuda:" + std::to_string(choice.cuda_devices.front());
}

std::vector<std::string> Simulation::notices() {
  std::vector<std::string> all = use([](sim::LiveScene& live) { return live.notices(); });
  if (!why_not_cuda_.empty()) all.push_back("device: the processor steps it (" + why_not_cuda_ + ")");
  return all;
}

void Simulation::close() {
  use([&](sim::LiveScene&) { live_.reset(); });
}

double Simulation::time_steps(const std::string& end_effector, const sim::Tensor& poses) {
  return use([&](sim::LiveScene& live) {
    const nb::gil_scoped_release release;
    const auto steps = [&] {
      sim::Tensor of_step{.data = poses.data, .shape = {live.size(), 7}};
      for (std::int64_t k = 0; k < poses.shape[0]; ++k) {
        live.move_end_effector(end_effector, {}, of_step);
        live.step();
        of_step.data = static_cast<const double*>(of_step.data) + 7 * live.size();
      }
    };
    const auto start = std::chrono::steady_clock::now();
    worker_.start(steps).get();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  });
}

void Simulation::step(int count) {
  use([&](sim::LiveScene& live) {
    // In a thread of its own, so that this one can see signals.
    std::future<void> steps = worker_.start([&] { live.step(count); });
    await(steps, [&] { live.stop(); });
  });
}

void bind_simulation(nb::module_& module) {
  using sim::LiveScene;
  nb::class_<SavedState>(module, "State",
                         "Environments as they stood. What it holds load_state alone reads.");

  nb::class_<Simulation> simulation(module, "Simulation");
  simulation.def(nb::init<const data::Scene&, int, int, const std::string&>());
  simulation.def("step", &Simulation::step);
  simulation.def("time_steps", [](Simulation& s, const std::string& end_effector, const Numbers& poses) {
    return s.time_steps(end_effector, tensor_of(poses));
  });
  simulation.def("close", &Simulation::close);
  module.def("check_device", &check_device);

  // What it is made of.
  simulation.def("time_step",
                 [](Simulation& s) { return s.use([](LiveScene& live) { return live.time_step(); }); });
  simulation.def("device", &Simulation::device);
  simulation.def("notices", &Simulation::notices);
  simulation.def("obstacles",
                 [](Simulation& s) { return s.use([](LiveScene& live) { return live.obstacles(); }); });
  simulation.def("end_effectors",
                 [](Simulation& s) { return s.use([](LiveScene& live) { return live.end_effectors(); }); });
  simulation.def("forces",
                 [](Simulation& s) { return s.use([](LiveScene& live) { return live.forces(); }); });
  simulation.def("held_places", [](Simulation& s, const std::string& name, int environment) {
    return s.use([&](LiveScene& live) { return array_of(live.held_places(name, environment)); });
  });
  simulation.def("surface", [](Simulation& s, const std::string& instance, int environment) {
    return s.use([&](LiveScene& live) {
      const data::TriangleMesh mesh = live.surface(instance, environment);
      return nb::make_tuple(array_of(mesh.vertices), array_of(mesh.triangles));
    });
  });
  simulation.def("vertices", [](Simulation& s, const std::string& object) {
    return s.use([&](LiveScene& live) {
      const auto& all = live.objects();
      return all[sim::number_of("object", object, sim::names_of(all))].vertices;
    });
  });
  simulation.def("objects", [](Simulation& s) {
    return s.use([](LiveScene& live) {
      nb::dict objects;
      for (const sim::LiveObject& object : live.objects())
        objects[object.name.c_str()] = array_of(object.triangles);
      return objects;
    });
  });

  // End effectors.
  simulation.def("add_end_effector", [](Simulation& s, const std::string& name, const Numbers& poses,
                                        const std::array<double, 3>& size, double reach, bool collides,
                                        std::optional<double> friction) {
    const sim::EndEffector effector{.name = name,
                                    .half_extents = 0.5 * Eigen::Vector3d(size[0], size[1], size[2]),
                                    .threshold = reach,
                                    .collides = collides,
                                    .friction = friction};
    s.use([&](LiveScene& live) { live.add_end_effector(effector, tensor_of(poses)); });
  });
  simulation.def("move_end_effector", [](Simulation& s, const std::string& name,
                                         const Environments& environments, const Numbers& poses) {
    s.use([&](LiveScene& live) { live.move_end_effector(name, environments, tensor_of(poses)); });
  });
  simulation.def("grasp", [](Simulation& s, const std::string& name, const std::vector<int>& closing,
                             const std::vector<int>& opening) {
    s.use([&](LiveScene& live) {
      live.close(name, closing);
      live.open(name, opening);
    });
  });
  simulation.def("held", [](Simulation& s, const std::string& name) {
    return s.use([&](LiveScene& live) { return live.held(name); });
  });

  // State.
  const auto def_view = [&](const char* name, sim::Tensor (LiveScene::*view)(const std::string&) const) {
    simulation.def(name, [view](Simulation& s, const std::string& of) {
      return s.use([&](LiveScene& live) { return view_of((live.*view)(of), s.shared()); });
    });
  };
  def_view("positions", &LiveScene::positions);
  def_view("velocities", &LiveScene::velocities);
  def_view("pose", &LiveScene::pose);
  // On a device as well, where that steps.
  simulation.def("force", [](Simulation& s, const std::string& of, bool on_device) {
    return s.use([&](LiveScene& live) {
      const sim::Tensor force = live.force(of);
      return view_of(on_device ? live.on_device(force) : force, s.shared());
    });
  });
  simulation.def(
      "status",
      [](Simulation& s, bool on_device, std::optional<int> column) {
        return s.use([&](LiveScene& live) {
          sim::Tensor status = on_device ? live.on_device(live.status()) : live.status();
          return view_of(column ? column_of(status, *column) : status, s.shared());
        });
      },
      nb::arg("on_device") = false, nb::arg("column") = nb::none());
  simulation.def("why_lost", [](Simulation& s) {
    return s.use([](LiveScene& live) {
      std::vector<std::string> reasons;
      for (int e = 0; e < live.size(); ++e) reasons.push_back(live.why_lost(e));
      return reasons;
    });
  });
  simulation.def("reset", [](Simulation& s, const Environments& environments,
                             const std::vector<std::optional<Numbers>>& positions,
                             const std::vector<std::optional<Numbers>>& velocities) {
    s.use([&](LiveScene& live) { live.reset(environments, tensors_of(positions), tensors_of(velocities)); });
  });
  simulation.def("set_velocities", [](Simulation& s, const std::string& object,
                                      const Environments& environments, const Numbers& velocities) {
    s.use([&](LiveScene& live) { live.set_velocities(object, environments, tensor_of(velocities)); });
  });
  simulation.def("save", [](Simulation& s, const Environments& environments) {
    return s.use([&](LiveScene& live) { return SavedState{live.save(environments)}; });
  });
  simulation.def("load", [](Simulation& s, const Environments& environments, const SavedState& state) {
    s.use([&](LiveScene& live) { live.load(environments, *state.saved); });
  });

  // What may differ between environments.
  simulation.def("material", [](Simulation& s, const std::string& object) {
    return s.use([&](LiveScene& live) { return live.material(object); });
  });
  simulation.def("set_material", [](Simulation& s, const std::string& object,
                                    const Environments& environments, const sim::MaterialNumbers& numbers) {
    s.use([&](LiveScene& live) { live.set_material(object, environments, numbers); });
  });
  simulation.def("uses_material_friction", [](Simulation& s, const std::string& object) {
    return s.use([&](LiveScene& live) { return live.uses_material_friction(object); });
  });
  simulation.def("set_friction", [](Simulation& s, const std::string& object, const std::string& obstacle,
                                    const Environments& environments, const std::vector<double>& friction) {
    s.use([&](LiveScene& live) { live.set_friction(object, obstacle, environments, friction); });
  });
  simulation.def("set_gravity", [](Simulation& s, const Environments& environments, const Numbers& gravity) {
    s.use([&](LiveScene& live) { live.set_gravity(environments, tensor_of(gravity)); });
  });

  bind_cameras(simulation);
}

}  // namespace flash::python
