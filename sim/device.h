#pragma once
#include <string>

namespace flash::sim {

/// Where the steps of a batch run.
enum class Device { cpu, cuda };

/// Why no CUDA device can be used, in a line; empty where one can.
std::string why_no_cuda();

}  // namespace flash::sim
