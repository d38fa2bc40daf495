#pragma once
#include "sim/cuda/device_array.h"
#include "sim/cuda/front_tables.h"
#include "sim/cuda/layout/sheet_layout.h"
#include "sim/cuda/sheet_tables.h"

namespace flash::sim::cuda {

/// Settings with panels that fit on chip beside the rest of a factorization.
FrontSettings fitting_fronts(FrontSettings settings = {});

/// The structure of a sheet on the device, once for all its environments.
class DevicePlan {
 public:
  DevicePlan(const FrontPlan& fronts, const SheetLayout& layout);

  /// `fronts` with how the warps of teams of so many blocks share solves.
  FrontTables shared_out(const FrontPlan& plan, int team_blocks);

  FrontTables fronts{};
  SheetTables sheet{};

 private:
  template <typename Number>
  const Number* upload(const std::vector<Number>& numbers, std::vector<DeviceArray<Number>>& arrays);

  std::vector<DeviceArray<int>> ints_;
  std::vector<DeviceArray<double>> doubles_;
  std::vector<DeviceArray<float>> floats_;
  std::vector<DeviceArray<FrontLayout>> fronts_;
  std::vector<DeviceArray<FrontLevel>> levels_;
  std::vector<DeviceArray<BlockPlace>> places_;
  std::vector<DeviceArray<SolveChunk>> chunks_;
  std::vector<DeviceArray<Gather>> gathers_;
  std::vector<DeviceArray<EdgeSources>> sources_;
  std::vector<DeviceArray<StepColumns>> columns_;
};

}  // namespace flash::sim::cuda
