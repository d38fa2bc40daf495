#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/command_line.h"
#include "apps/lift_benchmark.h"
#include "apps/option_checks.h"
#include "apps/sim_verbs.h"
#include "data/error.h"

namespace flash {
namespace {

struct BenchOptions {
  sim::LiftBenchmark benchmark;
  std::string level = sim::to_string(sim::highest_instruction_level());
  std::string device = "auto";
  bool json = false;
};

void print_slowest(const sim::LiftBenchmarkResult& result) {
  std::printf("the material of E t %.4g N/m and D %.3g N m takes most, %.2f\n",
              result.slowest_membrane_stiffness, result.slowest_bending_rigidity, result.iterations_max);
}

int bench(BenchOptions options) {
  sim::LiftBenchmark& benchmark = options.benchmark;
  if (benchmark.threads == 0) benchmark.threads = int(std::max(1u, std::thread::hardware_concurrency()));
  for (const sim::InstructionLevel level : sim::instruction_levels())
    if (sim::to_string(level) == options.level) benchmark.level = level;
  if (options.device == "cuda") {
    if (const std::string why = sim::why_no_cuda(); !why.empty())
      throw data::InputError("--device cuda: " + why + "; use --device cpu or auto");
    benchmark.device = sim::Device::cuda;
  }
  const bool on_device = benchmark.device == sim::Device::cuda;
  const sim::LiftBenchmarkResult result = sim::run_lift_benchmark(benchmark, stop_on_signals());
  double accounted = 0;
  for (const sim::BenchmarkPhase& phase : result.phases)
    accounted += phase.calls_per_step * phase.milliseconds_per_call;
  if (options.json) {
    nlohmann::ordered_json json = {{"schema", "flash-sim-bench/1"},
                                   {"vertices", result.vertices},
                                   {"environments", benchmark.environments},
                                   {"steps", benchmark.steps},
                                   {"threads", benchmark.threads},
                                   {"level", sim::to_string(benchmark.level)},
                                   {"device", on_device ? "cuda" : "cpu"},
                                   {"start_seconds", result.start_seconds},
                                   {"wall_seconds", result.wall_seconds},
                                   {"step_ms", result.step_milliseconds},
                                   {"iterations", result.iterations},
                                   {"slowest",
                                    {{"membrane_stiffness", result.slowest_membrane_stiffness},
                                     {"bending_rigidity", result.slowest_bending_rigidity},
                                     {"iterations", result.iterations_max}}},
                                   {"converged_share", result.converged_share},
                                   {"solves", result.solves},
                                   {"factorizations", result.factorizations},
                                   {"residual_max", result.residual_max},
                                   {"phases", nlohmann::ordered_json::array()}};
    for (const sim::BenchmarkPhase& phase : result.phases)
      json["phases"].push_back(
          {{"name", phase.name}, {"calls", phase.calls_per_step}, {"call_ms", phase.milliseconds_per_call}});
    std::cout << json.dump(2) << '\n';
    return exit_done;
  }
  if (on_device) {
    std::printf(
        "%d vertices, %d environments, %d steps on the CUDA device: %.2f s, %.3f ms a step of all; %.2f s "
        "before that to start\n",
        result.vertices, benchmark.environments, benchmark.steps, result.wall_seconds,
        result.step_milliseconds, result.start_seconds);
    std::printf(
        "converged %.2f %% of the steps, worst residual %.2g; a step %.2f Newton iterations, %.2f solves, "
        "%.2f factorizations\n",
        100 * result.converged_share, result.residual_max, result.iterations, result.solves,
        result.factorizations);
    print_slowest(result);
    return exit_done;
  }
  std::printf("%d vertices, %d environments, %d steps, %d threads, kernels for %s: %.1f s\n", result.vertices,
              benchmark.environments, benchmark.steps, benchmark.threads, sim::to_string(benchmark.level),
              result.wall_seconds);
  std::printf("converged %.2f %% of the steps, worst residual %.2g, %.2f Newton iterations a step\n",
              100 * result.converged_share, result.residual_max, result.iterations);
  print_slowest(result);
  std::printf("%-21s %9s %10s %10s\n", "time a step, 1 thread", "calls", "ms a call", "ms");
  for (const sim::BenchmarkPhase& phase : result.phases)
    std::printf("%-20s %10.2f %10.4f %10.3f\n", phase.name.c_str(), phase.calls_per_step,
                phase.milliseconds_per_call, phase.calls_per_step * phase.milliseconds_per_call);
  std::printf("%-20s %32.3f\n", "contact and the rest", result.step_milliseconds - accounted);
  std::printf("%-20s %32.3f\n", "all", result.step_milliseconds);
  return exit_done;
}

}  // namespace

void add_bench_verb(CLI::App& app, Action& action) {
  CLI::App& verb = *app.add_subcommand("bench", "Time corner lifts of many materials, by phase of a step");
  const auto options = std::make_shared<BenchOptions>();
  sim::LiftBenchmark& benchmark = options->benchmark;
  benchmark.threads = 0;
  verb.footer("Example:\n  flash-sim bench --vertices 1000 --envs 64 --steps 250 --threads 2");
  const auto count = [&](const char* name, int& value, const char* text, long low) {
    verb.add_option(name, value, text)->check(whole_number(low, 1'000'000))->capture_default_str();
  };
  const auto positive = [&](const char* name, double& value, const char* text) {
    verb.add_option(name, value, text)->check(positive_number())->capture_default_str();
  };
  count("--vertices", benchmark.vertices, "Approximate number of vertices of the towel", 4);
  count("--envs", benchmark.environments, "Number of materials", 1);
  count("--steps", benchmark.steps, "Time steps per material", 1);
  verb.add_option("--threads", benchmark.threads, "Materials that run at the same time; 0: one a processor")
      ->check(thread_number())
      ->capture_default_str();
  verb.add_option("--time-step", benchmark.time_step, "[s]")->check(time_step())->capture_default_str();
  verb.add_option("--tolerance", benchmark.tolerance, "On the residual |r| / |M g|")
      ->check(number_between(1e-12, 1))
      ->capture_default_str();
  positive("--young-min", benchmark.membrane_stiffness_min, "E t from [N/m]");
  positive("--young-max", benchmark.membrane_stiffness_max, "E t to [N/m]");
  positive("--bending-min", benchmark.bending_rigidity_min, "D from [N m]");
  positive("--bending-max", benchmark.bending_rigidity_max, "D to [N m]");
  std::vector<std::string> levels;
  for (const sim::InstructionLevel level : sim::instruction_levels()) levels.push_back(sim::to_string(level));
  verb.add_option("--level", options->level, "Instructions of the kernels, of those that this machine has")
      ->check(CLI::IsMember(levels))
      ->capture_default_str();
  verb.add_option("--device", options->device, "Where the simulation runs; auto: the CPU")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->capture_default_str();
  verb.add_flag("--json", options->json, "Print the result as JSON");
  verb.callback([&action, options] { action = [options] { return bench(*options); }; });
}

}  // namespace flash
