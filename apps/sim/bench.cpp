#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sim/lift_benchmark.h"
#include "apps/sim/verbs.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"

namespace flash {
namespace {

struct BenchOptions {
  sim::LiftBenchmark benchmark;
  std::vector<int> vertices = {1000}, environments = {64};
  std::string level = sim::to_string(sim::highest_instruction_level());
  std::string device = "auto", method = "newton";
  bool json = false;
};

/// A benchmark, and what it took.
struct Run {
  sim::LiftBenchmark benchmark;
  sim::LiftBenchmarkResult result;

  /// What all environments move or compute at least per second.
  double rate(double each) const {
    return each * environments_together(benchmark) / (1e-3 * result.step_milliseconds);
  }
};

nlohmann::ordered_json json_of(const Run& run) {
  const sim::LiftBenchmarkResult& result = run.result;
  nlohmann::ordered_json json = {{"vertices", result.vertices},
                                 {"environments", run.benchmark.environments},
                                 {"alone", run.benchmark.alone},
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
  for (const sim::PhaseShare& phase : result.phase_shares)
    json["phases"].push_back({{"name", phase.name}, {"share", phase.share}});
  if (run.benchmark.device == sim::Device::cuda) {
    json["least_bytes"] = result.least_bytes;
    json["least_flops"] = result.least_flops;
  }
  return json;
}

void print_cpu(const Run& run) {
  const sim::LiftBenchmarkResult& result = run.result;
  double accounted = 0;
  for (const sim::BenchmarkPhase& phase : result.phases)
    accounted += phase.calls_per_step * phase.milliseconds_per_call;
  std::printf("%d vertices, %d environments%s, %d steps, %d threads, kernels for %s: %.1f s\n",
              result.vertices, run.benchmark.environments, run.benchmark.alone ? " each alone" : "",
              run.benchmark.steps, run.benchmark.threads, sim::to_string(run.benchmark.level),
              result.wall_seconds);
  std::printf("converged %.2f %% of the steps, worst residual %.2g, %.2f %s iterations per step\n",
              100 * result.converged_share, result.residual_max, result.iterations,
              run.benchmark.projective ? "local-global" : "Newton");
  std::printf("the material of E t %.4g N/m and D %.3g N m takes most, %.2f\n",
              result.slowest_membrane_stiffness, result.slowest_bending_rigidity, result.iterations_max);
  if (result.phases.empty()) {
    std::printf("%.3f ms per step, 1 thread\n", result.step_milliseconds);
    return;
  }
  std::printf("%-21s %9s %12s %10s\n", "time per step, 1 thread", "calls", "ms per call", "ms");
  for (const sim::BenchmarkPhase& phase : result.phases)
    std::printf("%-22s %10.2f %12.4f %10.3f\n", phase.name.c_str(), phase.calls_per_step,
                phase.milliseconds_per_call, phase.calls_per_step * phase.milliseconds_per_call);
  std::printf("%-22s %34.3f\n", "contact and the rest", result.step_milliseconds - accounted);
  std::printf("%-22s %34.3f\n", "all", result.step_milliseconds);
}

void print_device_head(const sim::DeviceRates& rates, std::size_t devices) {
  std::printf("%s%s: copies of %.2f TB/s, %.1f TFLOP/s in single precision\n",
              devices > 1 ? (std::to_string(devices) + " times ").c_str() : "", rates.name.c_str(),
              1e-12 * rates.copied_bytes, 1e-12 * rates.single_flops);
  std::printf("%8s %6s %12s %10s %8s %8s %8s %8s %9s %9s %9s %9s\n", "vertices", "envs", "ms per step",
              "converged", "Newton", "slowest", "solves", "factors", "GB/s", "of copies", "GFLOP/s",
              "of peak");
}

/// Bytes and operations are the least that the solver's counts need (sim/cuda/layout/step_cost.h).
void print_device(const Run& run, const sim::DeviceRates& rates) {
  const sim::LiftBenchmarkResult& result = run.result;
  const double bytes = run.rate(result.least_bytes), flops = run.rate(result.least_flops),
               devices = static_cast<double>(std::max<std::size_t>(1, run.benchmark.cuda_devices.size()));
  const std::string environments = run.benchmark.alone ? std::to_string(run.benchmark.environments) + " x 1"
                                                       : std::to_string(run.benchmark.environments);
  std::printf("%8d %6s %12.3f %8.2f %% %8.2f %8.2f %8.2f %8.2f %9.0f %7.1f %% %9.0f %7.1f %%\n",
              result.vertices, environments.c_str(), result.step_milliseconds, 100 * result.converged_share,
              result.iterations, result.iterations_max, result.solves, result.factorizations, 1e-9 * bytes,
              100 * bytes / (devices * rates.copied_bytes), 1e-9 * flops,
              100 * flops / (devices * rates.single_flops));
  std::printf("%15s", "");
  const char* separator = " ";
  for (const sim::PhaseShare& phase : result.phase_shares) {
    std::printf("%s%s %.0f %%", separator, phase.name.c_str(), 100 * phase.share);
    separator = ", ";
  }
  std::printf("; started in %.2f s\n", result.start_seconds);
  std::fflush(stdout);
}

int bench(BenchOptions options) {
  sim::LiftBenchmark& benchmark = options.benchmark;
  if (benchmark.threads == 0) benchmark.threads = int(std::max(1u, std::thread::hardware_concurrency()));
  for (const sim::InstructionLevel level : sim::instruction_levels())
    if (sim::to_string(level) == options.level) benchmark.level = level;
  if (options.method == "projective" && options.device != "auto" && options.device != "cpu")
    throw data::InputError("--device: found \"" + options.device +
                           "\", expected auto or cpu: --method projective runs on the CPU alone");
  const sim::DeviceChoice choice = sim::choose_device(options.device == "auto" ? "cpu" : options.device);
  benchmark.device = choice.device;
  benchmark.cuda_devices = choice.cuda_devices;
  benchmark.projective = options.method == "projective";
  const bool on_device = benchmark.device == sim::Device::cuda;
  std::vector<sim::LiftBenchmark> benchmarks;  // all are checked before the first is run
  for (const int vertices : options.vertices)
    for (const int environments : options.environments) {
      benchmark.vertices = vertices;
      benchmark.environments = environments;
      sim::check(benchmark);
      benchmarks.push_back(benchmark);
    }
  double seconds = 0;
  for (const sim::LiftBenchmark& each : benchmarks) seconds += sim::least_seconds(each);
  if (seconds > 60)
    std::fprintf(stderr, "this takes at least %s\n",
                 seconds < 7200 ? (data::format_short(std::ceil(seconds / 60)) + " min").c_str()
                                : (data::format_short(seconds / 3600) + " h").c_str());
  sim::DeviceRates rates;
  if (on_device)
    rates = sim::device_rates(benchmark.cuda_devices.empty() ? 0 : benchmark.cuda_devices.front());
  nlohmann::ordered_json json = {{"schema", "flash-sim-bench/2"},
                                 {"steps", benchmark.steps},
                                 {"method", options.method},
                                 {"threads", benchmark.threads},
                                 {"level", sim::to_string(benchmark.level)},
                                 {"device", options.device == "auto" ? "cpu" : options.device},
                                 {"runs", nlohmann::ordered_json::array()}};
  if (on_device)
    json["rates"] = {
        {"name", rates.name}, {"copied_bytes", rates.copied_bytes}, {"single_flops", rates.single_flops}};
  if (on_device && !options.json) print_device_head(rates, benchmark.cuda_devices.size());
  for (const sim::LiftBenchmark& each : benchmarks) {
    const Run run = {each, sim::run_lift_benchmark(each, stop_on_signals())};
    if (options.json)
      json["runs"].push_back(json_of(run));
    else if (on_device)
      print_device(run, rates);
    else
      print_cpu(run);
  }
  if (options.json) std::cout << data::format_json(json);
  return exit_done;
}

}  // namespace

void add_bench_verb(CLI::App& app, Action& action) {
  CLI::App& verb = *app.add_subcommand("bench", "Time corner lifts of many materials, by phase of a step");
  const auto options = std::make_shared<BenchOptions>();
  sim::LiftBenchmark& benchmark = options->benchmark;
  benchmark.threads = 0;
  verb.footer(
      "Examples:\n"
      "  flash-sim bench --vertices 1000 --envs 64 --steps 250 --threads 2\n"
      "  flash-sim bench --vertices 1000,2000,4000 --envs 1,64,256,1024 --device cuda\n"
      "  flash-sim bench --vertices 1000 --envs 64 --method projective");
  const auto positive = [&](const char* name, double& value, const char* text) {
    verb.add_option(name, value, text)->check(positive_number())->capture_default_str();
  };
  const auto counts = [&](const char* name, std::vector<int>& values, const char* text, long low) {
    add_list_option(verb, name, values, text, whole_number(low, 1'000'000))
        ->default_str(std::to_string(values.front()));
  };
  counts("--vertices", options->vertices, "Approximate numbers of vertices of the towel", 4);
  counts("--envs", options->environments, "Numbers of materials", 1);
  verb.add_flag("--alone", benchmark.alone,
                "One material after the other, each by itself; the time is the mean of theirs");
  verb.add_option("--steps", benchmark.steps, "Time steps per material")
      ->check(whole_number(1, 1'000'000))
      ->capture_default_str();
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
  verb.add_option("--device", options->device,
                  "Where the simulation runs: cpu, cuda, cuda:1, cuda:0,2 or cuda:all; auto: the CPU")
      ->capture_default_str();
  verb.add_option("--method", options->method,
                  "newton, to the tolerance; projective: the published budget, unconverged, on the CPU")
      ->check(CLI::IsMember({"newton", "projective"}))
      ->capture_default_str();
  verb.add_flag("--json", options->json, "Print the result as JSON");
  verb.callback([&action, options] { action = [options] { return bench(*options); }; });
}

}  // namespace flash
