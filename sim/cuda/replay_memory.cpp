#include "sim/cuda/replay_memory.h"

#include <algorithm>
#include <utility>

#include "sim/cuda/device_arena.h"
#include "sim/cuda/flat_motions.h"
#include "sim/cuda/replay_checks.h"
#include "sim/cuda/replay_kernel.h"
#include "sim/law/membrane.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim::cuda {

using data::Points;

namespace {

const BendingOperator& common_bending(const SheetPlan& plan,
                                      const std::vector<ReplayEnvironment>& environments) {
  require(!environments.empty(), "no environments");
  const auto bending = [&](const ReplayEnvironment& e) -> const BendingOperator& {
    return bending_operator(plan, e.material);
  };
  for (const ReplayEnvironment& e : environments)
    require(&bending(e) == &bending(environments.front()), "all environments need the same bending operator");
  return bending(environments.front());
}

ReplayMaterial material_of(const SheetPlan& plan, const ReplayEnvironment& environment, int motion) {
  const data::SheetMaterial& m = environment.material;
  const SheetLame lame = sheet_lame(m.membrane_stiffness, m.poissons_ratio);
  const Membrane membrane = membrane_of(m.constitutive, lame);
  const double gravity = environment.gravity.norm(), weight_factor = gravity > 0 ? gravity : 9.81;
  return {membrane.law,
          membrane.lame,
          {lame.mu, m.constitutive == data::Constitutive::tri_arap ? 0 : lame.lambda},
          m.membrane_stiffness,
          m.bending_rigidity,
          m.areal_density,
          m.air_drag,
          m.stiffness_damping,
          {environment.gravity.x(), environment.gravity.y(), environment.gravity.z()},
          weight_factor,
          m.areal_density * plan.sheet.vertex_area.norm() * weight_factor,
          2 * m.bending_rigidity * bending_operator(plan, m).flat_energy,
          motion,
          static_cast<int>(environment.obstacles.size()),
          stand_beside(environment.obstacles)};
}

}  // namespace

ReplayMemory::ReplayMemory(const SheetPlan& sheet, const std::vector<ReplayEnvironment>& environments,
                           ReplaySettings replay_settings)
    : settings(std::move(replay_settings)),
      count(static_cast<int>(environments.size())),
      step(settings.first_step),
      front_plan(plan_fronts(sheet.pattern, sheet.sheet.rest.vertices, fitting_fronts(settings.fronts))),
      layout(lay_out(sheet, common_bending(sheet, environments), front_plan)),
      plan(front_plan, layout) {
  upload_state(environments);
  const MostHeld most_held = upload_motions(sheet, environments);
  upload_stiffness(environments);
  const int all_steps = settings.steps - settings.first_step;
  stats = DeviceArray<ReplayStats>(static_cast<std::size_t>(all_steps) * environments.size());
  upload_kept_steps();
  const bool damped = std::any_of(environments.begin(), environments.end(),
                                  [](const auto& e) { return e.material.stiffness_damping != 0; });
  const int most_obstacles_each = upload_obstacles(environments);
  upload_bristles(environments, most_obstacles_each);
  if (!settings.projective) {
    plan_stages();
    lay_out_teams({plan.fronts, layout, damped, most_held.springs, most_held.vertices, most_obstacles_each});
  }
  steps = DeviceArray<int>(environments.size());
  work = DeviceArray<int>(environments.size());
  unfinished = DeviceArray<int>(1);

  numbers.fronts = plan.fronts;
  numbers.sheet = plan.sheet;
  numbers.teams = team_memory.data();
  check(cudaMallocHost(&stop, sizeof(int)));
  *stop = 0;
  numbers.waiting = {steps.data(), work.data(), unfinished.data(), count, 0, 0, 0, stop};
  numbers.time_step = settings.time_step;
  numbers.tolerance = settings.tolerance;
  numbers.max_iterations = settings.max_iterations;
  numbers.stale_factor_solves = settings.stale_factor_solves;
  numbers.halvings = settings.halvings;
  numbers.restart_interval = settings.restart_interval;
  numbers.stats_begin = settings.first_step;
  numbers.stats_each = all_steps;
  numbers.materials = materials.data();
  numbers.loads = loads.data();
  numbers.hold_starts = hold_starts.data();
  numbers.motion_steps = all_steps + 1;
  numbers.holds = holds.data();
  numbers.spring_starts = spring_starts.data();
  numbers.springs = springs.data();
  numbers.stiffness = stiffness.data();
  numbers.obstacles = obstacles.data();
  numbers.most_obstacles_each = most_obstacles_each;
  numbers.poses = poses.data();
  numbers.exit_speed = settings.exit_speed;
  numbers.states = {positions.data(), velocities.data(), bristles.data()};
  numbers.stats = stats.data();
  numbers.hold_count = environments.front().hold_count;
  hold_forces = DeviceArray<double>(3 * stats.size() * static_cast<std::size_t>(numbers.hold_count));
  numbers.hold_forces = hold_forces.data();
  numbers.kept_index = kept_index.data();
  numbers.kept_count = static_cast<int>(settings.kept_steps.size());
  numbers.order = order.data();
  numbers.kept = kept.data();
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  keep_start(environments);
  if (!settings.projective) return;
  projection = std::make_unique<ProjectiveReplay>(
      ProjectiveSizes{sheet, layout, front_plan.position, damped, most_obstacles_each}, environments,
      settings, numbers);
  teams = projection->teams();
  team_blocks = projection->team_blocks();
  require(teams > 0, "the sheet is too large for the device");
}

