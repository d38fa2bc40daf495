#pragma once
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::sim {

inline std::string reference_path(const std::string& file) {
  return std::string(FLASH_REFERENCE_SCENES) + "/" + file;
}

/// The scene of that name; throws where its file is absent or broken.
inline nlohmann::json reference_scene(const std::string& name) {
  std::ifstream in(reference_path(name + ".json"));
  return nlohmann::json::parse(in);
}

/// An .obj of vertices and triangles, nothing else.
inline data::TriangleMesh reference_mesh(const std::string& file) {
  std::ifstream in(reference_path(file));
  std::vector<double> x;
  std::vector<int> f;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string tag;
    words >> tag;
    if (tag == "v")
      for (double value; words >> value;) x.push_back(value);
    if (tag == "f")
      for (int index; words >> index;) f.push_back(index - 1);
  }
  data::TriangleMesh mesh;
  mesh.vertices = Eigen::Map<data::Points>(x.data(), x.size() / 3, 3);
  mesh.triangles = Eigen::Map<data::Triangles>(f.data(), f.size() / 3, 3);
  return mesh;
}

/// [[x, y, z], ...]
inline data::Points reference_points(const nlohmann::json& rows) {
  data::Points points(rows.size(), 3);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (int k = 0; k < 3; ++k) points(i, k) = rows[i][k].get<double>();
  return points;
}

inline const nlohmann::json& expected_quantity(const nlohmann::json& scene, const std::string& quantity) {
  for (const nlohmann::json& entry : scene.at("expected"))
    if (entry.at("quantity") == quantity) return entry.at("value");
  throw std::runtime_error("no expected quantity " + quantity);
}

}  // namespace flash::sim
