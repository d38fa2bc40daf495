// This file is compiled once for each FLASH_LEVEL; it defines nothing that other sources share.
#include "sim/cpu/kernels.h"

#include "sim/cpu/kernels/fronts.h"
#include "sim/cpu/kernels/membranes.h"
#include "sim/cpu/kernels/products.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {
namespace {

template <typename Scalar>
constexpr LinearKernels<Scalar> linear_kernels = {
    .stored_bytes = sizeof(Stored<Scalar>),
    .factorize = factorize<Scalar>,
    .solve = solve<Scalar>,
    .copy_blocks = copy_blocks<Scalar>,
    .multiply_blocks = multiply_blocks<Scalar>,
    .add_rows = add_rows<Scalar>,
    .dot = dot<Scalar>,
    .add_scaled = add_scaled<Scalar>,
    .scale_and_add = scale_and_add<Scalar>,
};

}  // namespace

extern const Kernels kernels;
const Kernels kernels = {
    .single_precision = linear_kernels<float>,
    .double_precision = linear_kernels<double>,
    .add_membrane_gradient = add_membrane_gradient,
    .add_membrane_hessian = add_membrane_hessian,
};

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
