#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "data/machine/parallel.h"
#include "tests/sim/random_fast_scenes.h"
#include "tests/sim/random_layer_scenes.h"
#include "tests/sim/scene_findings.h"

namespace {

std::string material_of(const flash::sim::RandomScene& scene) {
  char text[200];
  const auto solid = scene.environment.solids.find(0);
  if (solid != scene.environment.solids.end()) {
    std::snprintf(text, sizeof text, "%s, E %.3g Pa, nu %.3f, friction %.2f, law %d", scene.mesh.c_str(),
                  solid->second.youngs_modulus, solid->second.poissons_ratio, solid->second.friction,
                  static_cast<int>(solid->second.constitutive));
    return text;
  }
  const auto& material = scene.environment.materials[0];
  std::snprintf(text, sizeof text,
                "E t %.3g N/m, D %.3g N m, friction %.2f, membrane law %d, bending model %d",
                material.membrane_stiffness, material.bending_rigidity, material.friction,
                static_cast<int>(material.constitutive), static_cast<int>(material.bending_model));
  return text;
}

/// What an observer finds in `count` random scenes whose surface meets itself.
void print_layer_scenes(unsigned long first, std::size_t count, double fastest, bool list) {
  using namespace flash::sim;
  std::vector<LayerFindings> findings(count);
  std::vector<LayerSceneKind> kinds(count);
  flash::data::for_each_in_parallel(count, 0, [&](std::size_t k) {
    const RandomLayerScene scene = random_layer_scene(first + k, fastest);
    const LayerFindings found = observe(scene);
    kinds[k] = scene.kind;
    findings[k] = found;
    if (list &&
        (found.unconverged > 0 || found.passing > 0 || !found.finite || found.energy_gain_share > 1e-2))
      std::printf("%lu %s: h %.4f s, %s: %d steps not converged (residual %.2g), %d passing, gain %.2g%s\n",
                  first + k, to_string(scene.kind), scene.settings.time_step, scene.description.c_str(),
                  found.unconverged, found.residual_max, found.passing, found.energy_gain_share,
                  found.finite ? "" : ", not finite");
  });
  struct Sum {
    int scenes = 0, unsolved_scenes = 0, touching = 0, steps = 0, unsolved = 0, halved = 0, infinite = 0,
        passing = 0, gains = 0;
  };
  std::map<std::string, Sum> sums;
  for (std::size_t k = 0; k < count; ++k)
    for (const std::string& key : {std::string(to_string(kinds[k])), std::string("~ all")}) {
      Sum& sum = sums[key];
      ++sum.scenes;
      sum.unsolved_scenes += findings[k].unconverged > 0;
      sum.touching += findings[k].touching > 0;
      sum.steps += findings[k].steps;
      sum.unsolved += findings[k].unconverged;
      sum.halved += findings[k].halved;
      sum.infinite += !findings[k].finite;
      sum.passing += findings[k].passing > 0;
      sum.gains += findings[k].energy_gain_share > 1e-2;
    }
  std::printf("%-7s %7s %9s %9s | %6s %9s %7s | %10s %8s %7s\n", "kind", "scenes", "touching", "unsolved",
              "steps", "unsolved", "halved", "not finite", "passing", "energy");
  for (const auto& [key, sum] : sums)
    std::printf("%-7s %7d %9d %9d | %6d %9d %7d | %10d %8d %7d\n", key.c_str(), sum.scenes, sum.touching,
                sum.unsolved_scenes, sum.steps, sum.unsolved, sum.halved, sum.infinite, sum.passing,
                sum.gains);
}

/// What an observer finds in `count` random scenes of fast bodies.
void print_fast_scenes(unsigned long first, std::size_t count, bool list) {
  using namespace flash::sim;
  struct Sum {
    int scenes = 0, touching = 0, steps = 0, halved = 0, most_iterations = 0, unsolved_scenes = 0,
        unsolved = 0, infinite = 0, passing = 0, silent = 0, crossed = 0;
  };
  std::vector<FastFindings> findings(count);
  std::vector<FastSceneKind> kinds(count);
  flash::data::for_each_in_parallel(count, 0, [&](std::size_t k) {
    const RandomFastScene scene = random_fast_scene(first + k);
    const FastFindings found = findings[k] = observe(scene);
    kinds[k] = scene.kind;
    if (list && (found.unconverged > 0 || found.passing > 0 || found.crossed > 0 || !found.finite))
      std::printf(
          "%lu %s: %s: %d of %d steps not solved, %d parts of %d passing (%d told as solved), %d crossed%s\n",
          first + k, to_string(scene.kind), scene.description.c_str(), found.unconverged, found.steps,
          found.passing, found.parts, found.silent, found.crossed, found.finite ? "" : ", not finite");
  });
  std::map<std::string, Sum> sums;
  for (std::size_t k = 0; k < count; ++k)
    for (const std::string& key : {std::string(to_string(kinds[k])), std::string("~ all")}) {
      Sum& sum = sums[key];
      const FastFindings& found = findings[k];
      ++sum.scenes;
      sum.touching += found.touching > 0;
      sum.steps += found.steps;
      sum.halved += found.halved;
      sum.most_iterations = std::max(sum.most_iterations, found.most_iterations);
      sum.unsolved_scenes += found.unconverged > 0;
      sum.unsolved += found.unconverged;
      sum.infinite += !found.finite;
      sum.passing += found.passing > 0;
      sum.silent += found.silent > 0;
      sum.crossed += found.crossed > 0;
    }
  std::printf("%-13s %7s %9s %9s | %6s %7s %9s %11s | %10s %8s %11s %8s\n", "kind", "scenes", "touching",
              "unsolved", "steps", "halved", "unsolved", "iterations", "not finite", "passing", "in silence",
              "crossed");
  for (const auto& [key, sum] : sums)
    std::printf("%-13s %7d %9d %9d | %6d %7d %9d %11d | %10d %8d %11d %8d\n", key.c_str(), sum.scenes,
                sum.touching, sum.unsolved_scenes, sum.steps, sum.halved, sum.unsolved, sum.most_iterations,
                sum.infinite, sum.passing, sum.silent, sum.crossed);
}

}  // namespace

