#include "sim/cuda/projective_replay.h"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <string>
#include <utility>

#include "data/files/error.h"
#include "data/machine/parallel.h"
#include "sim/cuda/device_arena.h"
#include "sim/cuda/layout/inverse_factor.h"
#include "sim/cuda/layout/solve_image.h"
#include "sim/cuda/phase_clock.h"
#include "sim/cuda/projective_kernel.h"
#include "sim/oracle/projective_system.h"

namespace flash::sim::cuda {
namespace {

/// A material with what holds the sheet: those that share them share a factor.
struct FactorKey {
  data::SheetMaterial material;
  std::vector<char> held;

  bool operator==(const FactorKey&) const = default;
};

/// Vertices that are held in all steps of a motion. Throws where they change or keep an axis free.
std::vector<char> held_vertices(const ReplayEnvironment& environment, int size) {
  std::vector<char> held(static_cast<std::size_t>(size), 0);
  const HoldMotion* motion = environment.holds.get();
  if (motion == nullptr) return held;
  for (std::size_t k = 0; k < motion->size(); ++k) {
    std::vector<char> now(static_cast<std::size_t>(size), 0);
    for (const HeldVertex& vertex : (*motion)[k]) {
      if (vertex.axes != std::array<bool, 3>{true, true, true})
        throw data::InputError(
            "--device cuda: the projective method holds vertices in all axes there, found one held in some");
      now[static_cast<std::size_t>(vertex.vertex)] = 1;
    }
    if (k == 0) held = now;
    if (now != held)
      throw std::invalid_argument("replay: the projective method needs the same vertices held in all steps");
  }
  return held;
}

MultiplierSettings multipliers_of(const ProjectiveSettings& settings) {
  const ConstraintSettings& c = settings.constraints;
  return {{c.complementarity == Complementarity::fischer_burmeister, c.friction == FrictionRow::fixed_point},
          c.iterations,
          c.tolerance,
          c.max_force,
          c.damping,
          settings.tangent_angle};
}

ProjectiveMemory lay_out(const ProjectiveSizes& sizes, const ProjectiveNumbers& numbers, DeviceArena& arena) {
  const auto number = [](long count) { return static_cast<std::size_t>(count); };
  const std::size_t size = number(sizes.layout.size), triangles = number(sizes.layout.triangle_count),
                    hinges = number(sizes.layout.hinge_count), obstacles = number(sizes.most_obstacles);
  ProjectiveMemory m{};
  m.positions = arena.take<Point>(size);
  m.force = arena.take<double>(3 * size);
  m.held_axes = arena.take<int>(size);
  m.forces = arena.take<Four<float>>(size);
  m.reactions = arena.take<Four<float>>(size);
  m.pulls = arena.take<Four<float>>(size);
  m.bending = arena.take<float>(3 * size);
  m.shares = arena.take<Four<float>>(3 * triangles);
  if (!numbers.on_chip) {
    m.places = arena.take<Four<float>>(2 * size);
    m.solve = arena.take<char>(number(numbers.solve.bytes));
  }
  if (sizes.damped || hinges > 0) {
    m.triangle_gradients = arena.take<double>(9 * triangles);
    m.hinge_gradients = arena.take<double>(12 * hinges);
  }
  if (sizes.damped) {
    m.start_metrics = arena.take<double>(3 * triangles);
    m.start_angles = arena.take<double>(hinges);
    m.bent = arena.take<Point>(size);
    m.damped = arena.take<double>(3 * size);
  }
  m.obstacles = arena.take<MovingObstacle<double>>(obstacles);
  m.touching = arena.take<int>(size * obstacles);
  m.surfaces = arena.take<Four<float>>(size * obstacles);
  m.slips = arena.take<float2>(size * obstacles);
  m.contact_forces = arena.take<Four<float>>(size * obstacles);
  m.clocks = arena.take<long long>(replay_phases + 1);
  return m;
}

}  // namespace

ProjectiveReplay::ProjectiveReplay(const ProjectiveSizes& sizes,
                                   const std::vector<ReplayEnvironment>& environments,
                                   const ReplaySettings& settings, const ReplayNumbers& numbers)
    : precision_(settings.precision) {
  const ProjectiveSettings& projective = *settings.projective;
  numbers_.replay = numbers;
  numbers_.multipliers = multipliers_of(projective);
  numbers_.iterations = projective.iterations;
  numbers_.contact_tolerance = projective.contact_tolerance;
  const auto first = projective_matrix(sizes.plan, {environments.front().material}, settings.time_step);
  const InverseTree tree = plan_inverse(pattern_of(first.matrix), sizes.plan.sheet.rest.vertices);
  numbers_.solve = make_solve_image(tree, block_warps).layout;
  blocks_ = settings.team_blocks > 0
                ? settings.team_blocks
                : projective_team_blocks(numbers_, precision_, static_cast<int>(environments.size()));
  upload_tree(tree);
  upload_triangles(sizes.layout);
  place_on_chip(numbers_, precision_, blocks_);
  lay_out_teams(sizes, static_cast<int>(environments.size()));
  upload_factors(sizes, tree, environments, settings);
}

void ProjectiveReplay::upload_tree(const InverseTree& tree) {
  const SolveImage image = make_solve_image(tree, blocks_ * block_warps);
  solve_tables_ = DeviceArray<char>(image.tables);
  numbers_.solve = image.layout;
  numbers_.solve_tables = reinterpret_cast<const uint4*>(solve_tables_.data());
}

void ProjectiveReplay::upload_triangles(const SheetLayout& layout) {
  const auto count = static_cast<std::size_t>(layout.triangle_count);
  std::vector<int4> corners(count);
  std::vector<Four<float>> gradients(count);
  for (std::size_t t = 0; t < count; ++t) {
    const auto vertex = [&](std::size_t k) { return layout.triangle_vertices[k * count + t]; };
    const auto gradient = [&](std::size_t k) { return static_cast<float>(layout.gradients[k * count + t]); };
    corners[t] = {vertex(0), vertex(1), vertex(2), std::bit_cast<int>(static_cast<float>(layout.areas[t]))};
    gradients[t] = {gradient(0), gradient(1), gradient(2), gradient(3)};
  }
  // From corners of which each number stands by itself to those whose numbers stand together.
  std::vector<int> shares;
  for (const int corner : layout.corners) {
    const int of_corner = 3 * layout.triangle_count;
    shares.push_back(3 * (corner % of_corner) + corner / of_corner);
  }
  triangle_corners_ = DeviceArray<int4>(corners);
  triangle_gradients_ = DeviceArray<Four<float>>(gradients);
  corner_shares_ = DeviceArray<int>(shares);
  numbers_.triangle_corners = triangle_corners_.data();
  numbers_.triangle_gradients = triangle_gradients_.data();
  numbers_.corner_shares = corner_shares_.data();
}

void ProjectiveReplay::upload_factors(const ProjectiveSizes& sizes, const InverseTree& tree,
                                      const std::vector<ReplayEnvironment>& environments,
                                      const ReplaySettings& settings) {
  std::vector<FactorKey> keys;
  std::vector<int> factor_of;
  for (const ReplayEnvironment& environment : environments) {
    FactorKey key{environment.material, held_vertices(environment, sizes.layout.size)};
    key.material.friction = 0;  // which the matrix does not have
    auto found = std::find(keys.begin(), keys.end(), key);
    if (found == keys.end()) found = keys.insert(keys.end(), std::move(key));
    factor_of.push_back(static_cast<int>(found - keys.begin()));
  }
  const std::size_t tile_numbers =
      static_cast<std::size_t>(tree.tiles) * parts_of(precision_) * inverse_tile_numbers;
  tiles_ = DeviceArray<std::uint16_t>(keys.size() * tile_numbers);
  const auto size = static_cast<std::size_t>(tree.size);
  vertices_ = DeviceArray<SolveVertex>(keys.size() * size);
  const std::size_t at_once = 64;
  for (std::size_t begin = 0; begin < keys.size(); begin += at_once) {
    const std::size_t count = std::min(at_once, keys.size() - begin);
    std::vector<InverseFactor> factors(count);
    data::for_each_in_parallel(count, settings.threads, [&](std::size_t k) {
      const FactorKey& key = keys[begin + k];
      try {
        factors[k] =
            factorize_inverse(tree, projective_matrix(sizes.plan, {key.material}, settings.time_step).matrix,
                              key.held, precision_);
      } catch (const std::domain_error&) {
        throw data::InputError(
            "material: the system matrix is not positive definite: areal_density has to be above 0, "
            "bending_rigidity not below");
      }
    });
    for (std::size_t k = 0; k < count; ++k) {
      tiles_.write((begin + k) * tile_numbers, factors[k].tiles.data(), tile_numbers);
      std::vector<SolveVertex> vertices(size);
      for (std::size_t vertex = 0; vertex < size; ++vertex) {
        const int slot = tree.slot_of[vertex];
        vertices[static_cast<std::size_t>(sizes.position[vertex])] = {
            slot, place_in_vector(slot), factors[k].scale[static_cast<std::size_t>(slot)]};
      }
      vertices_.write((begin + k) * size, vertices.data(), size);
    }
  }
  factor_of_ = DeviceArray<int>(factor_of);
  numbers_.factor_of = factor_of_.data();
  numbers_.tiles = reinterpret_cast<const uint4*>(tiles_.data());
  numbers_.vertices = vertices_.data();
}

void ProjectiveReplay::lay_out_teams(const ProjectiveSizes& sizes, int environments) {
  const int count = std::min(environments, resident_projective_teams(numbers_, precision_, blocks_));
  DeviceArena counting(nullptr);
  lay_out(sizes, numbers_, counting);
  const std::size_t bytes = counting.used();
  arena_ = DeviceArray<char>(static_cast<std::size_t>(count) * bytes);
  std::vector<ProjectiveMemory> all;
  for (int t = 0; t < count; ++t) {
    DeviceArena own(arena_.data() + static_cast<std::size_t>(t) * bytes);
    all.push_back(lay_out(sizes, numbers_, own));
  }
  team_memory_ = DeviceArray<ProjectiveMemory>(all);
  numbers_.teams = team_memory_.data();
}

void ProjectiveReplay::run(cudaStream_t stream) const {
  run_projective(numbers_, precision_, teams(), blocks_, stream);
}

std::vector<double> ProjectiveReplay::phase_ticks() const {
  std::vector<double> ticks(projective_phases, 0.0);
  for (const ProjectiveMemory& team : team_memory_.read(0, team_memory_.size())) {
    long long clocks[projective_phases];
    copy_to_end(clocks, team.clocks, sizeof(clocks), cudaMemcpyDeviceToHost);
    for (int k = 0; k < projective_phases; ++k)
      ticks[static_cast<std::size_t>(k)] += static_cast<double>(clocks[k]);
  }
  return ticks;
}

}  // namespace flash::sim::cuda
