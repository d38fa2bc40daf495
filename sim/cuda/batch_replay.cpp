#include "sim/cuda/batch_replay.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>

#include "sim/cuda/device_arena.h"
#include "sim/cuda/device_plan.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/flat_motions.h"
#include "sim/cuda/layout/team_stages.h"
#include "sim/cuda/pinned_array.h"
#include "sim/cuda/projective_replay.h"
#include "sim/cuda/replay_kernel.h"
#include "sim/cuda/team_memory.h"
#include "sim/law/membrane.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim::cuda {

using data::Points;

namespace {

constexpr int most_halvings = 16;

void require(bool met, const char* what) {
  if (!met) throw std::invalid_argument(std::string("replay: ") + what);
}

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

void check(const SheetPlan& plan, const std::vector<ReplayEnvironment>& environments,
           const ReplaySettings& settings) {
  require(settings.first_step >= 0 && settings.steps >= settings.first_step,
          "the steps have to ascend from first_step to steps");
  require(settings.restart_interval > 0, "restart_interval has to be positive");
  require(settings.team_blocks >= 0 && settings.team_blocks <= most_team_blocks &&
              (settings.team_blocks & (settings.team_blocks - 1)) == 0,
          "team_blocks have to be 0, 1, 2, 4 or 8");
  require(settings.halvings >= 0 && settings.halvings <= most_halvings,
          "halvings have to lie between 0 and 16");
  const std::vector<int>& kept = settings.kept_steps;
  require(std::adjacent_find(kept.begin(), kept.end(), std::greater_equal<>()) == kept.end(),
          "kept_steps have to ascend");
  require(kept.empty() || (kept.front() >= settings.first_step && kept.back() <= settings.steps),
          "kept_steps have to lie between first_step and steps");
  const int size = plan.pattern.size;
  for (const ReplayEnvironment& e : environments) {
    require(e.positions.rows() == size && e.velocities.rows() == size,
            "every environment needs a position and a velocity for each vertex");
    require(e.bristles.rows() == 0 || e.bristles.rows() == size * std::ssize(e.obstacles),
            "bristles for each vertex on each obstacle, or none");
    require(e.holds == nullptr || std::ssize(*e.holds) >= settings.steps - settings.first_step,
            "what is held has to be given for each step");
    require(e.hold_count == environments.front().hold_count, "all environments need as many holds");
    require(e.obstacles.size() <= most_obstacles, "an environment may have 8 obstacles");
    for (const Obstacle& obstacle : e.obstacles)
      require(obstacle.frame == base_frame || (e.schedule != nullptr && obstacle.frame >= 0 &&
                                               obstacle.frame < std::ssize(e.schedule->frames)),
              "an obstacle names a frame that the schedule does not have");
    for (const Load& load : e.loads) require(load.vertex >= 0 && load.vertex < size, "a load's vertex");
  }
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

std::vector<ReplayStep> steps_of(std::span<const ReplayStats> stats) {
  std::vector<ReplayStep> steps;
  for (const ReplayStats& s : stats)
    steps.push_back(
        {s.residual, s.penetration, s.iterations, s.solves, s.factorizations, s.substeps, s.converged != 0});
  return steps;
}

/// `points`: by order of elimination, which `order` has the vertices of.
void put_points(const Point* points, const std::vector<int>& order, Eigen::Ref<Points> to) {
  for (std::size_t i = 0; i < order.size(); ++i) to.row(order[i]) << points[i].x, points[i].y, points[i].z;
}

}  // namespace

struct BatchReplay::Memory {
  ReplaySettings settings;
  int device = device_in_use();
  int count, step;
  FrontPlan front_plan;
  SheetLayout layout;
  DevicePlan plan;
  cudaStream_t stream = nullptr;
  int* stop = nullptr;  ///< of the host, read by the device

