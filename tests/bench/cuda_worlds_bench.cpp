// Worlds on a device: the lifts of `flash-sim bench` in one call, step by step, with poses given at each
// step, with unlike Poisson's ratios and times at which the gripper closes, and resets of some of them; and
// how much more work the slowest environment of a step takes than the mean, for which a step waits.
// Usage: flash_cuda_worlds_bench [VERTICES [ENVIRONMENTS[,...] [STEPS [THREADS]]]]. Milliseconds a step of
// all environments. Each line is timed twice, the better time is told.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>
#include <string>

#include "data/mesh/procedural_mesh.h"
#include "data/motion/trajectory.h"
#include "sim/worlds.h"
#include "tests/bench/device_bench.h"

namespace flash::sim {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double side = 0.4;  // [m]

/// What of the environments is unlike.
struct Unlike {
  bool poissons_ratios = false, closing_times = false;
};

/// Minimum jerk, up by 0.35 m and inwards by 0.1 m in 3 s.
Eigen::Isometry3d pose_at_step(int k) {
  const double t = std::min(1.0, 0.01 * k / 3.0), s = t * t * t * (10 - 15 * t + 6 * t * t);
  return Eigen::Isometry3d(
      Eigen::Translation3d(Eigen::Vector3d(side, side, 0) + s * Eigen::Vector3d(-0.1, -0.1, 0.35)));
}

double radical_inverse(int i) {
  double value = 0;
  for (double digit = 0.5; i > 0; i /= 2, digit *= 0.5) value += digit * (i % 2);
  return value;
}

std::vector<Environment> lifts(const SheetPlan& plan, int count, int steps, const Unlike& unlike) {
  auto schedule = std::make_shared<Schedule>();
  schedule->frames.emplace_back();
  for (int k = 0; k <= steps; ++k) schedule->frames[0].push_back(pose_at_step(k));
  const data::Points& rest = plan.sheet.rest.vertices;
  std::vector<Environment> all;
  for (int e = 0; e < count; ++e) {
    Environment& own = all.emplace_back();
    own.materials[0].membrane_stiffness = 10 * std::pow(30, (e + 0.5) / count);
    own.materials[0].bending_rigidity = 1e-5 * std::pow(10, radical_inverse(e));
    own.materials[0].areal_density = 0.2;
    own.materials[0].friction = 0.3;
    if (unlike.poissons_ratios) own.materials[0].poissons_ratio = 0.05 + 0.3 * (e + 0.5) / count;
    own.obstacles.push_back({Plane{}});
    own.state.positions = rest;
    own.state.velocities = data::Points::Zero(rest.rows(), 3);
    Hold corner{.name = "gripper", .frame = 0};
    for (int i = 0; i < static_cast<int>(rest.rows()); ++i)
      if (rest.row(i).head<2>().minCoeff() > side - 0.02) corner.vertices.push_back(i);
    if (unlike.closing_times) corner.from = 0.01 * (e % 64);
    own.holds.push_back(corner);
    own.schedule = schedule;
  }
  return all;
}

/// Milliseconds that work() takes.
double milliseconds(const std::function<void()>& work) {
  const auto start = Clock::now();
  work();
  return 1e3 * std::chrono::duration<double>(Clock::now() - start).count();
}

struct Bench {
  std::shared_ptr<const SheetPlan> plan;
  int environments, steps, threads;

  Worlds worlds(const Unlike& unlike = {}) const {
    return {plan, lifts(*plan, environments, steps, unlike),
            WorldSettings{.threads = threads, .device = Device::cuda, .steps_at_once = steps}};
  }

  /// Twice from the start, the better time; a step.
  void print(const char* what, Worlds& worlds, const std::function<void()>& work) const {
    double best = milliseconds(work);
    worlds.reset({});
    best = std::min(best, milliseconds(work));
    double converged = 0;
    for (int e = 0; e < worlds.size(); ++e) converged += worlds.status(e).converged / worlds.size();
    std::printf("%6d %-40s %9.3f ms a step, %.1f %% of the last steps converged\n", environments, what,
                best / steps, 100 * converged);
    std::fflush(stdout);
  }

  /// Work as devices count it, summed over the steps from the start.
  void print_slowest(Worlds& worlds) const {
    double slowest = 0, mean = 0;
    for (int k = 0; k < steps; ++k) {
      worlds.step();
      double most = 0;
      for (int e = 0; e < worlds.size(); ++e) {
        const StepReport& report = worlds.report(e);
        const double work = report.solves + 2 * report.iterations + 8 * report.factorizations;
        most = std::max(most, work);
        mean += work / worlds.size();
      }
      slowest += most;
    }
    std::printf("%6d slowest environment of a step %24.2f times the mean work\n", environments,
                slowest / mean);
  }

  void give_poses(Worlds& to, int k) const {
    const Eigen::Matrix<double, 7, 1> pose = data::to_vector(pose_at_step(k));
    std::vector<double> numbers;
    for (int e = 0; e < environments; ++e) numbers.insert(numbers.end(), pose.begin(), pose.end());
    to.set_poses({}, 0, {.data = numbers.data(), .shape = {environments, 7}});
  }

  void run() const {
    Worlds alike = worlds();
    print("in one call", alike, [&] { alike.step(steps); });
    alike.reset({});
    print("step by step", alike, [&] {
      for (int k = 0; k < steps; ++k) alike.step();
    });
    alike.reset({});
    print("step by step, poses given", alike, [&] {
      for (int k = 0; k < steps; ++k) {
        give_poses(alike, k + 1);
        alike.step();
      }
    });
    alike.reset({});
    print_slowest(alike);
    alike.positions();  // from now on there are views
    const std::vector<int> ten = [&] {
      std::vector<int> numbers(static_cast<std::size_t>(std::min(10, environments)));
      std::iota(numbers.begin(), numbers.end(), 0);
      return numbers;
    }();
    const double reset = milliseconds([&] { alike.reset(ten); });
    std::printf("%6d reset of %zu of them %35.3f ms\n", environments, ten.size(), reset);
    Worlds ratios = worlds({.poissons_ratios = true});
    print("in one call, unlike Poisson's ratios", ratios, [&] { ratios.step(steps); });
    Worlds times = worlds({.closing_times = true});
    print("in one call, unlike closing times", times, [&] { times.step(steps); });
  }
};

}  // namespace
}  // namespace flash::sim

int main(int count, char** arguments) {
  using namespace flash::sim;
  if (const std::string why = why_no_cuda(); !why.empty()) {
    std::fprintf(stderr, "flash_cuda_worlds_bench: %s\n", why.c_str());
    return 2;
  }
  const int vertices = count > 1 ? std::stoi(arguments[1]) : 1024,
            steps = count > 3 ? std::stoi(arguments[3]) : 250,
            threads = count > 4 ? std::stoi(arguments[4]) : 16;
  flash::data::RectangleMesh rectangle;
  rectangle.width = rectangle.height = side;
  rectangle.cells_x = rectangle.cells_y = static_cast<int>(std::lround(std::sqrt(vertices))) - 1;
  const auto plan = make_sheet_plan(make_sheet(flash::data::rectangle(rectangle)));
  for (const int environments : cuda::numbers_of(count > 2 ? arguments[2] : "1,64,256,1024"))
    Bench{plan, environments, steps, threads}.run();
}
