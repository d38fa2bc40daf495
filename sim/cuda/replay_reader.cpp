#include "sim/cuda/replay_reader.h"

#include <algorithm>
#include <utility>

#include "sim/cuda/replay_records.h"

namespace flash::sim::cuda {

char* ReplayReader::room(std::size_t bytes) {
  constexpr int few = 256;  // environments of which so many are read sooner than memory is pinned
  if (replay_.count > few) {
    pinned_.hold(bytes);
    return pinned_.data();
  }
  if (bytes > pageable_.size()) pageable_.resize(bytes);
  return pageable_.data();
}

ReplayState ReplayReader::read_state(int environment) {
  use_device(replay_.device);
  const auto e = static_cast<std::size_t>(environment);
  const std::size_t vertices = replay_.size();
  const int layers = replay_.obstacle_counts[e];
  const std::size_t all = (2 + static_cast<std::size_t>(layers)) * vertices;
  Point* points = reinterpret_cast<Point*>(room(all * sizeof(Point)));
  const auto fetch = [](const Point* from, std::size_t count, Point* to) {
    if (count > 0)
      check(cudaMemcpyAsync(to, from, count * sizeof(Point), cudaMemcpyDeviceToHost, cudaStreamPerThread));
  };
  fetch(replay_.positions.data() + e * vertices, vertices, points);
  fetch(replay_.velocities.data() + e * vertices, vertices, points + vertices);
  fetch(replay_.bristles.data() + e * static_cast<std::size_t>(replay_.most_obstacles_each) * vertices,
        static_cast<std::size_t>(layers) * vertices, points + 2 * vertices);
  check(cudaStreamSynchronize(cudaStreamPerThread));

  const auto size = static_cast<Eigen::Index>(vertices);
  ReplayState state{data::Points(size, 3), data::Points(size, 3), data::Points(layers * size, 3)};
  const std::vector<int>& order = replay_.layout.order;
  put_points(points, order, state.positions);
  put_points(points + vertices, order, state.velocities);
  for (int k = 0; k < layers; ++k)
    put_points(points + (2 + static_cast<std::size_t>(k)) * vertices, order,
               state.bristles.middleRows(k * size, size));
  return state;
}

void ReplayReader::read_kept(int environment, int first, int count, double* to) {
  if (count == 0) return;
  use_device(replay_.device);
  const std::size_t numbers = static_cast<std::size_t>(count) * 3 * replay_.size();
  double* kept = reinterpret_cast<double*>(room(numbers * sizeof(double)));
  copy_to_end(kept, replay_.tables.kept(environment, first), numbers * sizeof(double),
              cudaMemcpyDeviceToHost);
  std::copy(kept, kept + numbers, to);
}

std::unique_ptr<ReplayReader> IdleReaders::take() {
  {
    const std::scoped_lock lock(mutex_);
    if (!idle_.empty()) {
      auto reader = std::move(idle_.back());
      idle_.pop_back();
      return reader;
    }
  }
  return std::make_unique<ReplayReader>(replay_);
}

void IdleReaders::give_back(std::unique_ptr<ReplayReader> reader) {
  const std::scoped_lock lock(mutex_);
  idle_.push_back(std::move(reader));
}

}  // namespace flash::sim::cuda
