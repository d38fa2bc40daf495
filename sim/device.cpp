#include "sim/device.h"

#ifdef FLASH_HAVE_CUDA
#include "sim/cuda/batch_system.h"
#endif

namespace flash::sim {

std::string why_no_cuda() {
#ifdef FLASH_HAVE_CUDA
  const std::string why = cuda::why_no_device();
  return why.empty() ? why : "no CUDA device can be used (" + why + ")";
#else
  return "this program was built without CUDA";
#endif
}

}  // namespace flash::sim
