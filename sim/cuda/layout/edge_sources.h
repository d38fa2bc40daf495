#pragma once

namespace flash::sim::cuda {

/// Vertices of a slice of block rows.
inline constexpr int slice_size = 32;

/// Groups of four scalar rows that a warp goes through side by side, four lanes each: a bundle.
inline constexpr int bundle_groups = 8;

/// The steps of a bundle are as many as a multiple of this: what so many read is on its way together.
inline constexpr int steps_together = 4;

/// Numbers of one block for each vertex of a slice: three columns of three rows for each of them.
inline constexpr int slice_numbers = 9 * slice_size;

/// An edge's block: what the triangles at the edge give, numbered three a triangle, the blocks (1,0), (2,0),
/// (2,1); -1 for none.
struct alignas(16) EdgeSources {
  int first = -1, second = -1;
  int turned = 0;  ///< whether the block stands for its transpose

  void add(int source) { (first < 0 ? first : second) = source; }
};

}  // namespace flash::sim::cuda
