#pragma once

namespace flash::sim {

inline constexpr int triangle_group_size = 8;

/// Eight triangles that go through the membrane's formulas together. In each triangle the vertices ascend, so
/// that its blocks (1, 0), (2, 0) and (2, 1) are stored as they are.
struct alignas(64) TriangleGroup {
  double gradients[4][triangle_group_size];  ///< w of F = (x1 - x0) w1^T + (x2 - x0) w2^T: w1, then w2 [1/m]
  double area[triangle_group_size];          ///< [m^2]
  int vertices[3][triangle_group_size];
  int slots[3][triangle_group_size];  ///< of blocks (1, 0), (2, 0), (2, 1) in a BlockPattern
  int count = 0;                      ///< triangles; the lanes behind them repeat the last
};

}  // namespace flash::sim
