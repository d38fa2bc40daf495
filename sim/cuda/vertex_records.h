#pragma once
#include <type_traits>

namespace flash::sim::cuda {

/// Layers of a record for each vertex, taken apart into numbers of eight bytes: the first numbers of all
/// vertices, then the second ones. So a warp, whose lanes have vertices that follow each other, reads and
/// writes whole lines of memory.
template <typename Record>
struct VertexRecords {
  static_assert(std::is_trivially_copyable_v<Record> && sizeof(Record) % sizeof(double) == 0);
  static constexpr int numbers_each = sizeof(Record) / sizeof(double);

  double* numbers;  ///< numbers_each for each vertex and layer
  int size;         ///< vertices
};

}  // namespace flash::sim::cuda
