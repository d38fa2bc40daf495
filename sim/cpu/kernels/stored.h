#pragma once
#ifdef __F16C__
#include <immintrin.h>
#endif

#include "sim/cpu/kernels/dense_front.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// Solves read a rounded factor. Single precision keeps eleven bits: in half precision where the machine
// converts it (F16C), which keeps fewer of numbers below 6e-5. Numbers are bounded alike at every level.

template <typename Scalar>
struct StoredOf {
  using type = Scalar;
};
#ifdef __F16C__
template <>
struct StoredOf<float> {
  using type = unsigned short;
};
#endif
template <typename Scalar>
using Stored = typename StoredOf<Scalar>::type;

template <typename Scalar>
typename VectorOf<Scalar>::type load_stored(const Scalar* from) {
  return *reinterpret_cast<const typename VectorOf<Scalar>::type*>(from);
}

inline void store_rounded(VectorOf<double>::type vector, double* to) {
  *reinterpret_cast<VectorOf<double>::type*>(to) = vector;
}

/// Numbers beyond the range of half precision become its largest.
inline VectorOf<float>::type bounded(VectorOf<float>::type vector) {
  using Vector = VectorOf<float>::type;
  const Vector largest = Vector{} + 65504.0f;
  const Vector not_above = vector > largest ? largest : vector;
  return not_above < -largest ? -largest : not_above;
}

#ifndef __F16C__
/// Stores the vector rounded to eleven bits (Veltkamp 1968).
inline void store_rounded(VectorOf<float>::type vector, float* to) {
  const VectorOf<float>::type all = bounded(vector), large = 8193.0f * all;
  *reinterpret_cast<VectorOf<float>::type*>(to) = large - (large - all);
}
#elif defined(__AVX512F__)
template <typename Scalar>
__m512 load_stored(const unsigned short* from) {
  return _mm512_cvtph_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)));
}
inline void store_rounded(VectorOf<float>::type vector, unsigned short* to) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                      _mm512_cvtps_ph(bounded(vector), _MM_FROUND_TO_NEAREST_INT));
}
#else
template <typename Scalar>
__m256 load_stored(const unsigned short* from) {
  return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}
inline void store_rounded(VectorOf<float>::type vector, unsigned short* to) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to),
                   _mm256_cvtps_ph(bounded(vector), _MM_FROUND_TO_NEAREST_INT));
}
#endif

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
