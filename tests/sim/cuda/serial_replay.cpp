#include "tests/sim/cuda/serial_replay.h"

#include <cstring>

#include "sim/cuda/environment_steps.cuh"
#include "sim/cuda/flat_motions.h"
#include "sim/cuda/layout/front_plan.h"
#include "sim/cuda/layout/sheet_layout.h"
#include "sim/cuda/layout_tables.h"
#include "sim/cuda/replay_checks.h"
#include "sim/cuda/replay_records.h"
#include "sim/cuda/team_memory.h"

namespace flash::sim::cuda {

using data::Points;
using Eigen::Vector3d;

namespace {

/// Blocks of memory by themselves.
class Blocks {
 public:
  /// All bits set: no number, and -1.
  template <typename Number>
  Number* take(std::size_t count) {
    if (count == 0) return nullptr;
    const std::size_t words = (count * sizeof(Number) + sizeof(Word) - 1) / sizeof(Word);
    blocks_.emplace_back(new Word[words]);
    char* bytes = reinterpret_cast<char*>(blocks_.back().get());
    std::memset(bytes, 0xff, words * sizeof(Word));
    return reinterpret_cast<Number*>(bytes);
  }
  /// Where the numbers of a vector are kept; null for none.
  template <typename Number>
  Number* keep(const std::vector<Number>& numbers) {
    Number* to = take<Number>(numbers.size());
    if (to != nullptr) std::memcpy(to, numbers.data(), numbers.size() * sizeof(Number));
    return to;
  }

 private:
  struct alignas(16) Word {
    char bytes[16];
  };
  std::vector<std::unique_ptr<Word[]>> blocks_;
};

}  // namespace

struct SerialReplay::Memory {
  ReplaySettings settings;
  FrontPlan fronts;
  SheetLayout layout;
  FlatMotions flat;
  Blocks blocks;
  TeamMemory team{};
  SheetTables sheet{};
  ReplayNumbers numbers{};
  CommonState common;
  std::vector<ReplayStats> stats;
  int obstacles, holds, step;

  Memory(const SheetPlan& plan, const ReplayEnvironment& environment, const ReplaySettings& given,
         bool on_chip)
      : settings(given),
        fronts(plan_fronts(plan.pattern, plan.sheet.rest.vertices, settings.fronts)),
        layout(lay_out(plan, bending_operator(plan, environment.material), fronts)),
        obstacles(static_cast<int>(environment.obstacles.size())),
        holds(environment.hold_count),
        step(settings.first_step) {
    check_replay(plan, {environment}, settings);
    put_layout(
        layout, [&](const auto& vector) { return blocks.keep(vector); }, sheet);
    const auto size = static_cast<std::size_t>(layout.size),
               steps = static_cast<std::size_t>(settings.steps - settings.first_step);
    ReplayNumbers& n = numbers;
    n.fronts.size = layout.size;
    n.fronts.vector_size = 6 * layout.size + 1;
    n.sheets = blocks.keep(std::vector{sheet});
    team = lay_out_team(TeamSizes{n.fronts, layout, static_cast<int>(plan.hinges.size()), obstacles}, blocks);
    std::fill(team.held_axes, team.held_axes + size, 0);
    n.teams = &team;
    n.solvers = blocks.keep(std::vector{no_solver});
    n.factors = reinterpret_cast<__half*>(
        blocks.take<double>(static_cast<std::size_t>(serial_factor_numbers(layout.size))));
    place(on_chip);

    n.time_step = settings.time_step;
    n.tolerance = settings.tolerance;
    n.lost_residual = settings.lost_residual;
    n.max_iterations = settings.max_iterations;
    n.stale_factor_solves = settings.stale_factor_solves;
    n.halvings = settings.halvings;
    n.restart_interval = settings.restart_interval;
    n.exit_speed = settings.exit_speed;
    n.materials = blocks.keep(std::vector{material_of(plan, environment)});
    n.obstacles = blocks.keep(placed_obstacles(environment));
    n.most_obstacles_each = obstacles;
    n.states = {points(environment.positions, 1), points(environment.velocities, 1),
                points(environment.bristles, obstacles)};
    if (!environment.loads.empty()) {
      Points loads = Points::Zero(layout.size, 3);
      for (const Load& load : environment.loads) loads.row(load.vertex) += load.force.transpose();
      n.loads = points(loads, 1);
    }
    n.stiffness = blocks.keep(environment.stiffness);
    n.stiffness_each = static_cast<int>(environment.stiffness.size());

    if (environment.schedule != nullptr) flat.frames = static_cast<int>(environment.schedule->frames.size());
    n.motions = blocks.keep(std::vector{flat.add(
        {environment.holds.get(), environment.springs.get(), environment.schedule.get(), environment.time},
        settings.time_step, static_cast<int>(steps), fronts.position)});
    n.waiting.begins = blocks.keep(std::vector{settings.first_step});
    n.waiting.count = 1;
    n.hold_starts = blocks.keep(flat.starts);
    n.motion_steps = static_cast<int>(steps) + 1;
    n.holds = blocks.keep(flat.holds);
    n.spring_starts = blocks.keep(flat.spring_starts);
    n.springs = blocks.keep(flat.springs);
    n.poses = blocks.keep(flat.poses);
    n.frames = flat.frames;
    stats.resize(steps);
    n.stats = stats.data();
    n.stats_each = static_cast<int>(steps);
    n.hold_count = holds;
    n.hold_forces = blocks.keep(std::vector<double>(3 * steps * static_cast<std::size_t>(holds)));
    n.obstacle_forces = blocks.keep(std::vector<double>(3 * steps * static_cast<std::size_t>(obstacles)));
    common.replay.write([&](ReplayNumbers& own) { own = numbers; });
    common.memory.write([&](TeamMemory& own) { own = team; });
  }

