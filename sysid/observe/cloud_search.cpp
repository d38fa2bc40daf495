#include "sysid/observe/cloud_search.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#ifdef FLASH_HAVE_CUDA
#include "sim/cuda/nearest_triangles.h"
#include "sim/cuda/out_of_memory.h"
#endif

namespace flash::sysid {

std::vector<Observation> thinned(const std::vector<Observation>& observations, int points) {
  const auto thin = [points](data::Points& cloud) {
    const Eigen::Index count = cloud.rows();
    if (count <= points) return;
    data::Points kept(points, 3);
    for (Eigen::Index i = 0; i < points; ++i) kept.row(i) = cloud.row(i * count / points);
    cloud = kept;
  };
  std::vector<Observation> result = observations;
  for (Observation& observation : result) {
    thin(observation.points);
    thin(observation.contour);
  }
  return result;
}

#ifdef FLASH_HAVE_CUDA

namespace {

using Places = sim::cuda::NearestTriangles;

sim::cuda::BetweenSteps time_on(const Motion& motion, double t) {
  const auto [first, last] = steps_at(motion, t);
  const double fraction = first == last ? 0 : (t - motion.start) / motion.step - static_cast<double>(first);
  return {static_cast<int>(first), static_cast<int>(last), fraction};
}

/// What searches of one replay share: memory of devices that no thread uses at the moment.
struct Pool {
  data::Triangles triangles;
  Eigen::Index vertices = 0;
  std::vector<int> order;
  std::vector<double> times;                      // of the keyframes [s]
  std::vector<std::vector<data::Points>> clouds;  // all, thinned
  std::vector<int> devices;
  std::mutex mutex;  // of what follows
  std::vector<std::unique_ptr<Places>> idle;
  std::size_t made = 0;

  /// Empty where a device has no room.
  std::unique_ptr<Places> take() {
    std::size_t number = 0;
    {
      const std::scoped_lock lock(mutex);
      if (!idle.empty()) {
        std::unique_ptr<Places> places = std::move(idle.back());
        idle.pop_back();
        places->begin_motion();
        return places;
      }
      number = made++;
    }
    try {
      return std::make_unique<Places>(devices[number % devices.size()], triangles, vertices, order, clouds);
    } catch (const sim::cuda::OutOfMemory&) {
      return nullptr;
    }
  }

  void give_back(std::unique_ptr<Places> places) {
    const std::scoped_lock lock(mutex);
    idle.push_back(std::move(places));
  }
};

}  // namespace

CloudSearches device_searches(const Replay& replay, int points_per_keyframe) {
  const std::vector<Observation>& all = replay.observations;
  const bool any =
      std::any_of(all.begin(), all.end(), [](const Observation& each) { return each.points.rows() > 0; });
  if (replay.settings.device != sim::Device::cuda || !any) return {};
  const auto pool = std::make_shared<Pool>();
  pool->triangles = replay.surface.triangles;
  pool->vertices = replay.surface.vertices.rows();
  pool->order = replay.queries->triangles_in_order();
  pool->devices = replay.settings.cuda_devices;
  if (pool->devices.empty()) pool->devices = {0};
  const std::vector<Observation> few = thinned(all, points_per_keyframe);
  pool->clouds.resize(2);
  for (std::size_t k = 0; k < all.size(); ++k) {
    pool->times.push_back(all[k].t);
    pool->clouds[0].push_back(all[k].points);
    pool->clouds[1].push_back(all[k].weight > 0 ? few[k].points : data::Points(0, 3));
  }
  return [pool](const Motion& motion) -> CloudSearch {
    std::unique_ptr<Places> free = pool->take();
    if (free == nullptr) return {};
    const std::shared_ptr<Places> places(
        free.release(), [pool](Places* used) { pool->give_back(std::unique_ptr<Places>(used)); });
    return [pool, places, &motion](CloudPoints points, const Registration& registration,
                                   std::vector<std::vector<int>>& triangles) {
      std::vector<sim::cuda::BetweenSteps> times;
      for (const double t : pool->times) times.push_back(time_on(motion, t + registration.time_offset));
      places->find(points == CloudPoints::all ? 0 : 1, motion.positions, times,
                   registration.observed_from_simulated().inverse(), triangles);
    };
  };
}

#else

CloudSearches device_searches(const Replay&, int) { return {}; }

#endif

}  // namespace flash::sysid
