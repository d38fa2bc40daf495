#include <cstdio>
#include <cstdlib>
#include <map>
#include <vector>

#include "data/parallel.h"
#include "tests/sim/random_scenes.h"

// random_scene_study FIRST COUNT [--list]: scenes of the seeds FIRST to FIRST + COUNT - 1, and what an
// observer finds.
int main(int argc, char** argv) {
  using namespace flash;
  const unsigned long first = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 1;
  const std::size_t count = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 1000;
  const bool list = argc > 3;
  struct Row {
    sim::SceneKind kind;
    sim::SceneFindings found;
  };
  std::vector<Row> rows(count);
  data::for_each_in_parallel(count, 0, [&](std::size_t k) {
    sim::RandomScene scene = sim::random_scene(first + k);
    const sim::SceneKind kind = scene.kind;
    const auto material = scene.environment.material;
    const double h = scene.settings.time_step;
    rows[k] = {kind, sim::observe(std::move(scene))};
    const auto& f = rows[k].found;
    if (list)
      std::printf(
          "%lu %s h %.4f Et %.3g D %.3g rho %.2f mu %.2f law %d bend %d: unconverged %d (%.2g) unseen %.2g "
          "free %.2g exit %.2f gain %.3g share %.3g crossed %.2g%s\n",
          first + k, sim::to_string(kind), h, material.membrane_stiffness, material.bending_rigidity,
          material.areal_density, material.friction, int(material.constitutive), int(material.bending_model),
          f.unconverged, f.residual_max, f.unseen_depth, f.free_depth, f.exit_speed, f.energy_gain,
          f.energy_gain_share, f.crossed, f.finite ? "" : " NOT FINITE");
    std::fflush(stdout);
  });
  struct Sum {
    int scenes = 0, unconverged_scenes = 0, bad_scenes = 0, steps = 0, unconverged = 0, infinite = 0,
        gains = 0, crossed = 0, unseen = 0;
    double exit_speed = 0, free_depth = 0;
  };
  std::map<int, Sum> sums;
  for (const Row& row : rows)
    for (const int key : {int(row.kind), 100}) {
      Sum& s = sums[key];
      const auto& f = row.found;
      ++s.scenes;
      s.unconverged_scenes += f.unconverged > 0;
      s.bad_scenes += 100 * f.unconverged > f.steps;
      s.steps += f.steps;
      s.unconverged += f.unconverged;
      s.infinite += !f.finite;
      s.gains += f.energy_gain_share > 1e-2;
      s.crossed += f.crossed > 1e-4;
      s.unseen += f.unseen_depth > 1e-4;
      s.exit_speed = std::max(s.exit_speed, f.exit_speed);
      s.free_depth = std::max(s.free_depth, f.free_depth);
    }
  std::printf("%-8s %7s %12s %7s %12s %9s %6s %7s %7s %10s %10s\n", "kind", "scenes", "unconverged", "steps",
              "unconverged", "infinite", "gains", "crossed", "unseen", "exit m/s", "depth m");
  for (const auto& [key, s] : sums)
    std::printf("%-8s %7d %12d %7d %12d %9d %6d %7d %7d %10.2f %10.2g\n",
                key == 100 ? "all" : sim::to_string(sim::SceneKind(key)), s.scenes, s.unconverged_scenes,
                s.steps, s.unconverged, s.infinite, s.gains, s.crossed, s.unseen, s.exit_speed, s.free_depth);
}
