#pragma once
#include "sim/cuda/device_array.h"
#include "sim/cuda/front_tables.h"
#include "sim/cuda/layout/sheet_layout.h"
#include "sim/cuda/sheet_tables.h"

namespace flash::sim::cuda {

/// Settings with panels that fit on chip beside the rest of a factorization.
FrontSettings fitting_fronts(FrontSettings settings = {});

/// Vectors that stay on the device.
class DeviceVectors {
 public:
  /// Where the numbers of a vector are; null for none.
  template <typename Number>
  const Number* upload(const std::vector<Number>& numbers) {
    const std::size_t bytes = numbers.size() * sizeof(Number);
    arrays_.emplace_back(bytes);
    arrays_.back().write(0, reinterpret_cast<const char*>(numbers.data()), bytes);
    return reinterpret_cast<const Number*>(arrays_.back().data());
  }

 private:
  std::vector<DeviceArray<char>> arrays_;
};

/// The bending of a material on the device, shared by the environments that have it.
class DeviceBending {
 public:
  explicit DeviceBending(const SheetLayout& layout);

  /// Tables with the bending in place of theirs.
  SheetTables in(SheetTables sheet) const;

 private:
  DeviceVectors vectors_;
  SheetTables tables_{};  ///< with no more than bending
};

/// The structure of a sheet on the device, once for all its environments.
class DevicePlan {
 public:
  DevicePlan(const FrontPlan& fronts, const SheetLayout& layout);

  /// `fronts` with how the warps of teams of so many blocks share solves.
  FrontTables shared_out(const FrontPlan& plan, int team_blocks);

  FrontTables fronts{};
  SheetTables sheet{};  ///< with the bending of its layout

 private:
  DeviceVectors vectors_;
};

}  // namespace flash::sim::cuda
