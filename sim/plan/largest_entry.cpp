#include "sim/plan/largest_entry.h"

#include "sim/scene/shape_gradients.h"

namespace flash::sim {

double largest_membrane_entry(const Sheet& sheet, const Body& body) {
  Eigen::VectorXd entries = Eigen::VectorXd::Zero(body.vertex_count);
  const auto entry = [&](int vertex) -> double& { return entries[vertex - body.first_vertex]; };
  for (int k = body.first_triangle; k < body.first_triangle + body.triangle_count; ++k) {
    const RestTriangle& triangle = sheet.triangles[k];
    const auto gradients = shape_gradients<2>(triangle.inverse_edges);
    for (int c = 0; c < 3; ++c) entry(triangle.vertices[c]) += triangle.area * gradients.row(c).squaredNorm();
  }
  for (int k = body.first_tetrahedron; k < body.first_tetrahedron + body.tetrahedron_count; ++k) {
    const RestTetrahedron& solid = sheet.tetrahedra[k];
    const auto gradients = shape_gradients<3>(solid.inverse_edges);
    // Of a quadratic element: N = L (2 L - 1) at a corner and 4 L_a L_b in the middle of an edge.
    const double corner = solid.is_quadratic() ? 0.6 : 1;
    for (int c = 0; c < 4; ++c)
      entry(solid.vertices[c]) += corner * solid.volume * gradients.row(c).squaredNorm();
    if (!solid.is_quadratic()) continue;
    for (int a = 0, edge = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b, ++edge)
        entry(solid.midsides[edge]) += 1.6 * solid.volume *
                                       (gradients.row(a).squaredNorm() + gradients.row(b).squaredNorm() +
                                        gradients.row(a).dot(gradients.row(b)));
  }
  return entries.size() > 0 ? entries.maxCoeff() : 0;
}

double largest_hinge_entry(const Sheet& sheet, const Body& body, std::span<const Hinge> hinges) {
  Eigen::VectorXd entries = Eigen::VectorXd::Zero(body.vertex_count);
  for (const Hinge& hinge : hinges) {
    const double length =
                     (sheet.rest.vertices.row(hinge.vertices[0]) - sheet.rest.vertices.row(hinge.vertices[1]))
                         .norm(),
                 turn = length / 2 * (1 / hinge.rest_areas[0] + 1 / hinge.rest_areas[1]);
    for (const int vertex : hinge.vertices) entries[vertex - body.first_vertex] += hinge.weight * turn * turn;
  }
  return entries.size() > 0 ? entries.maxCoeff() : 0;
}

}  // namespace flash::sim
