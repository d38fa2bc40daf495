#pragma once
#include <cstddef>
#include <new>
#include <vector>

namespace flash::sim {

/// Widest vector of any instruction level [bytes]; a cache line.
inline constexpr std::size_t vector_alignment = 64;

/// Allocates memory that starts on a whole vector of every instruction level.
template <typename Scalar>
struct AlignedAllocator {
  using value_type = Scalar;
  AlignedAllocator() = default;
  template <typename Other>
  AlignedAllocator(const AlignedAllocator<Other>&) {}
  Scalar* allocate(std::size_t count) {
    return static_cast<Scalar*>(::operator new(count * sizeof(Scalar), std::align_val_t(vector_alignment)));
  }
  void deallocate(Scalar* data, std::size_t) { ::operator delete(data, std::align_val_t(vector_alignment)); }
  bool operator==(const AlignedAllocator&) const { return true; }
};

template <typename Scalar>
using AlignedStorage = std::vector<Scalar, AlignedAllocator<Scalar>>;

}  // namespace flash::sim
