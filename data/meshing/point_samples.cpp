#include "data/meshing/point_samples.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nanoflann.hpp>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "data/numbers/median.h"

namespace flash::data {
namespace {

using Tree = nanoflann::KDTreeEigenMatrixAdaptor<Points, 3>;

constexpr int leaf_size = 10;
constexpr std::size_t fewest_neighbours = 12;

/// Indices of the nearest points and their squared distances, the point itself first.
struct Neighbours {
  std::vector<Eigen::Index> indices;
  std::vector<double> squares;
};

Neighbours nearest(const Tree& tree, const Points& points, Eigen::Index i, std::size_t count) {
  Neighbours found{std::vector<Eigen::Index>(count), std::vector<double>(count)};
  const std::size_t size =
      tree.index->knnSearch(points.row(i).data(), count, found.indices.data(), found.squares.data());
  found.indices.resize(size);
  found.squares.resize(size);
  return found;
}

PointSamples rows_of(const PointSamples& samples, const std::vector<Eigen::Index>& kept) {
  return {samples.points(kept, Eigen::all),
          samples.normals.rows() > 0 ? Points(samples.normals(kept, Eigen::all)) : Points(),
          samples.weights(kept)};
}

/// Turns normals over along the edges of a tree that spans the neighbours of each, those that differ least
/// first.
void turn_to_one_side(const Points& points, const Tree& tree, Points& normals) {
  const Eigen::Index n = points.rows();
  std::vector<Neighbours> neighbours;
  std::vector<std::vector<Eigen::Index>> linked(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i)
    for (const Eigen::Index k : nearest(tree, points, i, fewest_neighbours).indices)
      if (k != i) {
        linked[std::size_t(i)].push_back(k);
        linked[std::size_t(k)].push_back(i);
      }
  using Step = std::tuple<double, Eigen::Index, Eigen::Index>;  // how much they differ, to, from
  std::vector<bool> done(std::size_t(n), false);
  for (Eigen::Index start = 0; start < n; ++start) {
    std::priority_queue<Step, std::vector<Step>, std::greater<>> steps;
    steps.emplace(0, start, start);
    while (!steps.empty()) {
      const auto [difference, to, from] = steps.top();
      steps.pop();
      if (done[std::size_t(to)]) continue;
      done[std::size_t(to)] = true;
      if (normals.row(to).dot(normals.row(from)) < 0) normals.row(to) *= -1;
      for (const Eigen::Index k : linked[std::size_t(to)])
        if (!done[std::size_t(k)]) steps.emplace(1 - std::abs(normals.row(to).dot(normals.row(k))), k, to);
    }
  }
  if (normals.col(2).sum() < 0) normals *= -1;
}

}  // namespace

PointSamples thinned(const PointSamples& samples, double cell) {
  using Cube = std::array<std::int64_t, 3>;
  std::vector<std::pair<Cube, Eigen::Index>> order(std::size_t(samples.points.rows()));
  for (Eigen::Index i = 0; i < samples.points.rows(); ++i) {
    Cube cube;
    for (int k = 0; k < 3; ++k)
      cube[std::size_t(k)] = static_cast<std::int64_t>(std::floor(samples.points(i, k) / cell));
    order[std::size_t(i)] = {cube, i};
  }
  std::sort(order.begin(), order.end());
  PointSamples result{Points(samples.points.rows(), 3), {}, Eigen::VectorXd(samples.points.rows())};
  Eigen::Index rows = 0;
  for (std::size_t begin = 0; begin < order.size(); ++rows) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    double weight = 0;
    std::size_t end = begin;
    for (; end < order.size() && order[end].first == order[begin].first; ++end) {
      sum += samples.weights[order[end].second] * samples.points.row(order[end].second);
      weight += samples.weights[order[end].second];
    }
    result.points.row(rows) = sum / weight;
    result.weights[rows] = weight;
    begin = end;
  }
  result.points.conservativeResize(rows, 3);
  result.weights.conservativeResize(rows);
  return result;
}

double spacing_of(const PointSamples& samples) {
  const Tree tree(3, samples.points, leaf_size);
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < samples.points.rows(); ++i)
    distances.push_back(std::sqrt(nearest(tree, samples.points, i, 2).squares.back()));
  return median(distances);
}

PointSamples without_outliers(const PointSamples& samples) {
  constexpr std::size_t count = 8;
  constexpr double factor = 3;
  const Tree tree(3, samples.points, leaf_size);
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < samples.points.rows(); ++i) {
    double sum = 0;
    for (const double squared : nearest(tree, samples.points, i, count + 1).squares)
      sum += std::sqrt(squared);
    distances.push_back(sum / count);
  }
  const double limit = factor * median(distances);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < samples.points.rows(); ++i)
    if (distances[std::size_t(i)] <= limit) kept.push_back(i);
  return rows_of(samples, kept);
}

void find_normals(PointSamples& samples, double radius) {
  const Points& points = samples.points;
  const Tree tree(3, points, leaf_size);
  samples.normals.resize(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    std::vector<Eigen::Index> near = nearest(tree, points, i, fewest_neighbours).indices;
    std::vector<std::pair<Eigen::Index, double>> within;
    tree.index->radiusSearch(points.row(i).data(), radius * radius, within, nanoflann::SearchParams());
    if (within.size() > near.size()) {
      near.clear();
      for (const auto& [index, squared] : within) near.push_back(index);
    }
    double weight = 0;
    Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
    for (const Eigen::Index k : near) {
      mean += samples.weights[k] * points.row(k);
      weight += samples.weights[k];
    }
    mean /= weight;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Eigen::Index k : near) {
      const Eigen::Vector3d from_mean = points.row(k) - mean;
      spread += samples.weights[k] / weight * from_mean * from_mean.transpose();
    }
    samples.normals.row(i) = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  }
  turn_to_one_side(points, tree, samples.normals);
}

}  // namespace flash::data
