#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <exception>
#include <string>

#include "data/asset/asset.h"
#include "data/files/error.h"
#include "data/scene/scene.h"
#include "python/bindings/arrays.h"
#include "python/bindings/files.h"
#include "python/bindings/messages.h"
#include "python/bindings/recording.h"
#include "python/bindings/replay.h"
#include "python/bindings/simulation.h"
#include "sim/device_error.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

/// Bad input is a ValueError with the same line, in which options of programs are arguments.
void raise_input_errors() {
  nb::register_exception_translator([](const std::exception_ptr& error, void*) {
    try {
      std::rethrow_exception(error);
    } catch (const data::InputError& bad) {
      PyErr_SetString(PyExc_ValueError, as_arguments(bad.what()).c_str());
    } catch (const sim::OutOfDeviceMemory& full) {
      PyErr_SetString(PyExc_MemoryError, full.what());
    }
  });
}

void bind_scene(nb::module_& module) {
  nb::class_<data::Scene>(module, "Scene")
      .def_prop_ro("name", [](const data::Scene& scene) { return scene.name; })
      .def_prop_ro("assets", [](const data::Scene& scene) {
        nb::dict assets;
        for (const data::SceneObject& object : scene.objects) assets[object.name.c_str()] = object.asset;
        return assets;
      });
  module.def("load_scene", &data::load_scene);
  module.def("check_asset", [](const std::string& path) { data::load_asset(path); });
}

}  // namespace

}  // namespace flash::python

NB_MODULE(_core, module) {
  module.attr("__version__") = FLASH_VERSION;
  flash::python::raise_input_errors();
  flash::python::bind_scene(module);
  flash::python::bind_arrays(module);
  flash::python::bind_files(module);
  flash::python::bind_simulation(module);
  flash::python::bind_recording(module);
  flash::python::bind_replay(module);
}
