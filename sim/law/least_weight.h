#pragma once

namespace flash::sim {

/// A step is solved where no vertex misses more than a share of its weight. One among small cells counts as
/// no lighter than this part of the mean of its body: the forces between its cells are far above its weight.
inline constexpr double least_vertex_share = 0.1;

}  // namespace flash::sim