  std::vector<int> obstacle_counts;  ///< of each environment
  DeviceArray<ReplayMaterial> materials;
  DeviceArray<Point> positions, velocities, bristles, loads;
  DeviceArray<int> hold_starts, kept_index, order, steps, work, unfinished;
  DeviceArray<HeldPlace> holds;
  DeviceArray<PlacedObstacle> obstacles;
  DeviceArray<FramePose> poses;
  DeviceArray<ReplayStats> stats;
  DeviceArray<double> kept, hold_forces;
  DeviceArray<char> arena;
  DeviceArray<TeamMemory> team_memory;
  int teams = 0, team_blocks = 1;  ///< at first
  ReplayNumbers numbers{};
  std::vector<TeamStage> stages;
  std::vector<FrontTables> stage_fronts;
  std::unique_ptr<ProjectiveReplay> projection;  ///< of the projective method

  Memory(const SheetPlan& sheet, const std::vector<ReplayEnvironment>& environments,
         ReplaySettings replay_settings)
      : settings(std::move(replay_settings)),
        count(static_cast<int>(environments.size())),
        step(settings.first_step),
        front_plan(plan_fronts(sheet.pattern, sheet.sheet.rest.vertices, fitting_fronts(settings.fronts))),
        layout(lay_out(sheet, common_bending(sheet, environments), front_plan)),
        plan(front_plan, layout) {
    upload_state(environments);
    const int most_held = upload_motions(sheet, environments);
    const int all_steps = settings.steps - settings.first_step;
    stats = DeviceArray<ReplayStats>(static_cast<std::size_t>(all_steps) * environments.size());
    upload_kept_steps();
    const bool damped = std::any_of(environments.begin(), environments.end(),
                                    [](const auto& e) { return e.material.stiffness_damping != 0; });
    const int most_obstacles_each = upload_obstacles(environments);
    upload_bristles(environments, most_obstacles_each);
    if (!settings.projective) {
      plan_stages();
      lay_out_teams({plan.fronts, layout, damped, most_held, most_obstacles_each});
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
  ~Memory() {
    cudaFreeHost(stop);
    if (stream != nullptr) cudaStreamDestroy(stream);
  }

  std::size_t size() const { return layout.order.size(); }

  /// For what is queued; whoever comes next on this thread works with the device.
  void wait() const {
    use_device(device);
    check(cudaStreamSynchronize(stream));
  }

  void upload_state(const std::vector<ReplayEnvironment>& environments) {
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

  /// Each environment has room for `most_obstacles_each`.
  void upload_bristles(const std::vector<ReplayEnvironment>& environments, int most_obstacles_each) {
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

  /// Returns how many vertices are held at once at most.
  int upload_motions(const SheetPlan& sheet, const std::vector<ReplayEnvironment>& environments) {
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
    return flat.most;
  }

  /// Returns how many obstacles an environment has at most.
  int upload_obstacles(const std::vector<ReplayEnvironment>& environments) {
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

  void upload_kept_steps() {
    const int all_steps = settings.steps - settings.first_step;
    std::vector<int> index(static_cast<std::size_t>(all_steps), -1);
    for (std::size_t k = 0; k < settings.kept_steps.size(); ++k)
      if (settings.kept_steps[k] > settings.first_step)
        index[static_cast<std::size_t>(settings.kept_steps[k] - settings.first_step - 1)] =
            static_cast<int>(k);
    kept_index = DeviceArray<int>(index);
    kept = DeviceArray<double>(static_cast<std::size_t>(count) * settings.kept_steps.size() * 3 * size());
  }

  /// Where an environment has but one turn with a team, none waits for a second one.
  void plan_stages() {
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

  void lay_out_teams(const TeamSizes& sizes) {
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

  void keep_start(const std::vector<ReplayEnvironment>& environments) {
    if (settings.kept_steps.empty() || settings.kept_steps.front() != settings.first_step) return;
    for (std::size_t e = 0; e < environments.size(); ++e)
      kept.write(e * settings.kept_steps.size() * 3 * size(), environments[e].positions.data(), 3 * size());
  }

  void advance(int more) {
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

  void run_stages(int end) const {
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

  /// A part of an array with a point for each vertex.
  Points points(const DeviceArray<Point>& array, std::size_t part) const {
    wait();
    Points result(layout.size, 3);
    put_points(array.read(part * size(), size()).data(), layout.order, result);
    return result;
  }
};

BatchReplay::BatchReplay(std::shared_ptr<const SheetPlan> plan,
                         const std::vector<ReplayEnvironment>& environments, ReplaySettings settings) {
  check(*plan, environments, settings);
  memory_ = std::make_unique<Memory>(*plan, environments, std::move(settings));
}
BatchReplay::~BatchReplay() = default;
BatchReplay::BatchReplay(BatchReplay&&) noexcept = default;

int BatchReplay::size() const { return memory_->count; }
int BatchReplay::step() const { return memory_->step; }
int BatchReplay::teams() const { return memory_->teams; }
int BatchReplay::team_blocks() const { return memory_->team_blocks; }
void BatchReplay::advance(int steps) { memory_->advance(steps); }
void BatchReplay::synchronize(const std::atomic<bool>* stop) {
  const Memory& m = *memory_;
  while (stop != nullptr && !*stop && cudaStreamQuery(m.stream) == cudaErrorNotReady)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (stop != nullptr && *stop) *m.stop = 1;
  m.wait();
}

Points BatchReplay::positions(int environment) const {
  return memory_->points(memory_->positions, static_cast<std::size_t>(environment));
}
Points BatchReplay::velocities(int environment) const {
  return memory_->points(memory_->velocities, static_cast<std::size_t>(environment));
}
Points BatchReplay::bristles(int environment) const {
  const Memory& m = *memory_;
  const int obstacles = m.obstacle_counts[static_cast<std::size_t>(environment)];
  Points all(static_cast<Eigen::Index>(obstacles) * m.layout.size, 3);
  for (int k = 0; k < obstacles; ++k)
    all.middleRows(static_cast<Eigen::Index>(k) * m.layout.size, m.layout.size) =
        m.points(m.bristles, static_cast<std::size_t>(environment) * m.numbers.most_obstacles_each +
                                 static_cast<std::size_t>(k));
  return all;
}

Points BatchReplay::kept_positions(int environment, int index) const {
  const Memory& m = *memory_;
  m.wait();
  const std::size_t place =
      static_cast<std::size_t>(environment) * m.settings.kept_steps.size() + static_cast<std::size_t>(index);
  Points positions(m.layout.size, 3);
  m.kept.read(place * 3 * m.size(), 3 * m.size(), positions.data());
  return positions;
}

std::vector<double> BatchReplay::hold_forces(int environment) const {
  const Memory& m = *memory_;
  m.wait();
  const std::size_t each =
      3 * static_cast<std::size_t>(m.numbers.stats_each) * static_cast<std::size_t>(m.numbers.hold_count);
  return m.hold_forces.read(static_cast<std::size_t>(environment) * each, each);
}

std::vector<double> BatchReplay::phase_ticks() const {
  const Memory& m = *memory_;
  m.wait();
  if (m.projection) return m.projection->phase_ticks();
  std::vector<double> ticks(replay_phases, 0.0);
  for (const TeamMemory& team : m.team_memory.read(0, m.team_memory.size())) {
    long long clocks[replay_phases];
    copy_to_end(clocks, team.clocks, sizeof(clocks), cudaMemcpyDeviceToHost);
    for (int k = 0; k < replay_phases; ++k)
      ticks[static_cast<std::size_t>(k)] += static_cast<double>(clocks[k]);
  }
  return ticks;
}

std::vector<ReplayStep> BatchReplay::stats(int environment) const {
  const Memory& m = *memory_;
  m.wait();
  const auto each = static_cast<std::size_t>(m.numbers.stats_each);
  return steps_of(m.stats.read(static_cast<std::size_t>(environment) * each, each));
}

/// Where numbers of one environment stand on the host.
struct ReplayReader::Memory {
  /// Environments of which so many are read sooner than memory is pinned.
  static constexpr int few = 256;

  const BatchReplay::Memory& replay;
  std::size_t steps, holds, vertices, kept_steps, obstacles;
  std::optional<PinnedArray<Point>> pinned;
  std::vector<Point> pageable;
  Point* points = nullptr;  ///< positions, velocities and bristles
  ReplayStats* stats = nullptr;
  double *forces = nullptr, *kept = nullptr;

  explicit Memory(const BatchReplay::Memory& of)
      : replay(of),
        steps(static_cast<std::size_t>(of.numbers.stats_each)),
        holds(static_cast<std::size_t>(of.numbers.hold_count)),
        vertices(of.size()),
        kept_steps(of.settings.kept_steps.size()),
        obstacles(static_cast<std::size_t>(of.numbers.most_obstacles_each)) {
    const std::size_t size = lay_out(nullptr) / sizeof(Point) + 1;
    if (of.count > few)
      pinned.emplace(size);
    else
      pageable.resize(size);
    lay_out(reinterpret_cast<char*>(pinned ? pinned->data() : pageable.data()));
  }

  /// Returns the bytes that it takes.
  std::size_t lay_out(char* begin) {
    DeviceArena arena(begin);
    points = arena.take<Point>((2 + obstacles) * vertices);
    stats = arena.take<ReplayStats>(steps);
    forces = arena.take<double>(3 * steps * holds);
    kept = arena.take<double>(3 * kept_steps * vertices);
    return arena.used();
  }
};

ReplayReader::ReplayReader(const BatchReplay& replay)
    : memory_((replay.memory_->wait(), std::make_unique<Memory>(*replay.memory_))) {}
ReplayReader::~ReplayReader() = default;

ReplayResult ReplayReader::read(int environment, double* kept) {
  Memory& m = *memory_;
  const BatchReplay::Memory& replay = m.replay;
  use_device(replay.device);
  const auto e = static_cast<std::size_t>(environment);
  const auto fetch = [e](const auto& array, std::size_t each, auto* to) {
    if (each > 0)
      check(cudaMemcpyAsync(to, array.data() + e * each, each * sizeof(*to), cudaMemcpyDeviceToHost,
                            cudaStreamPerThread));
  };
  fetch(replay.stats, m.steps, m.stats);
  fetch(replay.hold_forces, 3 * m.steps * m.holds, m.forces);
  fetch(replay.kept, 3 * m.kept_steps * m.vertices, m.kept);
  fetch(replay.positions, m.vertices, m.points);
  fetch(replay.velocities, m.vertices, m.points + m.vertices);
  fetch(replay.bristles, m.obstacles * m.vertices, m.points + 2 * m.vertices);
  check(cudaStreamSynchronize(cudaStreamPerThread));

  ReplayResult result;
  result.stats = steps_of({m.stats, m.steps});
  result.hold_forces.assign(m.forces, m.forces + 3 * m.steps * m.holds);
  std::copy(m.kept, m.kept + 3 * m.kept_steps * m.vertices, kept);
  const auto size = static_cast<Eigen::Index>(m.vertices);
  result.positions.resize(size, 3);
  result.velocities.resize(size, 3);
  result.bristles.resize(replay.obstacle_counts[e] * size, 3);
  const std::vector<int>& order = replay.layout.order;
  put_points(m.points, order, result.positions);
  put_points(m.points + m.vertices, order, result.velocities);
  for (int k = 0; k < replay.obstacle_counts[e]; ++k)
    put_points(m.points + (2 + static_cast<std::size_t>(k)) * m.vertices, order,
               result.bristles.middleRows(k * size, size));
  return result;
}

}  // namespace flash::sim::cuda
