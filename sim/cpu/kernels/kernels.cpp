// Compiled once for each instruction level, FLASH_LEVEL: nothing that other sources share may be defined
// here.
#include "sim/cpu/kernels.h"

#include "sim/cpu/kernels/fronts.h"
#include "sim/cpu/kernels/membranes.h"
#include "sim/cpu/kernels/products.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {
namespace {

template <typename Scalar>
constexpr LinearKernels<Scalar> linear_kernels = {
    sizeof(Stored<Scalar>),  factorize<Scalar>, solve<Scalar>, copy_blocks<Scalar>,
    multiply_blocks<Scalar>, add_rows<Scalar>,  dot<Scalar>,   add_scaled<Scalar>,
    scale_and_add<Scalar>};

}  // namespace

extern const Kernels kernels;
const Kernels kernels = {linear_kernels<float>, linear_kernels<double>, add_membrane_gradient,
                         add_membrane_hessian};

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
