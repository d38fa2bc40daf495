#include "sim/cuda/replay_checks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>

#include "sim/cuda/layout/front_layout.h"
#include "sim/cuda/most_obstacles.h"
#include "sim/newton/step_numbers.h"

namespace flash::sim::cuda {

namespace {

/// That each spring has a vertex, a hold and a stiffness.
void check_springs(const ReplayEnvironment& environment, const ReplaySettings& settings, int vertices) {
  if (environment.springs == nullptr) return;
  require(std::ssize(*environment.springs) >= settings.steps - settings.first_step,
          "springs have to be given for each step");
  const auto is_there = [](int number, std::ptrdiff_t count) { return number >= 0 && number < count; };
  for (const std::vector<SpringMotion>& step : *environment.springs)
    for (const SpringMotion& spring : step) {
      require(is_there(spring.vertex, vertices) && is_there(spring.hold, environment.hold_count) &&
                  is_there(spring.entry, std::ssize(environment.stiffness)),
              "a spring's vertex, hold or stiffness");
      const double stiffness = environment.stiffness[static_cast<std::size_t>(spring.entry)];
      require(std::isfinite(stiffness) && stiffness >= 0, "a spring's stiffness has to be zero or more");
    }
}

}  // namespace

void require(bool met, const char* what) {
  if (!met) throw std::invalid_argument(std::string("replay: ") + what);
}

void check_replay(const SheetPlan& plan, const std::vector<ReplayEnvironment>& environments,
                  const ReplaySettings& settings) {
  require(settings.first_step >= 0 && settings.steps >= settings.first_step,
          "the steps have to ascend from first_step to steps");
  require(!environments.empty(), "no environments");
  require(settings.restart_interval >= 0, "restart_interval has to be positive");
  require(settings.team_blocks >= 0 && settings.team_blocks <= most_team_blocks &&
              (settings.team_blocks & (settings.team_blocks - 1)) == 0,
          "team_blocks have to be 0, 1, 2, 4 or 8");
  require(settings.halvings >= 0 && settings.halvings <= most_halvings,
          "halvings have to lie between 0 and 16");
  const std::vector<int>& kept = settings.kept_steps;
  require(std::adjacent_find(kept.begin(), kept.end(), std::greater_equal<>()) == kept.end(),
          "kept_steps have to ascend");
  require(kept.empty() || (kept.front() >= settings.first_step && kept.back() <= settings.steps),
          "kept_steps have to lie between first_step and steps");
  const int size = plan.pattern.size;
  for (const ReplayEnvironment& e : environments) {
    require(e.positions.rows() == size && e.velocities.rows() == size,
            "every environment needs a position and a velocity for each vertex");
    require(e.bristles.rows() == 0 || e.bristles.rows() == size * std::ssize(e.obstacles),
            "bristles for each vertex on each obstacle, or none");
    require(e.holds == nullptr || std::ssize(*e.holds) >= settings.steps - settings.first_step,
            "what is held has to be given for each step");
    require(e.hold_count == environments.front().hold_count, "all environments need as many holds");
    check_springs(e, settings, size);
    require(e.obstacles.size() <= most_obstacles, "an environment may have 8 obstacles");
    for (const Obstacle& obstacle : e.obstacles)
      require(obstacle.frame == base_frame || (e.schedule != nullptr && obstacle.frame >= 0 &&
                                               obstacle.frame < std::ssize(e.schedule->frames)),
              "an obstacle names a frame that the schedule does not have");
    for (const Load& load : e.loads) require(load.vertex >= 0 && load.vertex < size, "a load's vertex");
  }
}

}  // namespace flash::sim::cuda
