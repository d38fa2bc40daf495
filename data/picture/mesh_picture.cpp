#include "data/picture/mesh_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace flash::data {
namespace {

using Eigen::Vector3d;

constexpr int oversampling = 3;        // drawn larger, then averaged: smooth edges
constexpr double border = 0.04;        // of the picture, left free on each side
constexpr double crease_cosine = 0.7;  // between triangles that are shaded as one round surface
constexpr double lying =
    1e-3;  // of the picture: what lies so near on another mesh hides it, if it is named first

/// What the eye sees: right, down, and away from it.
Eigen::Matrix3d view_of(const MeshPictureSettings& settings) {
  const double to_rad = std::numbers::pi / 180, a = settings.azimuth * to_rad,
               e = settings.elevation * to_rad;
  Eigen::Matrix3d view;
  view.row(2) = -Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  view.row(0) = Vector3d(-std::sin(a), std::cos(a), 0);
  view.row(1) = view.row(2).cross(view.row(0));
  return view;
}

Vector3d normal_of(const TriangleMesh& mesh, Eigen::Index t) {
  const Vector3d a = mesh.vertices.row(mesh.triangles(t, 0)), b = mesh.vertices.row(mesh.triangles(t, 1)),
                 c = mesh.vertices.row(mesh.triangles(t, 2));
  return (b - a).cross(c - a).normalized();
}

/// The normals that shade the corners of each triangle: the mean of those about a vertex that are alike.
std::vector<std::array<Vector3d, 3>> shading_normals(const TriangleMesh& mesh) {
  std::vector<std::vector<Eigen::Index>> about(static_cast<std::size_t>(mesh.vertices.rows()));
  std::vector<Vector3d> flat;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    flat.push_back(normal_of(mesh, t));
    for (int k = 0; k < 3; ++k) about[static_cast<std::size_t>(mesh.triangles(t, k))].push_back(t);
  }
  std::vector<std::array<Vector3d, 3>> normals;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Vector3d& own = flat[static_cast<std::size_t>(t)];
    std::array<Vector3d, 3>& corners = normals.emplace_back();
    for (int k = 0; k < 3; ++k) {
      Vector3d sum = Vector3d::Zero();
      for (const Eigen::Index other : about[static_cast<std::size_t>(mesh.triangles(t, k))])
        if (flat[static_cast<std::size_t>(other)].dot(own) > crease_cosine)
          sum += flat[static_cast<std::size_t>(other)];
      corners[static_cast<std::size_t>(k)] = sum.normalized();
    }
  }
  return normals;
}

/// A large picture with the distance of what each pixel shows, and the number of its mesh.
struct Canvas {
  Picture picture;
  std::vector<double> depth;
  std::vector<std::size_t> shown;
  Eigen::Matrix3d view;
  double scale;            ///< [px/m]
  double slack = 0;        ///< by which a later mesh has to be nearer [m]
  Eigen::Vector2d offset;  ///< [px]

  Vector3d seen(const Vector3d& place) const {
    const Vector3d in_view = view * place;
    return {scale * in_view.x() + offset.x(), scale * in_view.y() + offset.y(), in_view.z()};
  }
};

