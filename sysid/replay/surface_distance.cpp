#include "sysid/replay/surface_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace flash::sysid {

// Compiled from sysid/replay/kernels for each level.
#ifdef __x86_64__
namespace v2 {
extern const SurfaceKernels surface_kernels;
}
namespace v3 {
extern const SurfaceKernels surface_kernels;
}
namespace v4 {
extern const SurfaceKernels surface_kernels;
}
#else
namespace generic {
extern const SurfaceKernels surface_kernels;
}
#endif

namespace {

constexpr int width = surface_width;  // Work: as there.
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int most_levels = 11;  // 8^11 packets are more than an int counts. Work.

const SurfaceKernels& surface_kernels_of([[maybe_unused]] sim::InstructionLevel level) {
#ifdef __x86_64__
  return level == sim::InstructionLevel::v4   ? v4::surface_kernels
         : level == sim::InstructionLevel::v3 ? v3::surface_kernels
                                              : v2::surface_kernels;
#else
  return generic::surface_kernels;
#endif
}

/// Orders triangles so that every aligned run of 8, 64, 512, ... is compact: halves along the longest axis,
/// cut at multiples of the largest power of eight below the count.
void order_in_space(const data::Points& centroids, std::vector<int>::iterator first,
                    std::vector<int>::iterator last) {
  const std::ptrdiff_t count = last - first;
  if (count <= width) return;
  std::ptrdiff_t unit = width;
  while (unit * width < count) unit *= width;
  Eigen::Array3d low = Eigen::Array3d::Constant(kInfinity), high = -low;
  for (auto i = first; i != last; ++i) {
    low = low.min(centroids.row(*i).transpose().array());
    high = high.max(centroids.row(*i).transpose().array());
  }
  int axis;
  (high - low).maxCoeff(&axis);
  const std::ptrdiff_t units = (count + unit - 1) / unit;
  const auto middle = first + unit * ((units + 1) / 2);
  std::nth_element(first, middle, last,
                   [&](int i, int j) { return centroids(i, axis) < centroids(j, axis); });
  order_in_space(centroids, first, middle);
  order_in_space(centroids, middle, last);
}

}  // namespace

SurfaceDistance::SurfaceDistance(const data::Triangles& triangles, const data::Points& layout,
                                 sim::InstructionLevel level)
    : kernels_(&surface_kernels_of(level)), triangles_(triangles) {
  const int count = static_cast<int>(triangles.rows());
  data::Points centroids(count, 3);
  for (int i = 0; i < count; ++i) {
    centroids.row(i) =
        (layout.row(triangles(i, 0)) + layout.row(triangles(i, 1)) + layout.row(triangles(i, 2))) / 3.0;
  }
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0);
  order_in_space(centroids, order_.begin(), order_.end());
  slot_of_.resize(count);
  for (int slot = 0; slot < count; ++slot) slot_of_[order_[slot]] = slot;

  const int packets = (count + width - 1) / width;
  order_.resize(static_cast<std::size_t>(packets) * width, -1);
  packets_.resize(packets);
  corners_.resize(packets);
  for (int slot = 0; slot < packets * width; ++slot) {
    // Empty slots repeat the last triangle, which changes no answer.
    const int triangle = order_[slot] >= 0 ? order_[slot] : order_[count - 1];
    for (int k = 0; k < 3; ++k) corners_[slot / width].of[k][slot % width] = triangles(triangle, k);
  }
  for (int size = packets; levels_.empty() || size > 1;) {
    size = (size + width - 1) / width;
    levels_.emplace_back(size);
  }
  for (auto& nodes : levels_)  // a box without triangles stays so
    for (BoxNode& node : nodes) {
      std::fill(&node.low[0][0], &node.low[0][0] + 3 * width, kInfinity);
      std::fill(&node.high[0][0], &node.high[0][0] + 3 * width, -kInfinity);
    }
  move(layout);
}

void SurfaceDistance::move(const data::Points& positions) {
  positions_ = positions;
  kernels_->move({corners_.data(), positions_.data(), static_cast<int>(packets_.size()), packets_.data(),
                  levels_[0].data()});
  for (std::size_t level = 1; level < levels_.size(); ++level) {
    for (std::size_t i = 0; i < levels_[level - 1].size(); ++i) {
      const BoxNode& below = levels_[level - 1][i];
      BoxNode& node = levels_[level][i / width];
      for (int k = 0; k < 3; ++k) {
        node.low[k][i % width] = *std::min_element(below.low[k], below.low[k] + width);
        node.high[k][i % width] = *std::max_element(below.high[k], below.high[k] + width);
      }
    }
  }
}

SurfacePoint SurfaceDistance::nearest(const Eigen::Vector3d& query, int hint) const {
  double best = kInfinity;
  int slot = 0;
  std::array<const BoxNode*, most_levels> levels;
  std::transform(levels_.begin(), levels_.end(), levels.begin(),
                 [](const auto& level) { return level.data(); });
  const SurfaceTree tree = {packets_.data(), levels.data()};
  if (hint >= 0) kernels_->search_packet(tree, slot_of_[hint] / width, query.data(), best, slot);
  kernels_->search(tree, static_cast<int>(levels_.size()) - 1, 0, query.data(), best, slot);
  const int triangle = order_[slot] >= 0 ? order_[slot] : order_[slot_of_.size() - 1];
  SurfacePoint result =
      nearest_on_triangle(query, positions_.row(triangles_(triangle, 0)),
                          positions_.row(triangles_(triangle, 1)), positions_.row(triangles_(triangle, 2)));
  result.triangle = triangle;
  return result;
}

std::vector<int> SurfaceDistance::triangles_in_order() const {
  return {order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(slot_of_.size())};
}

SurfacePoint nearest_on_triangle(const Eigen::Vector3d& query, const Eigen::Vector3d& a,
                                 const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = query - a, bp = query - b, cp = query - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
               d6 = ac.dot(cp);
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  Eigen::Vector3d weights;
  if (d1 <= 0 && d2 <= 0) {
    weights = {1, 0, 0};
  } else if (d3 >= 0 && d4 <= d3) {
    weights = {0, 1, 0};
  } else if (d6 >= 0 && d5 <= d6) {
    weights = {0, 0, 1};
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double s = d1 / (d1 - d3);
    weights = {1 - s, s, 0};
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double s = d2 / (d2 - d6);
    weights = {1 - s, 0, s};
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double s = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    weights = {0, 1 - s, s};
  } else {
    weights = Eigen::Vector3d(va, vb, vc) / (va + vb + vc);
  }
  SurfacePoint result;
  result.barycentric = weights;
  result.position = weights[0] * a + weights[1] * b + weights[2] * c;
  result.distance = (query - result.position).norm();
  return result;
}

}  // namespace flash::sysid
