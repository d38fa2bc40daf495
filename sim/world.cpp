#include "sim/world.h"

#include <cmath>
#include <utility>

#include "data/files/text.h"

namespace flash::sim {

using Eigen::Vector3d;

namespace {

constexpr double never = std::numeric_limits<double>::infinity();

void clear_forces(World& world) {
  world.report.hold_forces.assign(world.environment.holds.size(), Vector3d::Zero());
  world.report.obstacle_forces.assign(world.environment.obstacles.size(), Vector3d::Zero());
}

/// A report of no step: `residual` is that of a start, or of a world that is lost.
void clear_report(World& world, double residual) {
  world.report = {};
  world.report.residual = residual;
  world.report.converged = residual == 0;
  clear_forces(world);
}

void lose(World& world, Lost lost, std::string why) {
  world.lost = lost;
  world.why_lost = std::move(why);
}

/// A hold that may miss, and does, stays open.
void open_what_misses(World& world) {
  for (std::size_t k = 0; k < world.may_miss.size(); ++k) {
    if (!world.may_miss[k]) continue;
    Hold& hold = world.environment.holds[k];
    if (hold.reach && !has_vertex_in_reach(world.environment, hold)) hold.to = -never;
    world.may_miss[k] = false;
  }
}

StepReport step_by_method(const std::shared_ptr<const SheetPlan>& plan, const WorldSettings& settings,
                          World& world) {
  if (settings.projective) {
    if (!world.projective) world.projective.emplace(plan, *settings.projective);
    return world.projective->step(world.environment);
  }
  if (!world.newton) world.newton.emplace(plan, settings.solver);
  if (settings.restart_interval > 0 && world.steps % settings.restart_interval == 0) world.newton->forget();
  return world.newton->step(world.environment);
}

}  // namespace

World make_world(Environment start, const WorldSettings& settings) {
  World world;
  world.start_state = start.state;
  world.start_holds = start.holds;
  world.plan = start.schedule;
  world.environment = std::move(start);
  reset(world, settings);
  return world;
}

World copy_of(const World& world) {
  World copy = world;
  if (copy.driven) {
    copy.driven->own_poses();
    copy.environment.schedule = copy.driven->schedule();
  }
  return copy;
}

void add_end_effector(World& world, const EndEffector& effector, std::shared_ptr<const Schedule> plan) {
  Environment& environment = world.environment;
  const int frame = static_cast<int>(plan->frames.size()) - 1;
  world.plan = std::move(plan);
  if (world.driven)
    world.driven->extend(world.plan, environment.state.time);
  else
    environment.schedule = world.plan;
  const Hold hold{.name = effector.name,
                  .frame = frame,
                  .from = never,
                  .reach = Reach{.half_extents = effector.half_extents, .threshold = effector.threshold}};
  for (std::vector<Hold>* holds : {&environment.holds, &world.start_holds}) holds->push_back(hold);
  world.may_miss.push_back(false);
  if (effector.collides) {
    Obstacle box{.shape = Box{.half_extents = effector.half_extents}, .name = effector.name, .frame = frame};
    if (effector.friction) box.friction.assign(environment.materials.size(), *effector.friction);
    environment.obstacles.push_back(std::move(box));
    for (State* state : {&environment.state, &world.start_state})
      if (state->bristles.rows() > 0)
        state->bristles.conservativeResizeLike(
            data::Points::Zero(state->bristles.rows() + state->positions.rows(), 3));
  }
  clear_forces(world);
}

void set_pose(World& world, int frame, const Eigen::Isometry3d& pose, double time_step) {
  if (!world.driven) {
    world.driven.emplace(world.plan, world.environment.state.time, time_step);
    world.environment.schedule = world.driven->schedule();
  }
  world.driven->set(frame, pose);
}

void grasp(World& world, int hold, const Grasp& grasp) {
  const auto k = static_cast<std::size_t>(hold);
  State& state = world.environment.state;
  Hold& closing = world.environment.holds[k];
  state.held.resize(world.environment.holds.size());
  const bool carries = !state.held[k].vertices.empty() && closing.to > state.time;
  closing.to = never;
  if (carries) return;
  state.held[k] = {};
  closing.from = -never;
  if (!grasp.vertices.empty() || grasp.reach) {
    closing.vertices = grasp.vertices;
    closing.reach = grasp.reach;
  }
  world.may_miss[k] = grasp.may_miss;
}

void release(World& world, int hold) {
  world.environment.holds[static_cast<std::size_t>(hold)].to = -never;
  world.may_miss[static_cast<std::size_t>(hold)] = false;
}

void reset(World& world, const WorldSettings& settings) {
  world.environment.state = world.start_state;
  world.environment.holds = world.start_holds;
  world.environment.schedule = world.plan;
  world.driven.reset();
  world.may_miss.assign(world.start_holds.size(), false);
  world.newton.reset();
  world.projective.reset();
  world.steps = settings.first_step;
  lose(world, Lost::no, {});
  clear_report(world, 0);
}

void skip_step(World& world) { clear_report(world, never); }

void begin_step(World& world) {
  if (world.driven) world.driven->begin_step(world.environment.state.time);
  open_what_misses(world);
}

void end_step(World& world, const WorldSettings& settings, StepReport report, double start, bool finite) {
  world.report = std::move(report);
  ++world.steps;
  const auto at = [&] { return " in the step from " + data::format_short(start) + " s"; };
  if (!std::isfinite(world.report.residual) || !finite)
    lose(world, Lost::not_finite, "positions are not finite any more" + at());
  else if (world.report.residual > settings.lost_residual)
    lose(world, Lost::not_solved,
         "forces stay out of balance" + at() + ": found a residual of " +
             data::format_short(world.report.residual) + ", expected at most " +
             data::format_short(settings.lost_residual));
}

bool goes_on(World& world, const std::function<void()>& attempt) {
  try {
    attempt();
    return true;
  } catch (const MissedGrasp& error) {
    lose(world, Lost::no_vertex_in_reach, error.what());
  } catch (const data::InputError& error) {
    lose(world, Lost::refused, error.what());
  }
  skip_step(world);
  return false;
}

void take_step(const std::shared_ptr<const SheetPlan>& plan, const WorldSettings& settings, World& world) {
  if (world.lost != Lost::no) return skip_step(world);
  const double start = world.environment.state.time;
  StepReport report;
  const bool taken = goes_on(world, [&] {
    begin_step(world);
    report = step_by_method(plan, settings, world);
  });
  if (taken)
    end_step(world, settings, std::move(report), start, world.environment.state.positions.allFinite());
}

std::vector<ContactForce> contacts_of(const World& world) {
  return world.newton       ? world.newton->contacts(world.environment)
         : world.projective ? world.projective->contacts(world.environment)
                            : std::vector<ContactForce>();
}

}  // namespace flash::sim
