// Registration and scores of simulated motions, by searches on the processor and on a CUDA device: a wavy
// sheet of 2,025 vertices, 21 keyframes of 1,600 points, offset, yaw and clock free. Items are candidates.
#include <benchmark/benchmark.h>

#include <random>
#include <thread>

#include "data/machine/parallel.h"
#include "sim/device.h"
#include "sysid/observe/registration.h"
#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

constexpr int keyframes = 21, points = 1600;

struct Scored {
  Replay replay;
  std::vector<Motion> motions;

  Scored(int cells, int candidates) {
    const data::TriangleMesh mesh = flat_sheet(cells);
    replay.surface = mesh;
    replay.queries = std::make_shared<const SheetDistance>(mesh.triangles, mesh.vertices);
    replay.recording.nuisance.offset.setConstant(0.01);
    replay.recording.nuisance.yaw = 0.05;
    replay.recording.nuisance.time = 0.03;
    std::mt19937 random(3);
    std::uniform_int_distribution<Eigen::Index> vertex(0, mesh.vertices.rows() - 1);
    std::normal_distribution<double> noise(0, 1e-3);
    for (int k = 0; k < keyframes; ++k) {
      Observation observation{.t = 0.2 + 0.04 * k, .points = data::Points(points, 3)};
      const data::Points surface = moving_sheet(mesh.vertices, observation.t);
      for (Eigen::Index i = 0; i < points; ++i)
        observation.points.row(i) = surface.row(vertex(random)) + Eigen::RowVector3d(0.004, 0.002, 0) +
                                    Eigen::RowVector3d(noise(random), noise(random), noise(random));
      replay.observations.push_back(observation);
    }
    for (int c = 0; c < candidates; ++c) {
      motions.push_back(moving_sheet_motion(mesh, 0.01, 110));
      for (data::Points& x : motions.back().positions) x.col(2) *= 1 + 1e-3 * c;
    }
  }
};

/// Whether the device can be used, where it is asked for.
bool use_device(Scored& scored, benchmark::State& state, long on_device) {
  if (on_device == 0) return true;
  scored.replay.settings.device = sim::Device::cuda;
  const std::string why = sim::why_no_cuda();
  if (!why.empty()) state.SkipWithError(why.c_str());
  return why.empty();
}

void register_and_score(benchmark::State& state) {
  Scored scored(static_cast<int>(state.range(1)), 32);
  if (!use_device(scored, state, state.range(0))) return;
  const CloudSearches searches = device_searches(scored.replay, RegistrationSettings().points_per_keyframe);
  for (auto _ : state)
    data::for_each_in_parallel(scored.motions.size(), static_cast<int>(state.range(2)), [&](std::size_t c) {
      RegistrationProblem problem = registration_problem(scored.replay, scored.motions[c]);
      problem.searches = searches;
      benchmark::DoNotOptimize(register_motions({problem}, {}).front().score);
    });
  state.SetItemsProcessed(state.iterations() * std::ssize(scored.motions));
}
BENCHMARK(register_and_score)
    ->ArgNames({"cuda", "cells", "threads"})
    ->ArgsProduct({{0, 1}, {31, 44}, {1, 16}})
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// One search of a thread: of the points that a registration is fitted to, then of all. Items are points.
void search(benchmark::State& state) {
  Scored scored(static_cast<int>(state.range(0)), 1);
  if (!use_device(scored, state, 1)) return;
  const CloudSearches searches = device_searches(scored.replay, RegistrationSettings().points_per_keyframe);
  const CloudSearch in_motion = searches(scored.motions.front());
  const CloudPoints which = state.range(1) == 0 ? CloudPoints::thinned : CloudPoints::all;
  long count = 0;
  for (auto _ : state)
    for (const std::span<const sim::SurfaceFoot>& feet : in_motion(which, {})) count += std::ssize(feet);
  state.SetItemsProcessed(count);
}
BENCHMARK(search)
    ->ArgNames({"cells", "all"})
    ->ArgsProduct({{31, 44, 150}, {0, 1}})
    ->UseRealTime()
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace flash::sysid
