#include "sim/world_arguments.h"

#include <algorithm>
#include <cmath>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sim {
namespace {

constexpr double farthest_place = 1e5;  // as of files of scenes [m]

}  // namespace

void refuse_argument(const char* setter, const std::string& what) {
  throw data::InputError("worlds: " + std::string(setter) + ": " + what);
}

std::string environment_name(int environment) { return "environment " + std::to_string(environment); }

void check_chosen(const char* setter, std::span<const int> environments, int count) {
  std::vector<bool> found(static_cast<std::size_t>(count));
  for (const int e : environments) {
    if (e < 0 || e >= count)
      refuse_argument(setter,
                      "found " + environment_name(e) + ", expected 0 to " + std::to_string(count - 1));
    if (found[static_cast<std::size_t>(e)])
      refuse_argument(setter, "found " + environment_name(e) + " twice, expected each once");
    found[static_cast<std::size_t>(e)] = true;
  }
}

void check_end_effector(const EndEffector& effector) {
  const auto expect = [&](bool met, const char* what) {
    if (!met) refuse_argument("add", effector.name + ": " + what);
  };
  expect(effector.half_extents.allFinite() && effector.half_extents.minCoeff() > 0 &&
             effector.half_extents.maxCoeff() <= farthest_place,
         "found a box without a size, expected half extents above 0");
  expect(std::isfinite(effector.threshold) && effector.threshold >= 0,
         "found a threshold that is none, expected 0 m or more");
  expect(!effector.friction || (std::isfinite(*effector.friction) && *effector.friction >= 0),
         "found a friction that is none, expected 0 or more");
}

void check_grasp(int e, int hold, const Hold& own, const Grasp& grasp, std::int64_t vertices) {
  const auto expect = [&](bool met, const std::string& what) {
    if (!met) refuse_argument("grasp", environment_name(e) + ": hold " + std::to_string(hold) + ": " + what);
  };
  const bool others = !grasp.vertices.empty() || grasp.reach;
  expect(others || !own.vertices.empty() || own.reach,
         "found neither vertices nor a reach, expected one of them");
  expect(grasp.vertices.empty() || !grasp.reach, "found vertices and a reach, expected one of them");
  expect(!others || (own.targets.rows() == 0 && own.stiffness.size() == 0),
         "found other vertices than its own, expected those: it has targets or a stiffness for them");
  std::vector<int> sorted = grasp.vertices;
  std::sort(sorted.begin(), sorted.end());
  expect(sorted.empty() || (sorted.front() >= 0 && sorted.back() < vertices),
         "found a vertex that is not there, expected 0 to " + std::to_string(vertices - 1));
  expect(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(),
         "found a vertex twice, expected each once");
  if (!grasp.reach) return;
  const Reach& reach = *grasp.reach;
  expect(std::isfinite(reach.threshold) && reach.threshold >= 0,
         "found a threshold of " + data::format_short(reach.threshold) + " m, expected 0 or more");
  expect(reach.half_extents.allFinite() && reach.half_extents.minCoeff() >= 0,
         "found half extents below 0, expected 0 or more");
  expect(reach.first_vertex >= 0 && reach.first_vertex < vertices &&
             reach.first_vertex + std::max(reach.vertex_count, 0) <= vertices,
         "found a reach of vertices that are not there, expected 0 to " + std::to_string(vertices - 1));
}

}  // namespace flash::sim
