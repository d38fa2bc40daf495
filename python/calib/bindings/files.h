#pragma once
#include <nanobind/nanobind.h>

namespace flash::python {

/// Answers and lenses in files, and targets in words.
void bind_files(nanobind::module_& module);

}  // namespace flash::python
