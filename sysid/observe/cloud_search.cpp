#include "sysid/observe/cloud_search.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#ifdef FLASH_HAVE_CUDA
#include "sim/cuda/device_error.h"
#include "sim/cuda/surface_feet.h"
#include "sim/device_error.h"
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

using sim::cuda::SurfaceFeet;

/// What `work` returns; a device that fails becomes an error of who searches.
template <class Work>
auto on_device(const Work& work) {
  try {
    return work();
  } catch (const sim::cuda::DeviceError& error) {
    throw sim::DeviceError(error.what());
  }
}

/// Where and how fast surface_at has the surface: in the span always between two steps, where it knows both.
sim::cuda::BetweenSteps time_on(const Motion& motion, double t) {
  const auto [first, last] = steps_at(motion, t);
  const double steps = (t - motion.start) / motion.step;
  const auto below = static_cast<std::size_t>(std::max(steps, 0.0));
  const auto at = [](std::size_t step) { return static_cast<int>(step); };
  if (first != last) return {at(first), at(last), steps - static_cast<double>(first)};
  const bool inside = steps > 0 && below + 1 < motion.positions.size() &&
                      motion.positions[below].rows() > 0 && motion.positions[below + 1].rows() > 0;
  if (!inside) return {at(first), at(first), 0};
  return {at(below), at(below + 1), first == below ? 0.0 : 1.0};
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
  std::vector<std::unique_ptr<SurfaceFeet>> idle;
  std::size_t made = 0;

  /// Empty where a device has no room.
  std::unique_ptr<SurfaceFeet> take() {
    std::size_t number = 0;
    {
      const std::scoped_lock lock(mutex);
      if (!idle.empty()) {
        std::unique_ptr<SurfaceFeet> feet = std::move(idle.back());
        idle.pop_back();
        feet->begin_motion();
        return feet;
      }
      number = made++;
    }
    try {
      return std::make_unique<SurfaceFeet>(devices[number % devices.size()], triangles, vertices, order,
                                           clouds);
    } catch (const sim::cuda::OutOfMemory&) {
      return nullptr;
    }
  }

  void give_back(std::unique_ptr<SurfaceFeet> feet) {
    const std::scoped_lock lock(mutex);
    idle.push_back(std::move(feet));
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
    std::unique_ptr<SurfaceFeet> free = on_device([&] { return pool->take(); });
    if (free == nullptr) return {};
    const std::shared_ptr<SurfaceFeet> feet(
        free.release(), [pool](SurfaceFeet* used) { pool->give_back(std::unique_ptr<SurfaceFeet>(used)); });
    return [pool, feet, &motion](CloudPoints points, const Registration& registration) {
      std::vector<sim::cuda::BetweenSteps> times;
      for (const double t : pool->times) times.push_back(time_on(motion, t + registration.time_offset));
      return on_device([&] {
        return feet->find(points == CloudPoints::all ? 0 : 1, motion.positions, motion.step, times,
                          registration.observed_from_simulated().inverse());
      });
    };
  };
}

#else

CloudSearches device_searches(const Replay&, int) { return {}; }

#endif

}  // namespace flash::sysid