// What an observer finds in many random scenes, by kind and in all. Arguments: first seed, number of scenes,
// then --list to name those with something to say, --deep for sheets that start across obstacles, --solid for
// blocks of tetrahedra, --layers and a speed [m/s] for scenes whose surface meets itself, --fast for bodies
// that close at 1 to 40 m/s, --round and the
// share of boxes and cylinders that are capsules and spheres instead,
// --mesh and that of surfaces of triangles.
int main(int argc, char** argv) {
  using namespace flash;
  const unsigned long first = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 1;
  const std::size_t count = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 1000;
  bool list = false, deep = false, solid = false, fast = false;
  double layers = 0;
  sim::ShapeShares shares;
  for (int k = 3; k < argc; ++k) {
    list = list || std::string(argv[k]) == "--list";
    solid = solid || std::string(argv[k]) == "--solid";
    fast = fast || std::string(argv[k]) == "--fast";
    deep = deep || std::string(argv[k]) == "--deep";
    if (std::string(argv[k]) == "--layers" && k + 1 < argc) layers = std::strtod(argv[k + 1], nullptr);
    if (std::string(argv[k]) == "--round" && k + 1 < argc) shares.round = std::strtod(argv[k + 1], nullptr);
    if (std::string(argv[k]) == "--mesh" && k + 1 < argc) shares.meshes = std::strtod(argv[k + 1], nullptr);
  }

  if (fast) {
    print_fast_scenes(first, count, list);
    return 0;
  }
  if (layers > 0) {
    print_layer_scenes(first, count, layers, list);
    return 0;
  }
  std::vector<sim::RandomScene> scenes(count);
  std::vector<sim::SceneFindings> findings(count);
  data::for_each_in_parallel(count, 0, [&](std::size_t k) {
    scenes[k] = deep    ? sim::random_deep_start(first + k, shares)
                : solid ? sim::random_solid_scene(first + k, shares)
                        : sim::random_scene(first + k, shares);
    findings[k] = sim::observe(scenes[k]);
  });

  struct Sum {
    int scenes = 0, unsolved_scenes = 0, steps = 0, unsolved = 0, halved = 0;
    int infinite = 0, gains = 0, crossed = 0, unseen = 0;
    int left_inside = 0;
    double exit_speed = 0, shot_speed = 0, free_depth = 0;
  };
  std::map<std::string, Sum> sums;
  for (std::size_t k = 0; k < count; ++k) {
    const sim::SceneFindings& found = findings[k];
    const bool gains = found.energy_gain_share > 1e-2, unseen = found.unseen_depth > 1e-4;
    if (list && (found.unconverged > 0 || !found.finite || gains || found.crossed > 0 || unseen || deep))
      std::printf(
          "%lu %s: h %.4f s, %s: %d steps not converged (residual %.2g), energy gain %.2g, %d crossed, "
          "unseen %.2g m, %d inside, shot %.1f m/s%s\n",
          first + k, to_string(scenes[k].kind), scenes[k].settings.time_step, material_of(scenes[k]).c_str(),
          found.unconverged, found.residual_max, found.energy_gain_share, found.crossed, found.unseen_depth,
          found.inside, found.shot_speed, found.finite ? "" : ", not finite");
    for (const std::string& key : {std::string(to_string(scenes[k].kind)), std::string("~ all")}) {
      Sum& sum = sums[key];
      ++sum.scenes;
      sum.unsolved_scenes += found.unconverged > 0;
      sum.steps += found.steps;
      sum.unsolved += found.unconverged;
      sum.halved += found.halved;
      sum.infinite += !found.finite;
      sum.gains += gains;
      sum.crossed += found.crossed > 0;
      sum.unseen += unseen;
      if (found.unconverged == 0) sum.exit_speed = std::max(sum.exit_speed, found.exit_speed);
      sum.shot_speed = std::max(sum.shot_speed, found.shot_speed);
      sum.left_inside += found.inside > 0;
      sum.free_depth = std::max(sum.free_depth, found.free_depth);
    }
  }
  std::printf("%-7s %7s %9s | %6s %9s %7s | %10s %7s %8s %7s | %6s %9s %9s %9s\n", "kind", "scenes",
              "unsolved", "steps", "unsolved", "halved", "not finite", "energy", "crossed", "unseen",
              "inside", "exit m/s", "shot m/s", "depth m");
  for (const auto& [key, sum] : sums)
    std::printf("%-7s %7d %9d | %6d %9d %7d | %10d %7d %8d %7d | %6d %9.2f %9.2f %9.1g\n", key.c_str(),
                sum.scenes, sum.unsolved_scenes, sum.steps, sum.unsolved, sum.halved, sum.infinite, sum.gains,
                sum.crossed, sum.unseen, sum.left_inside, sum.exit_speed, sum.shot_speed, sum.free_depth);
}
