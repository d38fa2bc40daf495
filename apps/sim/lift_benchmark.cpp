#include "apps/sim/lift_benchmark.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/procedural_mesh.h"
#include "data/numbers/worst.h"
#include "sim/batch.h"
#include "sim/cpu/block_cholesky.h"
#include "sim/cuda/layout/step_cost.h"
#include "sim/cuda/most_vertices.h"
#include "sim/step/elastic_energy.h"

namespace flash::sim {
namespace {

constexpr double side = 0.4;  // [m]
constexpr int environments_at_once = 1024;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Radical inverse: with i / n the points of a Hammersley set, which spreads any number of materials evenly.
double radical_inverse(int i) {
  double value = 0;
  for (double digit = 0.5; i > 0; i /= 2, digit *= 0.5) value += digit * (i % 2);
  return value;
}

double between(double low, double high, double share) { return low * std::pow(high / low, share); }

// Up by 0.35 m and inwards by 0.1 m in 3 s, without jerks.
data::Trajectory lift_of(const Eigen::Vector3d& corner) {
  data::Trajectory trajectory;
  for (int k = 0; k <= 300; ++k) {
    const double t = k / 300.0, s = t * t * t * (10 - 15 * t + 6 * t * t);
    trajectory.times.push_back(3.0 * t);
    trajectory.poses.push_back(
        Eigen::Isometry3d(Eigen::Translation3d(corner + s * Eigen::Vector3d(-0.1, -0.1, 0.35))));
  }
  return trajectory;
}

data::SheetMaterial lift_material(const LiftBenchmark& benchmark, int index) {
  data::SheetMaterial material;
  material.membrane_stiffness = between(benchmark.membrane_stiffness_min, benchmark.membrane_stiffness_max,
                                        (index + 0.5) / benchmark.environments);
  material.bending_rigidity =
      between(benchmark.bending_rigidity_min, benchmark.bending_rigidity_max, radical_inverse(index));
  material.poissons_ratio = benchmark.poissons_ratio;
  material.areal_density = benchmark.areal_density;
  material.friction = benchmark.friction;
  if (benchmark.projective) material.bending_model = data::BendingModel::isometric;
  return material;
}

ProjectiveSettings published_budget(const LiftBenchmark& benchmark) {
  ProjectiveSettings settings;
  settings.time_step = benchmark.time_step;
  settings.iterations = 5;
  settings.tolerance = benchmark.tolerance;
  settings.acceleration = 0;
  settings.metric = ContactMetric::inertia;
  settings.constraints.iterations = 10;
  settings.constraints.tolerance = 1e-9;
  return settings;
}

Environment lift_environment(const LiftBenchmark& benchmark, const Sheet& sheet,
                             const std::shared_ptr<const Schedule>& schedule, int index) {
  Environment environment;
  environment.materials[0] = lift_material(benchmark, index);
  environment.obstacles.push_back({Plane{}});
  environment.state.positions = sheet.rest.vertices;
  environment.state.velocities = data::Points::Zero(sheet.rest.vertices.rows(), 3);
  Hold corner{.name = "gripper", .frame = 0};
  for (int i = 0; i < int(sheet.rest.vertices.rows()); ++i)
    if (sheet.rest.vertices.row(i).head<2>().minCoeff() > side - 0.02) corner.vertices.push_back(i);
  environment.holds.push_back(corner);
  environment.schedule = schedule;
  return environment;
}

double milliseconds_of(const std::function<void()>& work) {
  work();
  int count = 0;
  const auto start = std::chrono::steady_clock::now();
  do {
    work();
    ++count;
  } while (seconds_since(start) < 0.1);
  return 1e3 * seconds_since(start) / count;
}

// What a batch holds [bytes] of a vertex of one environment and of a step of one. Measured on sheets of 250
// to 16,000 vertices, 64 to 1,024 environments: a third are numbers, in the rest lie those of solvers that
// are done.
constexpr double batch_bytes_per_vertex = 450, batch_bytes_per_step = sizeof(StepStats) + 3 * sizeof(double);

/// Cells along a side of the towel.
int cells_of(const LiftBenchmark& benchmark) {
  return std::max(1, int(std::lround(std::sqrt(double(benchmark.vertices)))) - 1);
}

}  // namespace

int environments_together(const LiftBenchmark& benchmark) {
  return benchmark.alone ? 1 : benchmark.environments;
}

double least_seconds(const LiftBenchmark& benchmark) {
  constexpr double kWorkPerSecond = 1e6;  // steps of a vertex on one thread; 3e5 were measured
  if (benchmark.device == Device::cuda) return 0;
  const double vertices = std::pow(cells_of(benchmark) + 1.0, 2);
  return vertices * benchmark.environments * benchmark.steps /
         (kWorkPerSecond * std::max(1, std::min(benchmark.threads, benchmark.environments)));
}

void check(const LiftBenchmark& benchmark, double memory_limit) {
  const auto increasing = [](const char* option, double low, double high) {
    if (!(low <= high))
      throw data::InputError(std::string("--") + option + "-max: found " + data::format_short(high) +
                             ", expected at least the " + data::format_short(low) + " of --" + option +
                             "-min");
  };
  increasing("young", benchmark.membrane_stiffness_min, benchmark.membrane_stiffness_max);
  increasing("bending", benchmark.bending_rigidity_min, benchmark.bending_rigidity_max);
  const int vertices = (cells_of(benchmark) + 1) * (cells_of(benchmark) + 1);
  if (benchmark.device == Device::cuda && vertices > cuda::most_vertices)
    throw data::InputError("--vertices: found " + data::format_count(static_cast<std::size_t>(vertices)) +
                           ", expected at most " + data::format_count(cuda::most_vertices) +
                           " on a CUDA device; use --device cpu");
  const int at_once = std::min(environments_at_once, environments_together(benchmark));
  const int at_work = std::min(benchmark.threads, at_once);
  const double of_vertices =
      vertices * (at_work * solver_bytes_per_vertex + at_once * batch_bytes_per_vertex);
  const double of_steps = batch_bytes_per_step * benchmark.steps * at_once;
  const auto count = [](double number) { return data::format_count(static_cast<std::size_t>(number)); };
  if (memory_limit <= 0 || of_vertices + of_steps <= memory_limit) {
    constexpr double kDay = 86400;
    if (const double seconds = least_seconds(benchmark); seconds > kDay)
      throw data::InputError("--envs: " + count(benchmark.environments) + " environments of " +
                             count(benchmark.steps) + " steps of " + count(vertices) +
                             " vertices take more than " + data::format_short(seconds / kDay) +
                             " days on the CPU, expected at most one: use fewer");
    return;
  }
  throw data::InputError(
      (of_vertices > of_steps ? "--vertices: " + count(vertices) : "--steps: " + count(benchmark.steps)) +
      " of " + count(at_once) + " environments at once on " + count(at_work) + " threads take about " +
      count(1e-6 * (of_vertices + of_steps)) + " MB of memory, expected at most the " +
      count(1e-6 * memory_limit) + " MB that there are");
}

LiftBenchmarkResult run_lift_benchmark(const LiftBenchmark& benchmark, const std::atomic<bool>& stop) {
  check(benchmark);
  data::RectangleMesh rectangle;
  rectangle.width = rectangle.height = side;
  rectangle.cells_x = rectangle.cells_y = cells_of(benchmark);
  const auto plan = make_sheet_plan(make_sheet(data::rectangle(rectangle)), benchmark.level);
  BatchSettings settings;
  settings.solver.time_step = benchmark.time_step;
  settings.solver.tolerance = benchmark.tolerance;
  settings.solver.stop = &stop;
  if (benchmark.projective) settings.projective = published_budget(benchmark);
  settings.steps = benchmark.steps;
  settings.kept_steps = {benchmark.steps / 2};
  settings.threads = benchmark.threads;
  settings.device = benchmark.device;
  settings.cuda_devices = benchmark.cuda_devices;

  struct Counts {
    long iterations = 0, solves = 0, factorizations = 0, converged = 0;
    double residual_max = 0;
  };
  std::vector<Counts> counts(benchmark.environments);
  const std::size_t middle = counts.size() / 2;
  data::Points x;  // of the environment in the middle, halfway
  const std::vector<data::Trajectory> gripper = {lift_of(Eigen::Vector3d(side, side, 0))};
  const auto schedule = make_schedule(gripper, 0.0, benchmark.time_step, settings.steps);
  const auto environment = [&](std::size_t i) {
    return lift_environment(benchmark, plan->sheet, schedule, static_cast<int>(i));
  };
  LiftBenchmarkResult result;
  auto start = std::chrono::steady_clock::now();
  if (benchmark.device == Device::cuda) {
    BatchSettings first = settings;
    first.steps = 1;
    first.kept_steps.clear();
    replay_in_batches(plan, 1, 1, first, environment, [](std::size_t, const Batch&, int) {});
    result.start_seconds = seconds_since(start);
    start = std::chrono::steady_clock::now();
  }
  const int at_once = std::min(environments_at_once, environments_together(benchmark));
  replay_in_batches(plan, counts.size(), at_once, settings, environment,
                    [&](std::size_t i, const Batch& batch, int e) {
                      for (const StepStats& step : batch.stats(e)) {
                        counts[i].iterations += step.iterations;
                        counts[i].solves += step.solves;
                        counts[i].factorizations += step.factorizations;
                        counts[i].converged += step.converged;
                        counts[i].residual_max = data::worst(counts[i].residual_max, step.residual);
                      }
                      if (i == middle) x = batch.kept_positions(e, 0);
                      if (e == 0) result.phase_shares = batch.phases();
                    });
  result.wall_seconds = seconds_since(start);
  result.vertices = plan->pattern.size;
  const double total = double(benchmark.environments) * benchmark.steps;
  double converged = 0;
  for (const Counts& c : counts) {
    result.iterations += double(c.iterations) / total;
    result.solves += double(c.solves) / total;
    result.factorizations += double(c.factorizations) / total;
    converged += double(c.converged);
    result.residual_max = data::worst(result.residual_max, c.residual_max);
  }
  result.converged_share = converged / total;
  const auto slowest = std::max_element(counts.begin(), counts.end(), [](const Counts& a, const Counts& b) {
    return a.iterations < b.iterations;
  });
  const data::SheetMaterial slowest_material =
      lift_material(benchmark, static_cast<int>(slowest - counts.begin()));
  result.iterations_max = double(slowest->iterations) / std::max(1, benchmark.steps);
  result.slowest_membrane_stiffness = slowest_material.membrane_stiffness;
  result.slowest_bending_rigidity = slowest_material.bending_rigidity;
  if (benchmark.device == Device::cuda) {
    result.step_milliseconds = 1e3 * result.wall_seconds * environments_together(benchmark) / total;
    const cuda::FrontPlan fronts = cuda::plan_fronts(plan->pattern, plan->sheet.rest.vertices);
    const cuda::SheetLayout layout =
        cuda::lay_out(*plan, bending_operator(*plan, lift_material(benchmark, 0)), fronts);
    const cuda::PartCost least = cuda::whole_step(cuda::step_cost(*plan, fronts, layout), result.iterations,
                                                  result.factorizations, result.solves);
    result.least_bytes = least.bytes;
    result.least_flops = least.flops;
    return result;
  }
  result.step_milliseconds =
      1e3 * result.wall_seconds * std::min(benchmark.threads, environments_together(benchmark)) / total;
  if (total < 1 || benchmark.projective) return result;

  const Environment typical = lift_environment(benchmark, plan->sheet, schedule, benchmark.environments / 2);
  const BodyLaw law = body_laws(*plan, typical).front();
  const data::SheetMaterial& material = law.material;
  data::Points y = data::Points::Zero(x.rows(), 3);
  BlockValues<double> values;
  const auto assemble = [&](Curvature curvature) {
    values.assign(9 * (plan->pattern.size + plan->pattern.pairs.size()), 0.0);
    add_elastic_hessian(*plan, law, x, 1.0, curvature, values);
    for (int i = 0; i < plan->pattern.size; ++i)
      for (int c = 0; c < 3; ++c)
        values[9L * i + 4 * c] +=
            material.areal_density * plan->sheet.vertex_area[i] / (benchmark.time_step * benchmark.time_step);
  };
  BlockCholesky<float> factor(plan->symbolic, *plan->kernels);
  SheetProduct<float> product(*plan->kernels);
  const auto add = [&](const char* name, double calls, const std::function<void()>& phase) {
    result.phases.push_back({name, calls, milliseconds_of(phase)});
  };
  add("energy and forces", result.iterations + 1, [&] { add_elastic_gradient(*plan, law, x, y); });
  add("matrix", result.iterations, [&] {
    assemble(Curvature::exact);
    product.assign(plan->triangle_product, values,
                   {{&law.bending.elimination_stiffness, material.bending_rigidity}});
  });
  add("factorization", result.factorizations, [&] {
    assemble(Curvature::positive);
    add_bending_stand_in(law.bending, material.bending_rigidity, values);
    factor.factorize(values);
  });
  Eigen::VectorXf from = Eigen::VectorXf::Ones(4 * y.rows()), to = from;
  add("triangular solves", result.solves, [&] { factor.solve_in_order(to.data()); });
  add("matrix products", result.solves, [&] { product.multiply(from.data(), to.data()); });
  return result;
}

}  // namespace flash::sim
