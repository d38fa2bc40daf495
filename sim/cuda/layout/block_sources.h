#pragma once

namespace flash::sim::cuda {

/// Vertices of a slice of block rows.
inline constexpr int slice_size = 32;

/// Numbers of one block for each vertex of a slice: three columns of three rows for each of them.
inline constexpr int slice_numbers = 9 * slice_size;

/// A block of the pattern: the triangles' blocks that add up to it, and where it stands in the rows of the
/// matrix, once for each triangle of the matrix.
struct alignas(16) BlockSources {
  int first_source, source_count;  ///< in SheetLayout::block_sources
  int place, turned_place;         ///< of its first number in the block rows; -1 for none
};

}  // namespace flash::sim::cuda
