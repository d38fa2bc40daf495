#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "data/mesh/mesh.h"
#include "sim/render/depth_camera.h"
#include "sim/scene/sheet.h"
#include "sim/tensor.h"

namespace flash::sim {

/// An object of a live scene.
struct LiveObject {
  std::string name;
  data::Triangles triangles;  ///< that can be seen, by the object's own vertices, from 0
  bool is_solid = false;
  std::size_t worlds = 0;  ///< number of the worlds that have it; objects that meet share one
  int body = 0;            ///< of their plan
  std::int64_t first_vertex = 0, vertices = 0;
};

/// Of a body of a sheet that stands in the worlds of that number.
LiveObject live_object(const Sheet& sheet, std::size_t body, std::string name, std::size_t worlds);

/// Its rows in a view of its worlds: environments x vertices x 3.
Tensor rows_of(const LiveObject& object, Tensor all);

/// It in the environments chosen. `positions`: of its worlds, [m], in whatever memory.
SeenMesh seen(const LiveObject& object, const Tensor& positions, std::span<const int> chosen);

}  // namespace flash::sim