/// `number`: of its mesh.
void draw_triangle(Canvas& canvas, const std::array<Vector3d, 3>& corners,
                   const std::array<Vector3d, 3>& normals, const Colour& colour, std::size_t number) {
  const Vector3d a = canvas.seen(corners[0]), b = canvas.seen(corners[1]), c = canvas.seen(corners[2]);
  const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  if (area == 0) return;
  const Vector3d light = canvas.view.transpose() * Vector3d(-0.5, -0.7, -0.6).normalized();
  const auto least = [&](int axis) { return std::min({a[axis], b[axis], c[axis]}); };
  const auto most = [&](int axis) { return std::max({a[axis], b[axis], c[axis]}); };
  Picture& picture = canvas.picture;
  for (int v = std::max(0, static_cast<int>(least(1))); v <= std::min(picture.height - 1.0, most(1)); ++v)
    for (int u = std::max(0, static_cast<int>(least(0))); u <= std::min(picture.width - 1.0, most(0)); ++u) {
      const double x = u + 0.5, y = v + 0.5;
      const double of_b = ((x - a.x()) * (c.y() - a.y()) - (y - a.y()) * (c.x() - a.x())) / area,
                   of_c = ((b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x())) / area;
      if (of_b < 0 || of_c < 0 || of_b + of_c > 1) continue;
      const double depth = a.z() + of_b * (b.z() - a.z()) + of_c * (c.z() - a.z());
      const std::size_t pixel = static_cast<std::size_t>(v) * picture.width + u;
      double& nearest = canvas.depth[pixel];
      if (depth >= nearest - (canvas.shown[pixel] == number ? 0 : canvas.slack)) continue;
      nearest = depth;
      canvas.shown[pixel] = number;
      const Vector3d normal =
          ((1 - of_b - of_c) * normals[0] + of_b * normals[1] + of_c * normals[2]).normalized();
      // The side towards the eye is lit.
      const double facing = normal.dot(canvas.view.row(2)) < 0 ? 1 : -1;
      const double brightness = 0.45 + 0.6 * std::max(0.0, facing * normal.dot(light));
      for (std::size_t k = 0; k < 3; ++k)
        picture.at(u, v)[k] = static_cast<std::uint8_t>(std::clamp(colour[k] * brightness, 0.0, 255.0));
    }
}

Canvas make_canvas(const std::vector<PicturedMesh>& meshes, const MeshPictureSettings& settings) {
  Canvas canvas{Picture(oversampling * settings.width, oversampling * settings.height, {255, 255, 255}),
                {},
                {},
                view_of(settings),
                1,
                0,
                Eigen::Vector2d::Zero()};
  canvas.depth.assign(canvas.picture.pixels.size(), std::numeric_limits<double>::infinity());
  canvas.shown.assign(canvas.picture.pixels.size(), 0);
  Eigen::AlignedBox2d bounds;
  for (const PicturedMesh& pictured : meshes)
    for (const auto& row : pictured.mesh.vertices.rowwise())
      bounds.extend((canvas.view * row.transpose()).head<2>().eval());
  const Eigen::Vector2d size(canvas.picture.width, canvas.picture.height);
  if (bounds.isEmpty()) return canvas;
  canvas.scale = ((1 - 2 * border) * size.array() / bounds.sizes().array().max(1e-12)).minCoeff();
  canvas.slack = lying * bounds.diagonal().norm();
  canvas.offset = 0.5 * size - canvas.scale * bounds.center();
  return canvas;
}

}  // namespace

Picture draw_meshes(const std::vector<PicturedMesh>& meshes, const MeshPictureSettings& settings) {
  Canvas canvas = make_canvas(meshes, settings);
  for (std::size_t number = 0; number < meshes.size(); ++number) {
    const TriangleMesh& mesh = meshes[number].mesh;
    const auto normals = shading_normals(mesh);
    for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
      std::array<Vector3d, 3> corners;
      for (int k = 0; k < 3; ++k)
        corners[static_cast<std::size_t>(k)] = mesh.vertices.row(mesh.triangles(t, k));
      draw_triangle(canvas, corners, normals[static_cast<std::size_t>(t)], meshes[number].colour, number);
    }
  }
  Picture picture(settings.width, settings.height, {255, 255, 255});
  for (int v = 0; v < picture.height; ++v)
    for (int u = 0; u < picture.width; ++u)
      for (std::size_t k = 0; k < 3; ++k) {
        int sum = 0;
        for (int n = 0; n < oversampling * oversampling; ++n)
          sum +=
              canvas.picture.at(oversampling * u + n % oversampling, oversampling * v + n / oversampling)[k];
        picture.at(u, v)[k] = static_cast<std::uint8_t>(sum / (oversampling * oversampling));
      }
  return picture;
}

}  // namespace flash::data
