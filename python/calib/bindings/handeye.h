#pragma once
#include <nanobind/nanobind.h>

namespace flash::python {

/// Hand-eye calibration of arrays: of pairs of poses, and of corners. Shapes are checked in Python; poses are
/// read as those of files are.
void bind_handeye(nanobind::module_& module);

}  // namespace flash::python
