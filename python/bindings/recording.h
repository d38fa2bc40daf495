#pragma once
#include <nanobind/nanobind.h>

#include <string>
#include <vector>

#include "data/recording/recording.h"

namespace flash::python {

/// A recording with all that its keyframes saw.
struct LoadedRecording {
  data::Recording recording;
  std::vector<data::Keyframe> keyframes;
};

void bind_recording(nanobind::module_& module);

}  // namespace flash::python