ReplayMemory::~ReplayMemory() {
  cudaFreeHost(stop);
  if (stream != nullptr) cudaStreamDestroy(stream);
}

std::size_t ReplayMemory::size() const { return layout.order.size(); }

void ReplayMemory::wait() const {
  use_device(device);
  check(cudaStreamSynchronize(stream));
}

void ReplayMemory::upload_state(const std::vector<ReplayEnvironment>& environments) {
  std::vector<Point> x, v, forces;
  const bool loaded = std::any_of(environments.begin(), environments.end(),
                                  [](const ReplayEnvironment& e) { return !e.loads.empty(); });
  for (const ReplayEnvironment& e : environments) {
    Points load = Points::Zero(e.positions.rows(), 3);
    for (const Load& one : e.loads) load.row(one.vertex) += one.force.transpose();
    for (const int vertex : layout.order) {
      const auto point = [vertex](const Points& p) {
        return Point{p(vertex, 0), p(vertex, 1), p(vertex, 2), 0};
      };
      x.push_back(point(e.positions));
      v.push_back(point(e.velocities));
      if (loaded) forces.push_back(point(load));
    }
  }
  positions = DeviceArray<Point>(x);
  velocities = DeviceArray<Point>(v);
  loads = DeviceArray<Point>(forces);
  order = DeviceArray<int>(layout.order);
}

void ReplayMemory::upload_bristles(const std::vector<ReplayEnvironment>& environments,
                                   int most_obstacles_each) {
  std::vector<Point> all;
  for (const ReplayEnvironment& e : environments) {
    for (int k = 0; k < most_obstacles_each; ++k)
      for (const int vertex : layout.order) {
        const Eigen::Index row = static_cast<Eigen::Index>(k) * layout.size + vertex;
        all.push_back(row < e.bristles.rows()
                          ? Point{e.bristles(row, 0), e.bristles(row, 1), e.bristles(row, 2), 0}
                          : Point{});
      }
  }
  bristles = DeviceArray<Point>(all);
}

ReplayMemory::MostHeld ReplayMemory::upload_motions(const SheetPlan& sheet,
                                                    const std::vector<ReplayEnvironment>& environments) {
  FlatMotions flat;
  for (const ReplayEnvironment& e : environments)
    if (e.schedule != nullptr)
      flat.frames = std::max(flat.frames, static_cast<int>(e.schedule->frames.size()));
  numbers.frames = flat.frames;
  std::vector<ReplayMaterial> all;
  for (const ReplayEnvironment& e : environments) {
    const int motion =
        flat.add(e, settings.time_step, settings.steps - settings.first_step, front_plan.position);
    all.push_back(material_of(sheet, e, motion));
  }
  poses = DeviceArray<FramePose>(flat.poses);
  materials = DeviceArray<ReplayMaterial>(all);
  hold_starts = DeviceArray<int>(flat.starts);
  holds = DeviceArray<HeldPlace>(flat.holds);
  spring_starts = DeviceArray<int>(flat.spring_starts);
  springs = DeviceArray<SpringPlace>(flat.springs);
  return {flat.most, !flat.springs.empty()};
}

void ReplayMemory::upload_stiffness(const std::vector<ReplayEnvironment>& environments) {
  std::size_t most = 0;
  for (const ReplayEnvironment& e : environments) most = std::max(most, e.stiffness.size());
  std::vector<double> all;
  for (const ReplayEnvironment& e : environments) {
    all.insert(all.end(), e.stiffness.begin(), e.stiffness.end());
    all.resize((static_cast<std::size_t>(&e - environments.data()) + 1) * most);
  }
  stiffness = DeviceArray<double>(all);
  numbers.stiffness_each = static_cast<int>(most);
}

int ReplayMemory::upload_obstacles(const std::vector<ReplayEnvironment>& environments) {
  std::size_t most = 0;
  for (const ReplayEnvironment& e : environments) {
    obstacle_counts.push_back(static_cast<int>(e.obstacles.size()));
    most = std::max(most, e.obstacles.size());
  }
  std::vector<PlacedObstacle> all;
  for (const ReplayEnvironment& e : environments) {
    for (const Obstacle& obstacle : e.obstacles)
      all.push_back({obstacle_in_frame(obstacle, e.material.friction), obstacle.frame});
    all.resize((static_cast<std::size_t>(&e - environments.data()) + 1) * most);
  }
  obstacles = DeviceArray<PlacedObstacle>(all);
  return static_cast<int>(most);
}

