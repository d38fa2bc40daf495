#pragma once
#ifdef __F16C__
#include <immintrin.h>
#endif

#include "sim/cpu/kernels/dense_front.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// What solves read of a factor. Of one in single precision eleven bits, at every level the same: in half
// precision where the machine converts it (F16C).

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

#ifndef __F16C__
/// Rounded to eleven bits (Veltkamp 1968).
inline void store_rounded(VectorOf<float>::type vector, float* to) {
  const VectorOf<float>::type large = 8193.0f * vector;
  *reinterpret_cast<VectorOf<float>::type*>(to) = large - (large - vector);
}
#else
inline constexpr float largest_half = 65504;

#ifdef __AVX512F__
template <typename Scalar>
__m512 load_stored(const unsigned short* from) {
  return _mm512_cvtph_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)));
}
/// The largest there is in place of what is larger.
inline void store_rounded(__m512 vector, unsigned short* to) {
  const __m512 bounded =
      _mm512_min_ps(_mm512_max_ps(vector, _mm512_set1_ps(-largest_half)), _mm512_set1_ps(largest_half));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm512_cvtps_ph(bounded, _MM_FROUND_TO_NEAREST_INT));
}
#else
template <typename Scalar>
__m256 load_stored(const unsigned short* from) {
  return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}
/// The largest there is in place of what is larger.
inline void store_rounded(__m256 vector, unsigned short* to) {
  const __m256 bounded =
      _mm256_min_ps(_mm256_max_ps(vector, _mm256_set1_ps(-largest_half)), _mm256_set1_ps(largest_half));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm256_cvtps_ph(bounded, _MM_FROUND_TO_NEAREST_INT));
}
#endif
#endif

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
