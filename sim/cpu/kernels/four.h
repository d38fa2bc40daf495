#pragma once
#include "sim/law/lanes.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// A vector of four numbers: a vertex's three and one more.
template <typename Scalar>
struct FourOf {
  typedef Scalar type __attribute__((vector_size(4 * sizeof(Scalar))));
};

template <typename Scalar>
typename FourOf<Scalar>::type load_four(const Scalar* numbers) {
  typename FourOf<Scalar>::type four;
  memcpy(&four, numbers, sizeof(four));
  return four;
}
template <typename Scalar>
void store_four(const typename FourOf<Scalar>::type& four, Scalar* numbers) {
  memcpy(numbers, &four, sizeof(four));
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