void ReplayMemory::upload_kept_steps() {
  const int all_steps = settings.steps - settings.first_step;
  std::vector<int> index(static_cast<std::size_t>(all_steps), -1);
  for (std::size_t k = 0; k < settings.kept_steps.size(); ++k)
    if (settings.kept_steps[k] > settings.first_step)
      index[static_cast<std::size_t>(settings.kept_steps[k] - settings.first_step - 1)] = static_cast<int>(k);
  kept_index = DeviceArray<int>(index);
  kept = DeviceArray<double>(static_cast<std::size_t>(count) * settings.kept_steps.size() * 3 * size());
}

void ReplayMemory::plan_stages() {
  const int turns = settings.steps - settings.first_step > settings.restart_interval ? 2 : 1;
  const auto resident = [&](int blocks) { return resident_replay_teams(plan.fronts, blocks); };
  if (settings.team_blocks > 0)
    stages = {{settings.team_blocks, std::min(count, resident(settings.team_blocks)), 0}};
  else
    stages = team_stages(count, turns, launches_clusters() ? most_team_blocks : 1, resident);
  require(!stages.empty() && stages.front().teams > 0, "the sheet is too large for the device");
  for (const TeamStage& stage : stages) {
    stage_fronts.push_back(plan.shared_out(front_plan, stage.blocks));
    plan.fronts.vector_size = std::max(plan.fronts.vector_size, stage_fronts.back().vector_size);
    teams = std::max(teams, stage.teams);
  }
  team_blocks = stages.front().blocks;
}

void ReplayMemory::lay_out_teams(const TeamSizes& sizes) {
  DeviceArena counting(nullptr);
  lay_out_team(sizes, counting);
  const std::size_t bytes = counting.used();
  arena = DeviceArray<char>(static_cast<std::size_t>(teams) * bytes);
  std::vector<TeamMemory> all;
  const std::vector<int> none(size(), -1);
  for (int t = 0; t < teams; ++t) {
    DeviceArena own(arena.data() + static_cast<std::size_t>(t) * bytes);
    all.push_back(lay_out_team(sizes, own));
    copy_to_end(all.back().restriction_of, none.data(), none.size() * sizeof(int), cudaMemcpyHostToDevice);
  }
  team_memory = DeviceArray<TeamMemory>(all);
}

void ReplayMemory::keep_start(const std::vector<ReplayEnvironment>& environments) {
  if (settings.kept_steps.empty() || settings.kept_steps.front() != settings.first_step) return;
  for (std::size_t e = 0; e < environments.size(); ++e)
    kept.write(e * settings.kept_steps.size() * 3 * size(), environments[e].positions.data(), 3 * size());
}

void ReplayMemory::advance(int more) {
  require(more >= 0 && more <= settings.steps - step, "it cannot advance beyond its last step");
  if (more == 0) return;
  const int end = step + more;
  wait();
  const std::vector<int> stand(static_cast<std::size_t>(count), step);
  steps.write(0, stand.data(), stand.size());
  work.write(0, std::vector<int>(stand.size(), 0).data(), stand.size());
  unfinished.write(0, &count, 1);
  if (projection)
    projection->run(step, end, stream);
  else
    run_stages(end);
  step = end;
}

void ReplayMemory::run_stages(int end) const {
  for (std::size_t k = 0; k < stages.size(); ++k) {
    const TeamStage& stage = stages[k];
    ReplayNumbers own = numbers;
    own.fronts = stage_fronts[k];
    own.waiting.begin = step;
    own.waiting.end = end;
    own.waiting.leave_at = stage.leave_at;
    place_on_chip(own, stage.blocks);
    run_replay(own, stage.teams, stage.blocks, stream);
  }
}

Points ReplayMemory::points(const DeviceArray<Point>& array, std::size_t part) const {
  wait();
  Points result(layout.size, 3);
  put_points(array.read(part * size(), size()).data(), layout.order, result);
  return result;
}

std::vector<ReplayStep> steps_of(std::span<const ReplayStats> stats) {
  std::vector<ReplayStep> steps;
  for (const ReplayStats& s : stats)
    steps.push_back(
        {s.residual, s.penetration, s.iterations, s.solves, s.factorizations, s.substeps, s.converged != 0});
  return steps;
}

void put_points(const Point* points, const std::vector<int>& order, Eigen::Ref<Points> to) {
  for (std::size_t i = 0; i < order.size(); ++i) to.row(order[i]) << points[i].x, points[i].y, points[i].z;
}

}  // namespace flash::sim::cuda
