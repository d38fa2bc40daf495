#pragma once

namespace flash::sim::cuda {

/// Numbers that are read together: a vertex and one more, or four rows of a column.
template <typename Number>
struct alignas(4 * sizeof(Number)) Four {
  Number x, y, z, w;
};

/// A place, the last number unused [m].
using Point = Four<double>;

}  // namespace flash::sim::cuda
