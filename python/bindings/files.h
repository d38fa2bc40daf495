#pragma once
#include <nanobind/nanobind.h>

namespace flash::python {

/// Files of clouds, meshes, lenses and poses as arrays of numpy, for those who look at them. What is wrong in
/// one is a ValueError in one line, as of the programs.
void bind_files(nanobind::module_& module);

}  // namespace flash::python
