#pragma once

// A team works on one environment. What a thread computes for an entry never depends on how many threads,
// groups, blocks or environments there are: so a batch equals alone, bitwise. The step is written for any
// team: that of a device, or one thread of the processor, by which tests and sanitizers run the same text.
// Its functions are inline, templates or static: a compiler of CUDA leaves one of the same name for the
// processor, and a program may hold both.
#ifdef __CUDACC__
#include "sim/cuda/device_team.cuh"
#else
#include "sim/cuda/serial_team.h"
#endif
