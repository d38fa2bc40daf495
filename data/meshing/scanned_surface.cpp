#include "data/meshing/scanned_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/meshing/sampled_surface.h"
#include "data/meshing/triangle_tree.h"

namespace flash::data {
namespace {

constexpr double most_vertices = 200000;

InputError unfit(const std::string& source, const std::string& what) {
  return InputError(source + ": " + what + " (is it in metres? --scale 0.001 takes millimetres)");
}

/// How wide points are across the direction in which they are longest: of a strip its width [m].
double width_of(const Points& points) {
  const Points around = points.rowwise() - points.colwise().mean();
  const Eigen::Matrix3d moments =
      around.transpose() * around / static_cast<double>(std::max<Eigen::Index>(1, points.rows()));
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(moments, Eigen::EigenvaluesOnly);
  return std::sqrt(12 * std::max(0.0, axes.eigenvalues()[1]));
}

/// The scan has to be some edges long and one wide, and its mesh no larger than anybody simulates.
void check_size(const Points& points, double area, const ScanSettings& settings, const std::string& source) {
  const Eigen::RowVector3d span = points.colwise().maxCoeff() - points.colwise().minCoeff();
  if (!(span.norm() >= 4 * settings.edge))
    throw unfit(source, "spans " + format_short(span.norm()) + " m, expected four times --edge " +
                            format_short(settings.edge) + " at least");
  if (const double width = width_of(points); !(width >= settings.edge))
    throw unfit(source, "is " + format_short(width) + " m wide where it spans " + format_short(span.norm()) +
                            " m, expected --edge " + format_short(settings.edge) + " at least");
  const double vertices = area * 2 / std::sqrt(3) / (settings.edge * settings.edge);
  if (!(vertices <= most_vertices))  // nor where the area overflows
    throw unfit(source, "spans " + format_short(span.norm()) + " m and would take " +
                            format_count(std::size_t(vertices < 1e15 ? vertices : 1e15)) +
                            " vertices of --edge " + format_short(settings.edge) + ", expected at most " +
                            format_count(std::size_t(most_vertices)));
}

ScannedSurface finished(const TriangleMesh& surface, const Points& points, const ScanSettings& settings) {
  ScannedSurface result;
  const FilledSurface filled = fill_holes(largest_component(surface, result.dropped), settings.holes);
  result.filled = filled.filled;
  result.mesh = remeshed(filled.mesh, settings.edge);
  const SurfaceTopology topology = topology_of(result.mesh);
  result.euler = topology.euler;
  result.borders = int(topology.borders.size());
  result.edges = edge_lengths(result.mesh);
  result.points = std::size_t(points.rows());
  const TriangleTree tree(result.mesh);
  double sum = 0;
  Eigen::Index near = 0;
  for (const auto& point : points.rowwise()) {
    const double distance = (tree.nearest(point.transpose()).place - point.transpose()).norm();
    if (distance > 3 * settings.edge) continue;
    sum += distance * distance;
    ++near;
  }
  result.distance_rms = std::sqrt(sum / double(std::max<Eigen::Index>(1, near)));
  result.far_points = 1 - double(near) / double(points.rows());
  return result;
}

}  // namespace

ScannedSurface mesh_of_cloud(const Points& cloud, const ScanSettings& settings, const std::string& source) {
  constexpr Eigen::Index fewest_points = 20;
  const auto check_count = [&](const Points& points, const char* what) {
    if (points.rows() < fewest_points)
      throw InputError(source + ": found " + format_count(std::size_t(points.rows())) + what + ", expected " +
                       std::to_string(fewest_points) + " at least");
  };
  check_count(cloud, " points");
  check_size(cloud, 0, settings, source);
  const Eigen::RowVector3d span = cloud.colwise().maxCoeff() - cloud.colwise().minCoeff();
  if (span.maxCoeff() > 1e5 * settings.edge)
    throw unfit(source, "spans " + format_short(span.maxCoeff()) +
                            " m, expected at most 100,000 times --edge " + format_short(settings.edge));
  const PointSamples all{cloud, {}, Eigen::VectorXd::Ones(cloud.rows())};
  // A sheet passes through about 1.5 cubes of an edge for each square of an edge.
  check_size(cloud, double(thinned(all, settings.edge).points.rows()) / 1.5 * settings.edge * settings.edge,
             settings, source);
  const PointSamples samples = thinned(all, settings.edge / 4);
  check_count(samples.points, " points that are a quarter of an edge apart");
  PointSamples kept = without_outliers(samples);
  check_count(kept.points, " points that are no outliers");
  const double spacing = spacing_of(kept);
  if (spacing > 0.75 * settings.edge)
    throw unfit(source, "points are " + format_short(spacing) + " m apart, expected at most 3/4 of --edge " +
                            format_short(settings.edge));
  SampledSurfaceSettings sampled;
  sampled.width = settings.smoothing > 0 ? settings.smoothing : std::max(0.75 * settings.edge, 1.5 * spacing);
  sampled.cell = settings.edge / 2;
  find_normals(kept, 1.5 * sampled.width);
  const TriangleMesh surface = sampled_surface(kept, sampled);
  if (surface.triangles.rows() == 0)
    throw InputError(source + ": its points lie about no surface; try a larger --edge or --smoothing");
  ScannedSurface result = finished(checked_surface(surface, source), cloud, settings);
  result.outliers = std::size_t(samples.points.rows() - kept.points.rows());
  return result;
}

ScannedSurface mesh_of_surface(const TriangleMesh& mesh, const ScanSettings& settings,
                               const std::string& source) {
  check_size(mesh.vertices, area_of(mesh), settings, source);
  return finished(checked_surface(mesh, source), mesh.vertices, settings);
}

}  // namespace flash::data
