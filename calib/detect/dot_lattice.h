#pragma once
#include <Eigen/Core>
#include <vector>

namespace flash::calib {

/// Which of the places are the dots of a grid, row by row from one of its corners: grown from dot to dot,
/// each step about as long as the last one of its kind, so that lens and slant may bend and narrow it. Places
/// beside the grid do no harm unless they go on with it. Empty where no whole grid is found.
std::vector<std::size_t> dot_lattice(const std::vector<Eigen::Vector2d>& places, int columns, int rows);

/// Whether places that are ordered row by row lie as a grid does: from each dot the next ones are about where
/// those before say.
bool is_lattice(const std::vector<Eigen::Vector2d>& places, int columns, int rows);

}  // namespace flash::calib
