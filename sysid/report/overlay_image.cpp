#include "sysid/report/overlay_image.h"

#include <algorithm>
#include <cmath>

#include "sysid/capture/render_depth.h"

namespace flash::sysid {
namespace {

constexpr int oversampling = 2;      // drawn larger, then averaged: smooth edges
constexpr double eye_distance = 40;  // in radii of the bounds: nearly parallel rays, so that lengths compare

const data::Colour white = {255, 255, 255}, red = {214, 62, 52}, blue = {36, 104, 180},
                   pale_blue = {170, 196, 226}, ink = {60, 68, 78};

data::Colour shade(const data::Colour& colour, double light) {
  data::Colour shaded;
  for (int k = 0; k < 3; ++k)
    shaded[k] = static_cast<std::uint8_t>(std::clamp(colour[k] * light, 0.0, 255.0));
  return shaded;
}

Eigen::Vector3d triangle_normal(const data::TriangleMesh& mesh, Eigen::Index t) {
  const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(t, 0)),
                        b = mesh.vertices.row(mesh.triangles(t, 1)),
                        c = mesh.vertices.row(mesh.triangles(t, 2));
  return (b - a).cross(c - a);
}

/// Zero where those of a folded sheet cancel.
data::Points vertex_normals(const data::TriangleMesh& mesh) {
  data::Points normals = data::Points::Zero(mesh.vertices.rows(), 3);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k) normals.row(mesh.triangles(t, k)) += triangle_normal(mesh, t).transpose();
  for (Eigen::Index i = 0; i < normals.rows(); ++i) normals.row(i) = normals.row(i).normalized().eval();
  return normals;
}

/// A picture with the scale of a far eye that looks along `direction` at the middle of the bounds.
struct Panel {
  data::CameraIntrinsics camera;
  Eigen::Isometry3d pose;
};

Panel make_panel(const Eigen::AlignedBox3d& bounds, const Eigen::Vector3d& direction,
                 const OverlayImageSettings& settings) {
  const double radius = std::max(0.5 * bounds.sizes().norm(), 1e-3);
  Panel panel;
  panel.camera.width = oversampling * settings.panel_width;
  panel.camera.height = oversampling * settings.panel_height;
  panel.camera.cx = 0.5 * panel.camera.width;
  panel.camera.cy = 0.5 * panel.camera.height;
  panel.pose =
      look_at(bounds.center() - eye_distance * radius * direction, bounds.center(), Eigen::Vector3d::UnitZ());
  // The farthest corner of the bounds stays a twelfth of the panel from its border.
  double right = 1e-9, up = 1e-9;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d seen =
        panel.pose.inverse() * bounds.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    right = std::max(right, std::abs(seen.x() / seen.z()));
    up = std::max(up, std::abs(seen.y() / seen.z()));
  }
  panel.camera.fx = panel.camera.fy = (5.0 / 6.0) * std::min(panel.camera.cx / right, panel.camera.cy / up);
  return panel;
}

void draw_surface(data::Picture& picture, const DepthView& view, const data::TriangleMesh& mesh,
                  const Panel& panel) {
  const data::Points normals = vertex_normals(mesh);
  const Eigen::Vector3d light = panel.pose.linear() * Eigen::Vector3d(-0.4, -0.6, -0.7).normalized();
  for (int v = 0; v < picture.height; ++v)
    for (int u = 0; u < picture.width; ++u) {
      if (view.triangle(v, u) < 0) continue;
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) normal += normals.row(mesh.triangles(view.triangle(v, u), k)).transpose();
      if (normal.norm() < 0.1) normal = triangle_normal(mesh, view.triangle(v, u));
      // Lit from both sides: a sheet has no inside.
      picture.at(u, v) = shade(red, 0.55 + 0.5 * std::abs(normal.normalized().dot(light)));
    }
}

void draw_disc(data::Picture& picture, double column, double row, double radius, const data::Colour& colour) {
  for (int v = static_cast<int>(std::ceil(row - radius)); v <= row + radius; ++v)
    for (int u = static_cast<int>(std::ceil(column - radius)); u <= column + radius; ++u)
      if (u >= 0 && v >= 0 && u < picture.width && v < picture.height &&
          std::hypot(u - column, v - row) <= radius)
        picture.at(u, v) = colour;
}

