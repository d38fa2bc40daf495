#include "sysid/observe/sheet_shift.h"

#include <algorithm>

#include "data/machine/parallel.h"

namespace flash::sysid {

void add(SheetShifts& a, double share, const SheetShifts& b) {
  if (a.empty()) {
    a = b;
    for (SheetShift& shift : a) {
      shift.positions *= share;
      shift.force *= share;
    }
    return;
  }
  for (std::size_t k = 0; k < a.size(); ++k) {
    a[k].positions += share * b[k].positions;
    a[k].force += share * b[k].force;
  }
}

std::vector<SheetShapes> side_by_side(const std::vector<const SheetShifts*>& shifts, int threads) {
  const auto any =
      std::find_if(shifts.begin(), shifts.end(), [](const SheetShifts* each) { return !each->empty(); });
  if (any == shifts.end()) return {};
  const auto columns = static_cast<Eigen::Index>(shifts.size());
  const SheetShifts& first = **any;
  std::vector<SheetShapes> shapes(first.size());
  data::for_each_in_parallel(shapes.size(), threads, [&](std::size_t k) {
    shapes[k].positions.setZero(first[k].positions.size(), columns);
    shapes[k].force.setZero(3, columns);
    for (Eigen::Index c = 0; c < columns; ++c) {
      const SheetShifts& each = *shifts[static_cast<std::size_t>(c)];
      if (each.empty()) continue;
      shapes[k].positions.col(c) =
          Eigen::Map<const Eigen::VectorXd>(each[k].positions.data(), each[k].positions.size());
      shapes[k].force.col(c) = each[k].force;
    }
  });
  return shapes;
}

void mix(const std::vector<SheetShapes>& shapes, const Eigen::VectorXd& sizes, SheetShifts& sum) {
  sum.resize(shapes.size());
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    sum[k].positions.resize(shapes[k].positions.rows() / 3, 3);
    Eigen::Map<Eigen::VectorXd>(sum[k].positions.data(), sum[k].positions.size()).noalias() =
        shapes[k].positions * sizes;
    sum[k].force = shapes[k].force * sizes;
  }
}

}  // namespace flash::sysid
