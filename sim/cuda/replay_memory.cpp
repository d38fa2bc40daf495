#include "sim/cuda/replay_memory.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "sim/cuda/device_arena.h"
#include "sim/cuda/replay_checks.h"
#include "sim/cuda/replay_kernel.h"
#include "sim/cuda/replay_records.h"

namespace flash::sim::cuda {

using data::Points;

namespace {

std::size_t most_obstacles_of(const std::vector<ReplayEnvironment>& environments) {
  std::size_t most = 0;
  for (const ReplayEnvironment& e : environments) most = std::max(most, e.obstacles.size());
  return most;
}

}  // namespace

ReplayMemory::ReplayMemory(std::shared_ptr<const SheetPlan> sheet,
                           const std::vector<ReplayEnvironment>& environments, ReplaySettings replay_settings)
    : settings(std::move(replay_settings)),
      count(static_cast<int>(environments.size())),
      most_obstacles_each(static_cast<int>(most_obstacles_of(environments))),
      front_plan(plan_fronts(sheet->pattern, sheet->sheet.rest.vertices, fitting_fronts(settings.fronts))),
      layout(lay_out(*sheet, bending_operator(*sheet, environments.front().material), front_plan)),
      plan(front_plan, layout),
      tables(count, layout.size, environments.front().hold_count, most_obstacles_each),
      sheet_(std::move(sheet)),
      bendings_(environments.size()),
      plan_bending_(&bending_operator(*sheet_, environments.front().material)) {
  plan_teams();
  upload(environments);
  lay_out_teams();
  set_numbers(environments.front());
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
}

ReplayMemory::~ReplayMemory() {
  cudaFreeHost(stop);
  if (stream != nullptr) cudaStreamDestroy(stream);
}

std::size_t ReplayMemory::size() const { return layout.order.size(); }

void ReplayMemory::wait(const std::atomic<bool>* asked) const {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds pause(1);
  use_device(device);
  // A single step may take less than a pause.
  const auto begin = Clock::now();
  while (asked != nullptr && !*asked && cudaStreamQuery(stream) == cudaErrorNotReady)
    if (Clock::now() - begin > pause) std::this_thread::sleep_for(pause);
  if (asked != nullptr && *asked) *stop = 1;
  check(cudaStreamSynchronize(stream));
}

void ReplayMemory::set_numbers(const ReplayEnvironment& first) {
  check(cudaMallocHost(&stop, sizeof(int)));
  *stop = 0;
  numbers.fronts = plan.fronts;
  numbers.sheet = plan.sheet;
  numbers.sheets = sheets.data();
  numbers.teams = team_memory.data();
  numbers.solvers = solvers.data();
  numbers.factors = factors.data();
  numbers.factor_numbers = solve_tile_numbers * static_cast<long>(plan.fronts.factor_tiles);
  numbers.waiting.stop = stop;
  numbers.time_step = settings.time_step;
  numbers.tolerance = settings.tolerance;
  numbers.lost_residual = settings.lost_residual;
  numbers.max_iterations = settings.max_iterations;
  numbers.stale_factor_solves = settings.stale_factor_solves;
  numbers.halvings = settings.halvings;
  numbers.restart_interval = settings.restart_interval;
  numbers.materials = materials.data();
  numbers.obstacles = obstacles.data();
  numbers.most_obstacles_each = most_obstacles_each;
  numbers.exit_speed = settings.exit_speed;
  numbers.states = {positions.data(), velocities.data(), bristles.data()};
  numbers.hold_count = first.hold_count;
  numbers.order = order.data();
}

void ReplayMemory::upload(const std::vector<ReplayEnvironment>& environments) {
  const std::size_t vertices = size(), layers = static_cast<std::size_t>(most_obstacles_each),
                    all = environments.size() * vertices;
  std::vector<Point> x(all), v(all), b(all * layers);
  std::vector<ReplayMaterial> own_materials;
  std::vector<PlacedObstacle> placed;
  std::vector<SheetTables> own_sheets;
  for (std::size_t e = 0; e < environments.size(); ++e) {
    const ReplayEnvironment& own = environments[e];
    put_in_order(own.positions, 0, layout.order, x.data() + e * vertices);
    put_in_order(own.velocities, 0, layout.order, v.data() + e * vertices);
    put_bristles(own.bristles, b.data() + e * layers * vertices);
    own_materials.push_back(material_of(*sheet_, own));
    own_sheets.push_back(with_bending_of(own.material, static_cast<int>(e)));
    const std::vector<PlacedObstacle> of_own = placed_obstacles(own);
    placed.insert(placed.end(), of_own.begin(), of_own.end());
    placed.resize((e + 1) * layers);
    obstacle_counts.push_back(static_cast<int>(own.obstacles.size()));
  }
  order = DeviceArray<int>(layout.order);
  positions = DeviceArray<Point>(x);
  velocities = DeviceArray<Point>(v);
  bristles = DeviceArray<Point>(b);
  materials = DeviceArray<ReplayMaterial>(own_materials);
  obstacles = DeviceArray<PlacedObstacle>(placed);
  sheets = DeviceArray<SheetTables>(own_sheets);
  solvers = DeviceArray<SolverState>(std::vector<SolverState>(environments.size(), no_solver));
  factors = DeviceArray<__half>(environments.size() * solve_tile_numbers *
                                static_cast<std::size_t>(plan.fronts.factor_tiles));
  for (std::size_t e = 0; e < environments.size(); ++e) {
    write_loads(environments[e], e);
    write_stiffness(environments[e].stiffness, e);
  }
}

void ReplayMemory::put_bristles(const Points& own, Point* to) const {
  for (int k = 0; k < most_obstacles_each; ++k)
    put_in_order(own, static_cast<Eigen::Index>(k) * layout.size, layout.order,
                 to + static_cast<std::size_t>(k) * size());
}

void ReplayMemory::write_state(int environment, const Points& x, const Points& v,
                               const Points& own_bristles) {
  use_device(device);
  const std::size_t vertices = size(), e = static_cast<std::size_t>(environment),
                    layers = static_cast<std::size_t>(most_obstacles_each);
  std::vector<Point> points(vertices), layered(layers * vertices);
  put_in_order(x, 0, layout.order, points.data());
  positions.write(e * vertices, points.data(), vertices);
  put_bristles(own_bristles, layered.data());
  bristles.write(e * layers * vertices, layered.data(), layered.size());
  write_velocities(environment, v);
  forget_solver(environment);
}

void ReplayMemory::write_velocities(int environment, const Points& v) {
  use_device(device);
  std::vector<Point> points(size());
  put_in_order(v, 0, layout.order, points.data());
  velocities.write(static_cast<std::size_t>(environment) * size(), points.data(), size());
}

SheetTables ReplayMemory::with_bending_of(const data::SheetMaterial& material, int environment) {
  std::shared_ptr<const DeviceBending>& bending = bendings_[static_cast<std::size_t>(environment)];
  bending.reset();
  const BendingOperator& asked = bending_operator(*sheet_, material);
  if (&asked == plan_bending_) return plan.sheet;
  std::weak_ptr<const DeviceBending>& shared = shared_bendings_[&asked];
  bending = shared.lock();
  if (bending == nullptr)
    shared = bending = std::make_shared<const DeviceBending>(lay_out_bending(*sheet_, asked, front_plan));
  return bending->in(plan.sheet);
}

void ReplayMemory::write_environment(const ReplayEnvironment& environment, int number) {
  use_device(device);
  const auto e = static_cast<std::size_t>(number);
  const ReplayMaterial material = material_of(*sheet_, environment);
  materials.write(e, &material, 1);
  const std::vector<PlacedObstacle> placed = placed_obstacles(environment);
  obstacles.write(e * static_cast<std::size_t>(most_obstacles_each), placed.data(), placed.size());
  obstacle_counts[e] = static_cast<int>(placed.size());
  const SheetTables own = with_bending_of(environment.material, number);
  sheets.write(e, &own, 1);
  write_loads(environment, e);
  write_stiffness(environment.stiffness, e);
  forget_solver(number);
}

void ReplayMemory::write_loads(const ReplayEnvironment& environment, std::size_t number) {
  if (environment.loads.empty() && loads.size() == 0) return;
  loads.hold(positions.size());
  numbers.loads = loads.data();
  Points sums = Points::Zero(layout.size, 3);
  for (const Load& load : environment.loads) sums.row(load.vertex) += load.force.transpose();
  std::vector<Point> points(size());
  put_in_order(sums, 0, layout.order, points.data());
  loads.write(number * size(), points.data(), size());
}

void ReplayMemory::write_stiffness(const std::vector<double>& own, std::size_t number) {
  const auto each = static_cast<std::size_t>(numbers.stiffness_each);
  if (own.size() > each) {
    const std::vector<double> before = stiffness.read(0, stiffness.size());
    std::vector<double> grown(own.size() * static_cast<std::size_t>(count));
    for (std::size_t k = 0; k < before.size(); ++k) grown[k / each * own.size() + k % each] = before[k];
    stiffness = DeviceArray<double>(grown);
    numbers.stiffness = stiffness.data();
    numbers.stiffness_each = static_cast<int>(own.size());
  }
  stiffness.write(number * static_cast<std::size_t>(numbers.stiffness_each), own.data(), own.size());
}

void ReplayMemory::forget_solver(int environment) {
  use_device(device);
  solvers.write(static_cast<std::size_t>(environment), &no_solver, 1);
}

template <typename Act>
void ReplayMemory::for_state(int environment, const Act& act) const {
  const auto e = static_cast<std::size_t>(environment);
  const std::size_t vertices = size(), layers = static_cast<std::size_t>(most_obstacles_each);
  const auto part = [&](auto* all, std::size_t each, std::size_t used) {
    act(reinterpret_cast<char*>(all + e * each), used * sizeof(*all));
  };
  part(positions.data(), vertices, vertices);
  part(velocities.data(), vertices, vertices);
  part(bristles.data(), layers * vertices, static_cast<std::size_t>(obstacle_counts[e]) * vertices);
  part(solvers.data(), 1, 1);
  const auto factor = static_cast<std::size_t>(numbers.factor_numbers);
  part(factors.data(), factor, factor);
}

std::vector<char> ReplayMemory::save(int environment) const {
  use_device(device);
  std::vector<char> saved;
  for_state(environment, [&](const char* from, std::size_t bytes) {
    if (bytes == 0) return;
    const std::size_t at = saved.size();
    saved.resize(at + bytes);
    copy_to_end(saved.data() + at, from, bytes, cudaMemcpyDeviceToHost);
  });
  return saved;
}

void ReplayMemory::load(int environment, const std::vector<char>& saved) {
  use_device(device);
  std::size_t expected = 0, at = 0;
  for_state(environment, [&](const char*, std::size_t bytes) { expected += bytes; });
  require(saved.size() == expected, "what was saved is of another mesh or has other obstacles");
  for_state(environment, [&](char* to, std::size_t bytes) {
    if (bytes > 0) copy_to_end(to, saved.data() + at, bytes, cudaMemcpyHostToDevice);
    at += bytes;
  });
}

std::vector<TeamStage> ReplayMemory::stages_for(int environments, int steps) const {
  const auto resident = [&](int blocks) { return resident_.at(blocks); };
  if (const int blocks = settings.team_blocks; blocks > 0)
    return {{blocks, std::min(environments, resident(blocks)), 0}};
  const int most_blocks = resident_.rbegin()->first;
  if (steps > turn_steps) return team_stages(environments, most_blocks, resident);
  TeamStage stage = one_turn_stage(environments, steps, most_blocks, resident);
  if (teams > 0) stage.teams = std::min(stage.teams, teams);  // those that have memory
  return {stage};
}

void ReplayMemory::plan_teams() {
  const int most_blocks = launches_clusters() ? most_team_blocks : 1;
  for (int blocks = 1; blocks <= most_blocks; blocks *= 2) {
    if (settings.team_blocks > 0 && blocks != settings.team_blocks) continue;
    resident_[blocks] = resident_replay_teams(plan.fronts, blocks);
    fronts_[blocks] = plan.shared_out(front_plan, blocks);
  }
  require(!resident_.empty(), "the device has no teams of several blocks");
  for (const auto& [blocks, fronts] : fronts_)
    plan.fronts.vector_size = std::max(plan.fronts.vector_size, fronts.vector_size);
  for (const int steps : {turn_steps, turn_steps + 1}) {
    const std::vector<TeamStage> stages = stages_for(count, steps);
    require(!stages.empty() && stages.front().teams > 0, "the sheet is too large for the device");
    for (const TeamStage& stage : stages) teams = std::max(teams, stage.teams);
    team_blocks = stages.front().blocks;
  }
}

void ReplayMemory::lay_out_teams() {
  const TeamSizes sizes = {plan.fronts, layout, static_cast<int>(sheet_->hinges.size()), most_obstacles_each};
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

void ReplayMemory::open(const StepPlan& steps) {
  use_device(device);
  tables.open(steps, stream);
  tables.put(numbers);
}

void ReplayMemory::keep_start(const std::vector<ReplayEnvironment>& environments) {
  if (settings.kept_steps.empty() || settings.kept_steps.front() != settings.first_step) return;
  for (int e = 0; e < count; ++e)
    copy_to_end(numbers.kept + static_cast<std::size_t>(e) * settings.kept_steps.size() * 3 * size(),
                environments[static_cast<std::size_t>(e)].positions.data(), 3 * size() * sizeof(double),
                cudaMemcpyHostToDevice);
}

void ReplayMemory::run(const StepPlan& steps) {
  open(steps);
  int environments = 0;
  for (std::size_t e = 0; e < steps.begins.size(); ++e)
    environments += steps.begins[e] < steps.ends[e] ? 1 : 0;
  launch_steps(environments, steps.most_steps());
}

void ReplayMemory::go_on(int begin, int end) {
  tables.queue(begin, end, stream);
  launch_steps(count, end - begin);
}

void ReplayMemory::launch_steps(int environments, int steps) {
  for (const TeamStage& stage : stages_for(environments, steps)) {
    ReplayNumbers own = numbers;
    own.fronts = fronts_.at(stage.blocks);
    own.waiting.leave_at = stage.leave_at;
    place_on_chip(own, stage.blocks);
    run_replay(own, stage.teams, stage.blocks, stream);
  }
}

std::vector<double> ReplayMemory::phase_ticks() const {
  wait();
  std::vector<double> ticks(replay_phases, 0.0);
  for (const TeamMemory& team : team_memory.read(0, team_memory.size())) {
    long long clocks[replay_phases];
    copy_to_end(clocks, team.clocks, sizeof(clocks), cudaMemcpyDeviceToHost);
    for (int k = 0; k < replay_phases; ++k)
      ticks[static_cast<std::size_t>(k)] += static_cast<double>(clocks[k]);
  }
  return ticks;
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

}  // namespace flash::sim::cuda
