#pragma once
#include "sim/cuda/device_array.h"
#include "sim/cuda/front_tables.h"
#include "sim/cuda/layout/sheet_layout.h"
#include "sim/cuda/sheet_tables.h"

namespace flash::sim::cuda {

/// Settings with panels that fit on chip beside the rest of a factorization.
FrontSettings fitting_fronts(FrontSettings settings = {});

/// The bending of a material on the device, shared by the environments that have it.
class DeviceBending {
 public:
  explicit DeviceBending(const SheetLayout& layout);

  /// Sets what tables have of bending.
  void put(SheetTables& sheet) const;

 private:
  int bundle_count_, hinge_count_;
  DeviceArray<int> group_rows_, bundle_starts_;
  DeviceArray<StepColumns> step_columns_;
  DeviceArray<double> step_values_, hinge_weights_, hinge_rest_angles_, hinge_rest_areas_;
  DeviceArray<float> single_step_values_, stand_in_;
  DeviceArray<int> hinge_vertices_, hinge_corner_starts_, hinge_corners_, hinge_source_starts_,
      hinge_sources_;
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
  template <typename Number>
  const Number* upload(const std::vector<Number>& numbers, std::vector<DeviceArray<Number>>& arrays);

  DeviceBending bending_;
  std::vector<DeviceArray<int>> ints_;
  std::vector<DeviceArray<double>> doubles_;
  std::vector<DeviceArray<FrontLayout>> fronts_;
  std::vector<DeviceArray<FrontLevel>> levels_;
  std::vector<DeviceArray<BlockPlace>> places_;
  std::vector<DeviceArray<SolveChunk>> chunks_;
  std::vector<DeviceArray<Gather>> gathers_;
  std::vector<DeviceArray<EdgeSources>> sources_;
};

}  // namespace flash::sim::cuda
