// Prints how long the steps of a scene take in many environments at once: what docs/performance.md says of
// it.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include "data/scene/scene.h"
#include "sim/batch.h"
#include "sim/scene/scene.h"

namespace flash::sim {
namespace {

/// The environments of a search: the scene's, with bending rigidities from half of its own to twice as much.
std::vector<Environment> environments_of(const Environment& scene, int count) {
  std::vector<Environment> all(static_cast<std::size_t>(count), scene);
  for (int e = 0; e < count; ++e)
    for (data::SheetMaterial& material : all[e].materials)
      material.bending_rigidity *= count == 1 ? 1 : std::exp2(2.0 * e / (count - 1) - 1);
  return all;
}

void print_batch(const data::Scene& scene, int count, int steps, int threads) {
  std::vector<std::string> notices;
  const SceneBody body = std::move(scene_bodies(scene, scene.steps, notices).front());
  BatchSettings settings;
  settings.solver = {.time_step = scene.time_step, .tolerance = scene.solver.tolerance};
  settings.steps = steps;
  settings.threads = threads;
  Batch batch(make_sheet_plan(body.sheet), environments_of(body.environment, count), settings);
  const std::clock_t start = std::clock();
  batch.advance(steps);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  long iterations = 0;
  int unsolved = 0;
  for (int e = 0; e < count; ++e)
    for (const StepStats& stats : batch.stats(e)) {
      iterations += stats.iterations;
      unsolved += !stats.converged;
    }
  const double all = static_cast<double>(count) * steps;
  std::printf("| %d | %td | %d | %.1f | %.0f | %.0f | %d |\n", count, body.sheet.rest.vertices.rows(), steps,
              static_cast<double>(iterations) / all, 1e3 * seconds / all,
              1e3 * seconds / steps / std::min(threads, count), unsolved);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::sim

/// SCENE THREADS, then for each line the number of environments and of steps.
int main(int argc, char** argv) {
  if (argc < 5 || argc % 2 == 0) {
    std::fprintf(stderr,
                 "usage: scene_batch_study SCENE THREADS ENVIRONMENTS STEPS [ENVIRONMENTS STEPS ...]\n");
    return 1;
  }
  const flash::data::Scene scene = flash::data::load_scene(argv[1]);
  const int threads = std::atoi(argv[2]);
  std::puts(
      "| environments | vertices | steps | iterations a step | ms of the processor, a step and environment | "
      "ms of all processors, a step of all | unsolved |\n|---|---|---|---|---|---|---|");
  for (int k = 3; k < argc; k += 2)
    flash::sim::print_batch(scene, std::atoi(argv[k]), std::atoi(argv[k + 1]), threads);
  return 0;
}