  /// What may be on chip, one behind the other as far as there is room.
  void place(bool on_chip) {
    ReplayNumbers& n = numbers;
    n.places_on_chip = 0;
    n.gradient_shares_at = n.solved_at = n.search_at = -1;
    if (!on_chip) return;
    const int near = gradient_memory(layout.size, true);
    n.places_on_chip = 1;
    n.gradient_shares_at = near;
    n.matrix_shares_on_chip = 1;
    n.search_at = rounded_up(linear_partial_bytes, 16);
    n.solved_at = n.search_at + static_cast<int>(sizeof(Four<float>)) * layout.size;
    const int most =
        std::max({near + gradient_share_memory(layout.triangle_count),
                  static_cast<int>(sizeof(float)) * hessian_memory_with_shares(layout.triangle_count),
                  n.solved_at + static_cast<int>(sizeof(float)) * n.fronts.vector_size});
    require(most <= static_cast<int>(serial_chip), "the sheet has no room on chip");
  }

  /// Points of each of some layers, in the order of elimination.
  Point* points(const Points& given, int layers) {
    std::vector<Point> all(static_cast<std::size_t>(layers * layout.size));
    for (int k = 0; k < layers; ++k)
      put_in_order(given, static_cast<Eigen::Index>(k) * layout.size, layout.order,
                   all.data() + static_cast<std::ptrdiff_t>(k) * layout.size);
    return blocks.keep(all);
  }

  /// Three numbers a vertex in the order of the mesh.
  template <typename Number>
  Points in_mesh_order(const Number* numbers_in_order) const {
    Points all(layout.size, 3);
    for (int i = 0; i < layout.size; ++i)
      for (int c = 0; c < 3; ++c)
        all(layout.order[static_cast<std::size_t>(i)], c) = numbers_in_order[3 * i + c];
    return all;
  }
  Points points_in_mesh_order(const Point* from) const {
    Points all(layout.size, 3);
    put_points(from, layout.order, all);
    return all;
  }

