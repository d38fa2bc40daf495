#include "sysid/capture/segment/segment.h"

// Without PCL's library of segmentation, which takes two thirds of the start of a program: what is needed of
// it stands in headers.
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/impl/extract_clusters.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <limits>
#include <set>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sysid {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

// PCL computes in float: points are taken about an origin of their own, so that a base frame far away costs
// no digits.
Cloud::Ptr to_pcl(const data::Points& points, const std::vector<int>& rows, const Eigen::Vector3d& origin) {
  auto cloud = std::make_shared<Cloud>();
  cloud->reserve(rows.size());
  for (int row : rows) {
    const Eigen::Vector3f p = (points.row(row).transpose() - origin).cast<float>();
    cloud->push_back({p.x(), p.y(), p.z()});
  }
  return cloud;
}

Eigen::Vector3d origin_of(const data::Points& points, const std::vector<int>& rows) {
  return rows.empty() ? Eigen::Vector3d::Zero().eval() : points.row(rows.front()).transpose().eval();
}

std::vector<int> finite_rows_within(const data::CropBox& crop, const data::Points& points) {
  std::vector<int> rows;
  for (int i = 0; i < points.rows(); ++i)
    if (points.row(i).allFinite() && crop.contains(points.row(i).transpose())) rows.push_back(i);
  return rows;
}

bool inside(const ArmCylinder& arm, const Eigen::Vector3d& up, const Eigen::Vector3d& point) {
  const Eigen::Vector3d from_tip = point - arm.tip;
  const double height = from_tip.dot(up);
  return height > 0 && (from_tip - height * up).norm() < arm.radius;
}

// Whether a cluster stands still, all the time and away from the tip of the arm.
bool is_background(const data::Points& points, const std::vector<int>& cluster, const ArmCylinder& arm,
                   const std::set<StillCell>& still) {
  constexpr double kFar = 0.15;  // from what the gripper holds [m]
  if (still.empty()) return false;
  std::size_t at_rest = 0;
  double nearest = INFINITY;
  for (const int row : cluster) {
    const Eigen::Vector3d point = points.row(row).transpose();
    at_rest += still.contains(still_cell(point)) ? 1 : 0;
    nearest = std::min(nearest, (point - arm.tip).norm());
  }
  return 2 * at_rest >= cluster.size() && (arm.radius == 0 || nearest > kFar);
}

// What `settings` has, but at least three times what points are apart: those of a coarse camera far away
// would have no neighbours.
double cluster_gap(const Cloud::Ptr& cloud, const SegmentSettings& settings) {
  constexpr std::size_t kAsked = 500;
  constexpr double kTimes = 3;
  if (cloud->size() < 2) return settings.cluster_gap;
  pcl::search::KdTree<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  std::vector<float> squares;
  pcl::Indices indices;
  std::vector<float> found;
  for (std::size_t i = 0; i < cloud->size(); i += 1 + cloud->size() / kAsked) {
    tree.nearestKSearch(static_cast<int>(i), 2, indices, found);
    squares.push_back(found.back());
  }
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::max(settings.cluster_gap, kTimes * std::sqrt(static_cast<double>(*middle)));
}

// Rows of the clusters that are kept, largest first.
std::vector<int> main_clusters(const data::Points& points, const std::vector<int>& rows,
                               const ArmCylinder& arm, const SegmentSettings& settings,
                               const std::set<StillCell>& still) {
  if (rows.empty()) return {};
  const Cloud::Ptr cloud = to_pcl(points, rows, origin_of(points, rows));
  std::vector<pcl::PointIndices> clusters;
  const auto tree = std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
  tree->setInputCloud(cloud);
  pcl::extractEuclideanClusters<pcl::PointXYZ>(*cloud, tree, static_cast<float>(cluster_gap(cloud, settings)),
                                               clusters, settings.cluster_points);
  std::sort(clusters.rbegin(), clusters.rend(), pcl::comparePointClusters);
  std::vector<std::vector<int>> moving, background;
  for (const pcl::PointIndices& found : clusters) {
    std::vector<int> cluster;
    for (const int index : found.indices) cluster.push_back(rows[index]);
    (is_background(points, cluster, arm, still) ? background : moving).push_back(std::move(cluster));
  }
  // Without an arm, cloth that was never moved looks like background.
  if (moving.empty() && arm.radius == 0) moving = std::move(background);
  std::size_t largest = 0;
  for (const std::vector<int>& cluster : moving) largest = std::max(largest, cluster.size());
  std::vector<int> kept;
  for (const std::vector<int>& cluster : moving)
    if (static_cast<double>(cluster.size()) >= settings.cluster_share * static_cast<double>(largest))
      kept.insert(kept.end(), cluster.begin(), cluster.end());
  return kept;
}

