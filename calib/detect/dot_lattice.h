#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

namespace flash::calib {

/// Whether places, row by row, lie as a lattice seen through any usual lens: no step along a row or a column
/// differs from the next by more than 0.4 of it.
bool is_lattice(const std::vector<Eigen::Vector2d>& places, int columns, int rows);

/// Dots of a grid among others, row by row from any of its corners, either way round [px]. A lattice is grown
/// from one dot, step by step, each step predicted by those beside it; its rows and columns are those along
/// which it fills `columns` x `rows`. Up to a tenth may be missing, of each side less than half: those are
/// put where the others say. Empty where no such grid is seen.
std::optional<std::vector<Eigen::Vector2d>> find_dot_lattice(const std::vector<Eigen::Vector2d>& dots,
                                                             int columns, int rows);

}  // namespace flash::calib
