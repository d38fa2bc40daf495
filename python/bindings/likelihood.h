#pragma once
#include <nanobind/nanobind.h>

namespace flash::python {

/// The likelihood of motions by which flash-sysid judges parameters, without its errors of known shape.
void bind_likelihood(nanobind::module_& module);

}  // namespace flash::python