std::vector<int> without_outliers(const data::Points& points, const std::vector<int>& rows,
                                  const SegmentSettings& settings) {
  if (settings.outlier_neighbours == 0 || rows.empty()) return rows;
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(to_pcl(points, rows, origin_of(points, rows)));
  filter.setMeanK(settings.outlier_neighbours);
  filter.setStddevMulThresh(settings.outlier_sigmas);
  pcl::Indices inliers;
  filter.filter(inliers);
  std::vector<int> kept;
  for (int index : inliers) kept.push_back(rows[index]);
  return kept;
}

constexpr const char* remedy =
    ": widen the view, or give --table-z, or --no-table where nothing of it is in the clouds";

std::string degrees(double radians) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", radians * 180 / M_PI);
  return text;
}

// Of `rows`, in order, the points of the largest plane across `up`; may be empty.
std::vector<int> largest_plane(const data::Points& points, const std::vector<int>& rows,
                               const SegmentSettings& settings) {
  if (rows.size() < 3) return {};
  const auto model = std::make_shared<pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>>(
      to_pcl(points, rows, origin_of(points, rows)));
  model->setAxis(settings.up.cast<float>());
  model->setEpsAngle(settings.plane_tilt);
  pcl::RandomSampleConsensus<pcl::PointXYZ> ransac(model, settings.plane_tolerance);
  ransac.setMaxIterations(1000);
  pcl::Indices inliers;
  if (ransac.computeModel()) ransac.getInliers(inliers);
  std::vector<int> plane;
  for (const int index : inliers) plane.push_back(rows[index]);
  std::sort(plane.begin(), plane.end());
  return plane;
}

// Least squares: the normal is the direction in which the points spread least.
TablePlane fitted_plane(const data::Points& points, const std::vector<int>& rows,
                        const SegmentSettings& settings) {
  data::Points plane = points(rows, Eigen::all);
  const Eigen::RowVector3d centre = plane.colwise().mean();
  plane.rowwise() -= centre;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(plane.transpose() * plane);
  Eigen::Vector3d normal = spread.eigenvectors().col(0);
  if (normal.dot(settings.up) < 0) normal = -normal;
  return {centre.transpose(), normal};
}

// How many frames show at least half of all that any of them shows of a plane, in cells seen from above: what
// stands still is always there, but for what hides it; what moves is elsewhere in every frame.
int frames_that_show(const data::Points& points, const std::vector<int>& plane,
                     const std::vector<int>& frame_of, int frames) {
  constexpr double edge = 0.05;  // of a cell [m]
  std::set<std::array<long, 2>> cells;
  std::set<std::array<long, 3>> seen;
  for (const int row : plane) {
    const long x = std::lround(points(row, 0) / edge), y = std::lround(points(row, 1) / edge);
    cells.insert({x, y});
    seen.insert({frame_of[row], x, y});
  }
  std::vector<std::size_t> seen_of(frames, 0);
  for (const std::array<long, 3>& cell : seen) ++seen_of[cell[0]];
  return static_cast<int>(std::count_if(seen_of.begin(), seen_of.end(),
                                        [&](std::size_t count) { return 2 * count >= cells.size(); }));
}

data::Points one_point_a_voxel(const data::Points& points, const std::vector<int>& rows, double voxel) {
  if (voxel == 0 || rows.empty()) return points(rows, Eigen::all);
  using Cell = std::array<std::int64_t, 3>;
  const Eigen::Vector3d origin = origin_of(points, rows);
  std::vector<std::pair<Cell, int>> sorted;
  for (const int row : rows) {
    const Eigen::Vector3d place = (points.row(row).transpose() - origin) / voxel;
    sorted.push_back({{std::llround(std::floor(place.z())), std::llround(std::floor(place.y())),
                       std::llround(std::floor(place.x()))},
                      row});
  }
  std::sort(sorted.begin(), sorted.end());
  data::Points centres(static_cast<Eigen::Index>(rows.size()), 3);
  Eigen::Index count = 0;
  for (auto first = sorted.begin(); first != sorted.end();) {
    const auto last =
        std::find_if(first, sorted.end(), [&](const auto& other) { return other.first != first->first; });
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (auto point = first; point != last; ++point) sum += points.row(point->second);
    centres.row(count++) = sum / static_cast<double>(last - first);
    first = last;
  }
  return centres.topRows(count);
}

}  // namespace