  /// act(work, step problem) with the next step begun as a whole, and w.now at `positions`.
  template <typename Act>
  auto at(const Points& positions, const Act& act) {
    Work& w = begin_work(common, 0);
    const SheetState state = w.replay.states.of(0, layout.size, obstacles);
    StepProblem& problem = begin_problem(common, w, 0, state);
    const StepMotion motion = motion_of_step(w.replay, *problem.material, 0, step);
    begin_motion(w, problem, motion);
    begin_holds(w, problem, motion, state.positions);
    problem.h = settings.time_step;
    begin_damping(w, problem);
    begin_obstacles(w, problem, motion, 0, 1);
    begin_springs(w, problem, motion, 0, 1);
    put_in_order(positions, 0, layout.order, w.now.positions);
    cuda::evaluate(w, problem, nullptr, w.now);
    const auto result = act(w, problem);
    forget_restrictions(w);
    return result;
  }
};

SerialReplay::SerialReplay(std::shared_ptr<const SheetPlan> plan, const ReplayEnvironment& environment,
                           const ReplaySettings& settings, bool on_chip)
    : memory_(std::make_unique<Memory>(*plan, environment, settings, on_chip)) {}
SerialReplay::~SerialReplay() = default;

void SerialReplay::advance(int steps) {
  Memory& m = *memory_;
  require(steps >= 0 && m.step + steps <= m.settings.steps, "it cannot advance beyond its last step");
  // As the kernel does, which begins anew at multiples of the interval.
  const int interval = m.settings.restart_interval;
  for (const int last = m.step + steps; m.step < last;) {
    const int end = interval > 0 ? std::min(last, (m.step / interval + 1) * interval) : last;
    if (cuda::advance(m.common, 0, m.step, end) < 0) return;
    m.step = end;
  }
}

Points SerialReplay::positions() const {
  return memory_->points_in_mesh_order(memory_->numbers.states.positions);
}
Points SerialReplay::velocities() const {
  return memory_->points_in_mesh_order(memory_->numbers.states.velocities);
}
Points SerialReplay::bristles() const {
  const Memory& m = *memory_;
  const Eigen::Index size = m.layout.size;
  Points all(m.obstacles * size, 3);
  for (int k = 0; k < m.obstacles; ++k)
    all.middleRows(k * size, size) = m.points_in_mesh_order(m.numbers.states.bristles + k * size);
  return all;
}

const std::vector<ReplayStats>& SerialReplay::stats() const { return memory_->stats; }

namespace {

std::vector<Vector3d> forces_of_step(const double* forces, int count, int step) {
  std::vector<Vector3d> own;
  for (int k = 0; k < count; ++k) own.emplace_back(forces + 3L * (static_cast<long>(step) * count + k));
  return own;
}

}  // namespace

std::vector<Vector3d> SerialReplay::hold_forces(int step) const {
  return forces_of_step(memory_->numbers.hold_forces, memory_->holds, step);
}
std::vector<Vector3d> SerialReplay::obstacle_forces(int step) const {
  return forces_of_step(memory_->numbers.obstacle_forces, memory_->obstacles, step);
}

SerialIterate SerialReplay::evaluate(const Points& positions) {
  const Memory& m = *memory_;
  return memory_->at(positions, [&](const Work& w, const StepProblem& step) {
    const Iterate& now = w.now;
    return SerialIterate{m.in_mesh_order(now.force),
                         m.in_mesh_order(now.residuals),
                         now.potential,
                         now.elastic,
                         now.friction,
                         now.residual,
                         balanced(step, now, w.replay.tolerance)};
  });
}

Points SerialReplay::matrix_product(const Points& positions, bool positive, const Points& x) {
  const Memory& m = *memory_;
  return memory_->at(positions, [&](const Work& w, const StepProblem& step) {
    assemble_matrix(w, step, positive);
    const LinearWork own = linear_work(w, step);
    const LinearVectors& v = own.vectors;
    for (int i = 0; i < m.layout.size; ++i) {
      const auto row = x.row(m.layout.order[static_cast<std::size_t>(i)]).cast<float>();
      v.near[i] = {row[0], row[1], row[2], 0};
    }
    StepsOnTheirWay<float> steps(w.replay.sheet, w.replay.sheet.single_step_values, v.step_ring);
    multiply(w.replay.sheet, own.problem.block_rows, own.problem.rigidity, own.problem.hinges, steps, v.near,
             v.image, own.partial);
    return m.in_mesh_order(v.image);
  });
}

Points SerialReplay::factor_solve(const Points& positions, const Points& b) {
  const Memory& m = *memory_;
  return memory_->at(positions, [&](const Work& w, StepProblem& step) {
    require(cuda::factorize(w, step), "a matrix that is not positive");
    const LinearWork own = linear_work(w, step);
    float* solved = own.vectors.solved + 3L * m.layout.size;
    for (int i = 0; i < m.layout.size; ++i)
      for (int c = 0; c < 3; ++c)
        solved[3 * i + c] = static_cast<float>(b(m.layout.order[static_cast<std::size_t>(i)], c));
    solve<half_parts>(w.replay.fronts, own.problem.factor, own.vectors, own.chip);
    return m.in_mesh_order(solved);
  });
}

}  // namespace flash::sim::cuda
