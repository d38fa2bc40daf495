#pragma once
// Sheets on a table and a hand that lifts one by its corner, for tests of live scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "sim/live_scene.h"

namespace flash::sim {

/// A scene of coarse sheets on a table, side by side; several meet each other, or do not.
class LiveScenes : public testing::Test {
 protected:
  LiveScenes()
      : folder_(
            std::filesystem::temp_directory_path() /
            ("flash_live_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "towel.json")
        << R"({"schema": "flash-asset/1", "mesh": "sheet:0.2x0.2:0.04", "element_type": "TRIANGLE",
               "mechanical_props": {"areal_density": 0.2, "thickness": 0.001, "young": 1e5, "poisson": 0.3,
               "constitutive": "TRI_COROTATED", "bending_rigidity": 3e-5, "friction": 0.3}})";
  }
  ~LiveScenes() override { std::filesystem::remove_all(folder_); }

  data::Scene scene(bool two, bool meet) const {
    std::ofstream file(folder_ / "scene.json");
    file
        << R"({"schema": "flash-scene/1", "timestep": 0.01, "steps": 5, "gravity": [0, 0, -9.81],
                "obstacles": {"table": {"shape": "plane", "normal": [0, 0, 1]}},)"
        << (meet ? R"("self_contact": {"thickness": 0.001},)" : "") << R"("objects": {"a": "towel.json")"
        << (two ? R"(, "b": {"asset": "towel.json", "start": {"T_base_object": [0.3, 0, 0.002, 0, 0, 0, 1]}})"
                : "")
        << "}}";
    file.close();
    return data::load_scene((folder_ / "scene.json").string());
  }

  std::filesystem::path folder_;
};

/// The hand over the corner of object a; environment e stands e mm farther.
inline std::vector<double> poses(int environments, double z) {
  std::vector<double> all;
  for (int e = 0; e < environments; ++e)
    for (const double number : {0.2 - 0.001 * e, 0.2, z, 0.0, 0.0, 0.0, 1.0}) all.push_back(number);
  return all;
}

inline Tensor tensor(const std::vector<double>& numbers, std::vector<std::int64_t> shape) {
  return {.data = numbers.data(), .shape = std::move(shape)};
}

inline EndEffector hand() { return {.name = "hand", .half_extents = {0.03, 0.03, 0.01}, .threshold = 0.002}; }

/// The numbers of one environment of a view.
inline std::vector<double> row(const Tensor& view, int environment) {
  std::vector<std::int64_t> strides = view.strides;
  if (strides.empty()) {
    strides.assign(view.shape.size(), 1);
    for (std::size_t k = strides.size() - 1; k-- > 0;) strides[k] = strides[k + 1] * view.shape[k + 1];
  }
  std::int64_t count = 1;
  for (std::size_t k = 1; k < view.shape.size(); ++k) count *= view.shape[k];
  const auto* first = static_cast<const double*>(view.data) + environment * strides[0];
  return {first, first + count};
}

inline double height(int k) { return k <= 10 ? 0.05 - 0.0039 * k : 0.011 + 0.004 * std::max(0, k - 12); }

/// Down on the corner, closes, lifts it; from the step `first` on.
inline void drive(LiveScene& live, int first, int last) {
  for (int k = first; k < last; ++k) {
    const std::vector<double> now = poses(live.size(), height(k));
    live.move_end_effector("hand", {}, tensor(now, {live.size(), 7}));
    if (k >= 12) live.close("hand", {});
    live.step();
  }
}

}  // namespace flash::sim
