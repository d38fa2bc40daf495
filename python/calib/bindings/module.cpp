#include <nanobind/nanobind.h>

#include <exception>

#include "data/files/error.h"
#include "python/calib/bindings/files.h"
#include "python/calib/bindings/handeye.h"

namespace flash::python {
namespace {

/// Bad input is a ValueError with the line that the programs print.
void raise_input_errors() {
  nanobind::register_exception_translator([](const std::exception_ptr& error, void*) {
    try {
      std::rethrow_exception(error);
    } catch (const data::InputError& bad) {
      PyErr_SetString(PyExc_ValueError, bad.what());
    }
  });
}

}  // namespace
}  // namespace flash::python

NB_MODULE(_core, module) {
  module.attr("__version__") = FLASH_VERSION;
  flash::python::raise_input_errors();
  flash::python::bind_handeye(module);
  flash::python::bind_files(module);
}