void draw_cloud(data::Picture& picture, const DepthView& view, const data::Points& cloud, const Panel& panel,
                const OverlayImageSettings& settings) {
  const Eigen::Isometry3d camera_from_base = panel.pose.inverse();
  for (Eigen::Index i = 0; i < cloud.rows(); ++i) {
    const Eigen::Vector3d seen = camera_from_base * cloud.row(i).transpose();
    const auto pixel = data::project(panel.camera, seen);
    if (!pixel) continue;
    const double column = std::round(pixel->x()), row = std::round(pixel->y());
    if (!(column >= 0 && row >= 0 && column < picture.width && row < picture.height)) continue;
    const auto u = static_cast<int>(column), v = static_cast<int>(row);
    const bool hidden = seen.z() > view.depth(v, u) + settings.tolerance;
    draw_disc(picture, pixel->x(), pixel->y(), oversampling * settings.point_radius,
              hidden ? pale_blue : blue);
  }
}

void draw_scale_bar(data::Picture& picture, const Panel& panel, const Eigen::AlignedBox3d& bounds) {
  const double distance = (panel.pose.translation() - bounds.center()).norm();
  const double pixels = std::round(0.1 * panel.camera.fx / distance);
  const int length = static_cast<int>(std::clamp(pixels, 0.0, static_cast<double>(picture.width)));
  const int margin = 16 * oversampling, thickness = 2 * oversampling;
  for (int v = picture.height - margin - thickness; v < picture.height - margin; ++v)
    for (int u = margin; u < std::min(margin + length, picture.width); ++u) picture.at(u, v) = ink;
}

data::Picture draw_panel(const data::TriangleMesh& simulated, const data::Points& observed,
                         const Eigen::AlignedBox3d& bounds, const Eigen::Vector3d& direction,
                         const OverlayImageSettings& settings) {
  const Panel panel = make_panel(bounds, direction, settings);
  data::Picture picture(panel.camera.width, panel.camera.height, white);
  const DepthView view = render_depth(panel.camera, panel.pose, {simulated});
  draw_surface(picture, view, simulated, panel);
  draw_cloud(picture, view, observed, panel, settings);
  draw_scale_bar(picture, panel, bounds);
  return picture;
}

// Averages blocks of oversampling^2 pixels into `picture`, starting at a column.
void paste(data::Picture& picture, const data::Picture& large, int column) {
  for (int v = 0; v < picture.height; ++v)
    for (int u = 0; u < large.width / oversampling; ++u) {
      std::array<int, 3> sum{};
      for (int k = 0; k < oversampling * oversampling; ++k)
        for (int c = 0; c < 3; ++c)
          sum[c] += large.at(oversampling * u + k % oversampling, oversampling * v + k / oversampling)[c];
      for (int c = 0; c < 3; ++c)
        picture.at(column + u, v)[c] = static_cast<std::uint8_t>(sum[c] / (oversampling * oversampling));
    }
}

}  // namespace

data::Picture draw_overlay(const data::TriangleMesh& simulated, const data::Points& observed,
                           const Eigen::AlignedBox3d& bounds, const OverlayImageSettings& settings) {
  const double cosine = std::cos(settings.elevation), sine = std::sin(settings.elevation);
  data::Picture picture(2 * settings.panel_width, settings.panel_height, white);
  paste(picture, draw_panel(simulated, observed, bounds, {0, cosine, -sine}, settings), 0);
  paste(picture, draw_panel(simulated, observed, bounds, {-cosine, 0, -sine}, settings),
        settings.panel_width);
  return picture;
}

Eigen::AlignedBox3d bounds_of(const Overlay& overlay, const std::vector<int>& frames) {
  Eigen::AlignedBox3d bounds;
  for (const int k : frames)
    for (const data::Points* points : {&overlay.frames[static_cast<std::size_t>(k)].vertices,
                                       &overlay.frames[static_cast<std::size_t>(k)].cloud})
      for (Eigen::Index i = 0; i < points->rows(); ++i) bounds.extend(points->row(i).transpose());
  return bounds;
}

data::Picture draw_sequence(const Overlay& overlay, const std::vector<int>& frames,
                            const Eigen::AlignedBox3d& bounds) {
  OverlayImageSettings small;
  small.panel_width = 300;
  small.panel_height = 280;
  small.point_radius = 0.8;
  data::Picture sequence(small.panel_width * static_cast<int>(frames.size()), 2 * small.panel_height,
                         {255, 255, 255});
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const OverlayFrame& frame = overlay.frames[static_cast<std::size_t>(frames[i])];
    const data::Picture picture =
        draw_overlay({frame.vertices, overlay.triangles}, frame.cloud, bounds, small);
    for (int v = 0; v < picture.height; ++v)
      for (int u = 0; u < picture.width; ++u)
        sequence.at(static_cast<int>(i) * small.panel_width + u % small.panel_width,
                    v + (u < small.panel_width ? 0 : small.panel_height)) = picture.at(u, v);
  }
  return sequence;
}

}  // namespace flash::sysid
