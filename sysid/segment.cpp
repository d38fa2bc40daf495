#include "sysid/segment.h"

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <Eigen/Eigenvalues>

#include "data/error.h"

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

// Rows of the clusters that are kept, largest first.
std::vector<int> main_clusters(const data::Points& points, const std::vector<int>& rows,
                               const SegmentSettings& settings) {
  if (rows.empty()) return {};
  const Cloud::Ptr cloud = to_pcl(points, rows, origin_of(points, rows));
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setInputCloud(cloud);
  extraction.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  extraction.setClusterTolerance(settings.cluster_gap);
  extraction.setMinClusterSize(settings.cluster_points);
  std::vector<pcl::PointIndices> clusters;
  extraction.extract(clusters);
  std::size_t largest = 0;
  for (const auto& cluster : clusters) largest = std::max(largest, cluster.indices.size());
  std::vector<int> kept;
  for (const auto& cluster : clusters)
    if (cluster.indices.size() >= settings.cluster_share * largest)
      for (int index : cluster.indices) kept.push_back(rows[index]);
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

data::Points one_point_a_voxel(const data::Points& points, const std::vector<int>& rows, double voxel) {
  if (voxel == 0) return points(rows, Eigen::all);
  const Eigen::Vector3d origin = origin_of(points, rows);
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(to_pcl(points, rows, origin));
  grid.setLeafSize(Eigen::Vector4f::Constant(static_cast<float>(voxel)));
  Cloud centroids;
  if (!rows.empty()) grid.filter(centroids);
  data::Points result(centroids.size(), 3);
  for (std::size_t i = 0; i < centroids.size(); ++i)
    result.row(i) = centroids[i].getVector3fMap().cast<double>().transpose() + origin.transpose();
  return result;
}

}  // namespace

const char* to_string(PointLabel label) {
  static constexpr std::array<const char*, point_label_count> names = {"outside", "table",   "arm",
                                                                       "clutter", "outlier", "cloth"};
  return names[static_cast<int>(label)];
}

TablePlane find_table(const data::Points& points, const SegmentSettings& settings) {
  const std::vector<int> rows = finite_rows_within(settings.crop, points);
  const Eigen::Vector3d origin = origin_of(points, rows);
  const std::string what = "no plane across the vertical holds " +
                           std::to_string(settings.plane_fraction * 100) + " % of the " +
                           std::to_string(rows.size()) + " points inside the crop";
  if (rows.size() < 3) throw data::input_error("clouds", "table", what);
  pcl::SACSegmentation<pcl::PointXYZ> ransac;
  ransac.setInputCloud(to_pcl(points, rows, origin));
  ransac.setModelType(pcl::SACMODEL_PERPENDICULAR_PLANE);
  ransac.setMethodType(pcl::SAC_RANSAC);
  ransac.setAxis(settings.up.cast<float>());
  ransac.setEpsAngle(settings.plane_tilt);
  ransac.setDistanceThreshold(settings.plane_tolerance);
  ransac.setMaxIterations(1000);
  ransac.setOptimizeCoefficients(false);
  pcl::ModelCoefficients coefficients;
  pcl::PointIndices inliers;
  ransac.segment(inliers, coefficients);
  if (inliers.indices.size() < settings.plane_fraction * rows.size() || inliers.indices.size() < 3)
    throw data::input_error("clouds", "table", what);

  // Least squares over the inliers: the direction in which they spread least.
  data::Points plane(inliers.indices.size(), 3);
  for (std::size_t i = 0; i < inliers.indices.size(); ++i)
    plane.row(i) = points.row(rows[inliers.indices[i]]);
  const Eigen::RowVector3d centre = plane.colwise().mean();
  plane.rowwise() -= centre;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(plane.transpose() * plane);
  Eigen::Vector3d normal = spread.eigenvectors().col(0);
  if (normal.dot(settings.up) < 0) normal = -normal;
  return {centre.transpose(), normal};
}

Segmentation segment_cloth(const data::Points& points, const std::optional<TablePlane>& table,
                           const ArmCylinder& arm, const SegmentSettings& settings) {
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
  const std::vector<int> clusters = main_clusters(points, above, settings);
  for (int row : clusters) result.labels[row] = PointLabel::outlier;
  const std::vector<int> cloth = without_outliers(points, clusters, settings);
  for (int row : cloth) result.labels[row] = PointLabel::cloth;
  for (PointLabel label : result.labels) ++result.counts[static_cast<int>(label)];
  result.cloth = one_point_a_voxel(points, cloth, settings.voxel);
  return result;
}

}  // namespace flash::sysid