StillCell still_cell(const Eigen::Vector3d& point) {
  constexpr double kEdge = 0.05;  // [m]
  const Eigen::Vector3d cell = (point / kEdge).array().floor();
  return {std::llround(cell.x()), std::llround(cell.y()), std::llround(cell.z())};
}

const char* to_string(PointLabel label) {
  static constexpr std::array<const char*, point_label_count> names = {"outside", "table",   "arm",
                                                                       "clutter", "outlier", "cloth"};
  return names[static_cast<int>(label)];
}

FoundTable find_table(const std::vector<data::Points>& frames, const SegmentSettings& settings) {
  constexpr int most_planes = 5;  // looked at, the largest first
  data::CropBox column = settings.crop;
  column.min.z() = -std::numeric_limits<double>::infinity();
  column.max.z() = std::numeric_limits<double>::infinity();
  data::Points points;
  std::vector<int> rows, frame_of;
  int with_points = 0;
  for (const data::Points& frame : frames) {
    const std::vector<int> kept = finite_rows_within(column, frame);
    const Eigen::Index first = points.rows();
    points.conservativeResize(first + static_cast<Eigen::Index>(kept.size()), 3);
    points.bottomRows(static_cast<Eigen::Index>(kept.size())) = frame(kept, Eigen::all);
    frame_of.insert(frame_of.end(), kept.size(), with_points);
    with_points += kept.empty() ? 0 : 1;
  }
  for (int row = 0; row < points.rows(); ++row) rows.push_back(row);
  const std::size_t all = rows.size();
  const std::string places = data::format_count(all) + " points inside, above and below the crop box";
  if (all < 3) throw data::input_error("clouds", "table", "found " + places + remedy);

  std::optional<FoundTable> moving;
  for (int plane = 0; plane < most_planes; ++plane) {
    const std::vector<int> inliers = largest_plane(points, rows, settings);
    if (inliers.size() < settings.plane_fraction * all || inliers.size() < 3) break;
    FoundTable found{fitted_plane(points, inliers, settings), 0, with_points, 0};
    found.tilt = std::acos(std::min(1.0, found.plane.normal.dot(settings.up)));
    found.agreeing = frames_that_show(points, inliers, frame_of, with_points);
    if (3 * found.agreeing >= 2 * with_points) return found;
    if (!moving) moving = found;
    std::vector<int> rest;
    std::set_difference(rows.begin(), rows.end(), inliers.begin(), inliers.end(), std::back_inserter(rest));
    rows = std::move(rest);
  }
  if (moving)
    throw data::input_error("clouds", "table",
                            "the largest plane, tilted by " + degrees(moving->tilt) + " deg, is seen in " +
                                std::to_string(moving->agreeing) + " of " + std::to_string(with_points) +
                                " frames only: it is cloth, and the table is not in view" + remedy);
  throw data::input_error("clouds", "table",
                          "no plane across the vertical holds " +
                              data::format_short(settings.plane_fraction * 100) + " % of the " + places +
                              remedy);
}

Segmentation segment_cloth(const data::Points& points, const std::optional<TablePlane>& table,
                           const ArmCylinder& arm, const SegmentSettings& settings,
                           const std::set<StillCell>& still) {
  Segmentation result;
  result.labels.assign(points.rows(), PointLabel::outside);
  std::vector<int> above;
  for (int row : finite_rows_within(settings.crop, points)) {
    const Eigen::Vector3d point = points.row(row).transpose();
    if (table && (point - table->point).dot(table->normal) < settings.table_clearance)
      result.labels[row] = PointLabel::table;
    else if (inside(arm, settings.up, point))
      result.labels[row] = PointLabel::arm;
    else
      above.push_back(row);
  }
  for (int row : above) result.labels[row] = PointLabel::clutter;
  const std::vector<int> clusters = main_clusters(points, above, arm, settings, still);
  for (int row : clusters) result.labels[row] = PointLabel::outlier;
  const std::vector<int> cloth = without_outliers(points, clusters, settings);
  for (int row : cloth) result.labels[row] = PointLabel::cloth;
  for (PointLabel label : result.labels) ++result.counts[static_cast<int>(label)];
  result.cloth = one_point_a_voxel(points, cloth, settings.voxel);
  return result;
}

}  // namespace flash::sysid
