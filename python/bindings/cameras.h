#pragma once
#include <nanobind/nanobind.h>

#include "python/bindings/simulation.h"

namespace flash::python {

/// Cameras of a simulation, and their pictures in arrays of numpy.
void bind_cameras(nanobind::class_<Simulation>& simulation);

}  // namespace flash::python
