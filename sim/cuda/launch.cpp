#include "sim/cuda/launch.h"

#include <stdexcept>
#include <string>

namespace flash::sim::cuda {

void check(cudaError_t status) {
  if (status != cudaSuccess) throw std::runtime_error(std::string("CUDA: ") + cudaGetErrorString(status));
}

}  // namespace flash::sim::cuda
