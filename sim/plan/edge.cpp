#include "sim/plan/edge.h"

#include <map>
#include <string>
#include <utility>

#include "data/files/error.h"

namespace flash::sim {

std::vector<Edge> sheet_edges(const Sheet& sheet) {
  std::map<std::pair<int, int>, Edge> edges;
  for (int t = 0; t < int(sheet.triangles.size()); ++t) {
    const Eigen::Vector3i& v = sheet.triangles[t].vertices;
    for (int i = 0; i < 3; ++i) {
      const int a = v[i], b = v[(i + 1) % 3], opposite = v[(i + 2) % 3];
      const auto [at, inserted] = edges.try_emplace(std::minmax(a, b), Edge{a, b, t, -1, opposite, -1});
      if (inserted) continue;
      Edge& edge = at->second;
      const std::string name = "edge " + std::to_string(a) + "-" + std::to_string(b);
      if (edge.right >= 0) throw data::input_error("mesh", name, "shared by more than two triangles");
      if (edge.a == a)
        throw data::input_error("mesh", name,
                                "triangles " + std::to_string(edge.left) + " and " + std::to_string(t) +
                                    " are oriented against each other");
      edge.right = t;
      edge.opposite_right = opposite;
    }
  }
  std::vector<Edge> result;
  result.reserve(edges.size());
  for (const auto& [ends, edge] : edges) result.push_back(edge);
  return result;
}

}  // namespace flash::sim
