#include "sim/cuda/surface_feet.h"

#include <array>
#include <optional>
#include <stdexcept>

#include "sim/cuda/device_array.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/feet_kernels.h"
#include "sim/cuda/pinned_array.h"
#include "sim/law/rigid_frame.h"

namespace flash::sim::cuda {
namespace {

using Place = Vector3<double>;

constexpr int steps_each = 2;  // of a cloud; a step has the place of its parity, so that neighbours have two

/// Clouds one behind the other.
struct CloudSet {
  std::vector<std::size_t> sizes;
  DeviceArray<Place> points;
  DeviceArray<int> cloud_of;

  explicit CloudSet(const std::vector<data::Points>& clouds) {
    std::vector<Place> all;
    std::vector<int> of;
    for (std::size_t k = 0; k < clouds.size(); ++k) {
      for (Eigen::Index i = 0; i < clouds[k].rows(); ++i) all.push_back(vector3(clouds[k].row(i)));
      sizes.push_back(static_cast<std::size_t>(clouds[k].rows()));
      of.resize(all.size(), static_cast<int>(k));
    }
    points = DeviceArray<Place>(all);
    cloud_of = DeviceArray<int>(of);
  }
};

}  // namespace

struct SurfaceFeet::Memory {
  int device;
  std::size_t clouds, vertices;
  std::vector<CloudSet> sets;
  std::vector<std::array<int, steps_each>> held;  ///< steps that each cloud's places hold; -1: none
  DeviceArray<Vector3<int>> corners;
  DeviceArray<Place> steps;
  DeviceArray<SurfaceTime> times;
  DeviceArray<double> placed, boxes;
  DeviceArray<SurfaceFoot> feet;
  std::optional<PinnedArray<SurfaceFoot>> feet_read;  // on the host
  FeetNumbers numbers{};

  Memory(int used, const data::Triangles& mesh, Eigen::Index mesh_vertices, const std::vector<int>& order,
         const std::vector<std::vector<data::Points>>& clouds_of_sets)
      : device((use_device(used), used)),
        clouds(clouds_of_sets.front().size()),
        vertices(static_cast<std::size_t>(mesh_vertices)),
        held(clouds) {
    const std::size_t groups = (order.size() + group_triangles - 1) / group_triangles,
                      slots = groups * group_triangles;
    std::vector<int> of_slots = order;
    of_slots.resize(slots, order.back());
    std::vector<Vector3<int>> corners_of_slots;
    for (const int t : of_slots) corners_of_slots.push_back({mesh(t, 0), mesh(t, 1), mesh(t, 2)});
    corners = DeviceArray<Vector3<int>>(corners_of_slots);
    std::size_t most = 0;
    for (const std::vector<data::Points>& each : clouds_of_sets) {
      most = std::max(most, sets.emplace_back(each).points.size());
    }
    feet = DeviceArray<SurfaceFoot>(most);
    feet_read.emplace(most);
    steps = DeviceArray<Place>(clouds * steps_each * vertices);
    times = DeviceArray<SurfaceTime>(clouds);
    placed = DeviceArray<double>(9 * slots * clouds);
    boxes = DeviceArray<double>(6 * groups * clouds);
    numbers = {.surfaces = static_cast<int>(clouds),
               .vertices = static_cast<int>(vertices),
               .groups = static_cast<int>(groups),
               .corners = corners.data(),
               .steps = steps.data(),
               .times = times.data(),
               .placed = placed.data(),
               .boxes = boxes.data(),
               .feet = feet.data()};
  }

  /// The place of a step of a cloud's two, which takes it to the device where it is not there yet.
  int place(std::size_t cloud, int step, const std::vector<data::Points>& motion) {
    const int parity = step % steps_each, place = static_cast<int>(cloud) * steps_each + parity;
    int& there = held[cloud][static_cast<std::size_t>(parity)];
    if (there == step) return place;
    const data::Points& positions = motion.at(static_cast<std::size_t>(step));
    if (static_cast<std::size_t>(positions.rows()) != vertices)
      throw std::invalid_argument("surface feet: a step without the positions of all vertices");
    static_assert(sizeof(Place) == 3 * sizeof(double));
    check(cudaMemcpyAsync(steps.data() + static_cast<std::size_t>(place) * vertices, positions.data(),
                          vertices * sizeof(Place), cudaMemcpyHostToDevice, cudaStreamPerThread));
    there = step;
    return place;
  }
};

SurfaceFeet::SurfaceFeet(int device, const data::Triangles& triangles, Eigen::Index vertices,
                         const std::vector<int>& order, const std::vector<std::vector<data::Points>>& sets)
    : memory_(std::make_unique<Memory>(device, triangles, vertices, order, sets)) {
  begin_motion();
}
SurfaceFeet::~SurfaceFeet() = default;
SurfaceFeet::SurfaceFeet(SurfaceFeet&&) noexcept = default;

void SurfaceFeet::begin_motion() {
  for (auto& steps : memory_->held) steps.fill(-1);
}

std::vector<std::span<const SurfaceFoot>> SurfaceFeet::find(std::size_t set,
                                                            const std::vector<data::Points>& motion,
                                                            double time_step,
                                                            const std::vector<BetweenSteps>& times,
                                                            const Eigen::Isometry3d& surface_from_cloud) {
  Memory& m = *memory_;
  use_device(m.device);
  const CloudSet& clouds = m.sets.at(set);
  std::vector<SurfaceTime> placed(m.clouds);
  for (std::size_t k = 0; k < m.clouds; ++k)
    if (clouds.sizes[k] > 0)
      placed[k] = {m.place(k, times[k].first, motion), m.place(k, times[k].last, motion), times[k].fraction};
  FeetNumbers numbers = m.numbers;
  numbers.points = static_cast<int>(clouds.points.size());
  numbers.cloud = clouds.points.data();
  numbers.surface_of = clouds.cloud_of.data();
  numbers.surface_from_cloud = frame_of(surface_from_cloud);
  numbers.steps_per_second = 1 / time_step;
  check(cudaMemcpyAsync(m.times.data(), placed.data(), placed.size() * sizeof(SurfaceTime),
                        cudaMemcpyHostToDevice, cudaStreamPerThread));
  place_and_search(numbers, cudaStreamPerThread);
  copy_to_end(m.feet_read->data(), m.feet.data(), clouds.points.size() * sizeof(SurfaceFoot),
              cudaMemcpyDeviceToHost);
  std::vector<std::span<const SurfaceFoot>> feet;
  const SurfaceFoot* at = m.feet_read->data();
  for (const std::size_t size : clouds.sizes) {
    feet.emplace_back(at, size);
    at += size;
  }
  return feet;
}

}  // namespace flash::sim::cuda
