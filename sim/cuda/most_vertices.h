#pragma once

namespace flash::sim::cuda {

/// Vertices of a sheet at most: the columns of bending's numbers have two bytes each.
inline constexpr int most_vertices = 1 << 16;

}  // namespace flash::sim::cuda
