#include "python/bindings/cameras.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "python/bindings/arrays.h"
#include "sim/device_copies.h"

namespace flash::python {

namespace nb = nanobind;
using sim::LiveScene;

namespace {

/// Where a picture is written; Python has looked at its shape, and that all are in one memory.
template <class Number>
using Picture = std::optional<nb::ndarray<Number, nb::c_contig>>;

/// So many numbers; an array may say otherwise of its shape than it has memory.
template <class Number>
void check_size(const char* name, const Picture<Number>& picture, std::size_t numbers) {
  if (picture && picture->size() != numbers)
    throw nb::value_error(("render: out: " + std::string(name) + ": found " +
                           std::to_string(picture->size()) + " numbers, expected " + std::to_string(numbers))
                              .c_str());
}

template <class Number>
bool is_on_device(const Picture<Number>& picture) {
  return picture && picture->device_type() != nb::device::cpu::value;
}

template <class Number>
Number* start_of(const Picture<Number>& picture) {
  return picture ? picture->data() : nullptr;
}

sim::LiveCamera camera_of(const std::string& name, const std::array<int, 2>& size,
                          const std::array<double, 4>& lens, const std::string& carrier,
                          const std::vector<std::string>& sees) {
  sim::LiveCamera camera{.name = name, .lens = {}, .carrier = carrier, .sees = sees};
  camera.lens.width = size[0], camera.lens.height = size[1];
  camera.lens.fx = lens[0], camera.lens.fy = lens[1];
  camera.lens.cx = lens[2], camera.lens.cy = lens[3];
  return camera;
}

}  // namespace

void bind_cameras(nb::class_<Simulation>& simulation) {
  simulation.def("cameras",
                 [](Simulation& s) { return s.use([](LiveScene& live) { return live.cameras(); }); });
  simulation.def("instances",
                 [](Simulation& s) { return s.use([](LiveScene& live) { return live.instances(); }); });
  simulation.def("camera_size", [](Simulation& s, const std::string& name) {
    return s.use([&](LiveScene& live) {
      const data::CameraIntrinsics& lens = live.camera(name).lens;
      return std::array<int, 2>{lens.width, lens.height};
    });
  });
  simulation.def("add_camera", [](Simulation& s, const std::string& name, const std::array<int, 2>& size,
                                  const std::array<double, 4>& lens, const Numbers& poses,
                                  const std::string& carrier, const std::vector<std::string>& sees) {
    s.use([&](LiveScene& live) {
      live.add_camera(camera_of(name, size, lens, carrier, sees), tensor_of(poses));
    });
  });
  simulation.def("set_camera", [](Simulation& s, const std::string& name,
                                  const std::vector<int>& environments, const Numbers& poses) {
    s.use([&](LiveScene& live) { live.set_camera(name, environments, tensor_of(poses)); });
  });
  simulation.def(
      "render",
      [](Simulation& s, const std::string& name, const std::vector<int>& environments,
         const Picture<float>& depth, const Picture<float>& distance, const Picture<std::uint8_t>& instance,
         const Picture<std::int32_t>& triangle, const Picture<float>& points) {
        s.use([&](LiveScene& live) {
          const data::CameraIntrinsics& lens = live.camera(name).lens;
          const std::size_t pixels = environments.size() * static_cast<std::size_t>(lens.width) *
                                     static_cast<std::size_t>(lens.height);
          check_size("depth", depth, pixels);
          check_size("distance", distance, pixels);
          check_size("instance", instance, pixels);
          check_size("triangle", triangle, pixels);
          check_size("points", points, 3 * pixels);
          const bool there = is_on_device(depth) || is_on_device(distance) || is_on_device(instance) ||
                             is_on_device(triangle) || is_on_device(points);
          const nb::gil_scoped_release release;
          const sim::KeptCudaDevice kept;
          live.render(
              name, environments,
              {start_of(depth), start_of(distance), start_of(instance), start_of(triangle), start_of(points)},
              there ? sim::Device::cuda : sim::Device::cpu);
        });
      },
      nb::arg("camera"), nb::arg("environments"), nb::arg("depth").noconvert().none(),
      nb::arg("distance").noconvert().none(), nb::arg("instance").noconvert().none(),
      nb::arg("triangle").noconvert().none(), nb::arg("points").noconvert().none());
}

}  // namespace flash::python
