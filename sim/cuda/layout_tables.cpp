#include "sim/cuda/layout_tables.h"

#include <numeric>

#include "sim/law/least_weight.h"

namespace flash::sim::cuda {

std::vector<double> by_halves(const std::vector<double>& steps) {
  constexpr std::size_t lanes = 4 * bundle_groups;
  std::vector<double> halves(steps.size());
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const std::size_t step = k / (4 * lanes), lane = k / 4 % lanes, number = k % 4;
    halves[4 * lanes * step + 2 * lanes * (number / 2) + 2 * lane + number % 2] = steps[k];
  }
  return halves;
}

std::vector<StepColumns> by_steps_together(const std::vector<int>& columns) {
  constexpr std::size_t lanes = 4 * bundle_groups;
  std::vector<StepColumns> together(columns.size() / steps_together);
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const std::size_t step = k / lanes;
    together[lanes * (step / steps_together) + k % lanes].of[step % steps_together] =
        static_cast<unsigned short>(columns[k]);
  }
  return together;
}

double least_area_of(const SheetLayout& layout) {
  return least_vertex_share * std::accumulate(layout.vertex_area.begin(), layout.vertex_area.end(), 0.0) /
         layout.size;
}

}  // namespace flash::sim::cuda
