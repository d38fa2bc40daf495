#include "sim/newton/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sim/law/feasible_place.h"
#include "sim/newton/newton_iteration.h"
#include "sim/newton/step_end.h"
#include "sim/pairs/candidate_pairs.h"
#include "sim/pairs/intersection.h"
#include "sim/step/exits.h"
#include "sim/step/feasible_positions.h"
#include "sim/step/hinge_energy.h"

namespace flash::sim {

using data::Points;

namespace {

constexpr int most_portions = 20;      ///< in which holds arrive where layers are in their way
constexpr int portion_iterations = 5;  ///< by which the surface makes way after each of them

/// Elastic energy at the start of the step; as a rule the last step computed it.
ElasticEnergy elastic_energy_at_start(const StepProblem& problem, const NewtonWorkspace& w) {
  const Environment& environment = problem.contacts.environment;
  const Points& start = environment.state.positions;
  if (w.now.materials == environment.materials && w.now.solids == environment.solids &&
      w.now.rest_angles == environment.state.rest_angles && w.now.positions.rows() == start.rows() &&
      w.now.positions == start && !(problem.layers && problem.layers->has_other_pairs()))
    return w.now.elastic;
  Points force = Points::Zero(start.rows(), 3);
  ElasticEnergy elastic;
  for (const BodyLaw& law : problem.laws) elastic += add_elastic_gradient(*w.plan, law, start, force);
  if (problem.layers) elastic.layers = problem.layers->energy(start);
  return elastic;
}

/// Where speeds and springs take the vertices in a `share` of the step, and what holds carry all the same.
void advance_freely(const StepProblem& problem, double share, Iterate& to) {
  const State& start = problem.contacts.environment.state;
  to.positions = start.positions + share * problem.contacts.time_step * start.velocities;
  problem.potential.pull(share, to.positions);
  to.contacts = begin_step(problem.contacts, to.positions);
  project_to_feasible(problem.contacts, to.contacts, to.positions);
}

/// Fills in w.now where the search for the end of the step starts: where speeds take the vertices, or as far
/// as they do not take the surface through itself. Where holds alone would, it is the start of the step, and
/// false is returned.
bool start_search(const StepProblem& problem, NewtonWorkspace& w) {
  constexpr int most_cuts = 8;
  const Points& start = problem.contacts.environment.state.positions;
  advance_freely(problem, 1, w.now);
  bool free = true;
  if (problem.layers) {
    double share = problem.layers->free_share(start, w.now.positions), part = share;
    for (int cut = 0; share < 1 && cut <= most_cuts; ++cut) {
      if (cut == most_cuts) part = 0;
      advance_freely(problem, part, w.now);
      share = problem.layers->free_share(start, w.now.positions);
      part *= share;
    }
    free = share == 1;
    if (!free) w.now.positions = start;
  }
  problem.evaluate(w.now);
  return free;
}

constexpr double crushed_share = 1e-6;  ///< of the thickness, below which no force keeps layers apart

/// Whether holds have squeezed layers to such a distance.
bool crushed(const Environment& environment, double layer_distance) {
  return environment.self_contact && layer_distance < crushed_share * environment.self_contact->thickness;
}

/// Whether obstacles leave layers no room, by less than a thickness: shorter steps would end nearly there.
bool squeezed(const Environment& environment, const Penetration& no_room) {
  return environment.self_contact && no_room.depth > 0 && no_room.depth < environment.self_contact->thickness;
}

/// Each way of the search is free of layers that meet, but together they may lead round a body that is in the
/// straight way. Where they do, w.now becomes `before`, to which that way is free. Returns whether it was.
bool go_straight(const StepProblem& problem, const Points& before, NewtonWorkspace& w) {
  if (problem.layers->is_free(problem.contacts.environment.state.positions, w.now.positions)) return true;
  w.now.positions = before;
  problem.evaluate(w.now);
  return false;
}

/// Solves one step of `h` as a whole: w.now is its end. Returns whether it is as good as halves would be:
/// solved, or to all that rounding allows.
bool solve_step(const StepProblem& problem, NewtonWorkspace& w, StepReport& report) {
  const ElasticEnergy elastic_at_start = elastic_energy_at_start(problem, w);
  bool free = start_search(problem, w);
  const Points searched_from = problem.layers ? w.now.positions : Points();
  for (int portion = 0; !free && portion < most_portions; ++portion) {
    if (crushed(problem.contacts.environment, w.now.layers.closest)) break;
    iterate_to_balance(problem, portion_iterations, w, report);
    free = carry_on(problem, w, report);
  }
  iterate_to_balance(problem, w.settings.max_iterations, w, report);
  if (problem.layers && w.now.positions != searched_from)
    free = go_straight(problem, searched_from, w) && free;

  report.residual = problem.relative_residual(w.now);
  report_contacts(problem, w.now, report);
  const bool energy_is_sound = account_for_energy(problem, elastic_at_start, w.now, report);
  const bool sound = free && is_complementary(report.complementarity) && energy_is_sound;
  report.converged = sound && problem.balanced(w.now, w.settings.tolerance);
  return sound && problem.balanced(w.now, std::max(w.settings.tolerance, rounding_tolerance));
}

/// One step of `h` as a whole; environment.state advances in any case. A sheet that starts inside obstacles
/// takes the first exit that does not tear it. Returns whether the step is solved.
bool try_step(Environment& environment, double h, NewtonWorkspace& w, StepReport& report) {
  const double exit_speed = w.settings.exit_speed;
  LayerMemory* layers = environment.self_contact ? &*w.layers : nullptr;
  const StepProblem problem(*w.plan, environment, h, {.speed = exit_speed}, layers);
  bool solved = solve_step(problem, w, report);
  if (report.start_penetration.depth > 0) {
    const auto inside = vertices_inside(problem.contacts, w.now.contacts);
    const std::vector<WayOut<double>> exits = exits_of(problem.contacts, inside);
    for (size_t k = 1; k < exits.size(); ++k) {
      if (solved && exits_gently(problem.contacts, *w.plan, inside, w.now.positions)) break;
      // A slower exit does not help an unsolved step, which costs the most: only staying is tried.
      if (!solved && k > 1) k = exits.size() - 1;
      const StepReport given_up = std::exchange(report, {});
      w.refactor = true;
      solved = solve_step(StepProblem(*w.plan, environment, h, exits[k], layers), w, report);
      add_work(given_up, report);
    }
  }
  environment.state.time += h;
  if (!w.now.positions.allFinite()) {
    // A sheet that is not finite stands still instead, and the report says so.
    report.residual = std::numeric_limits<double>::infinity();
    environment.state.velocities.setZero();
    report.converged = false;
    return false;
  }
  environment.state.velocities = (w.now.positions - environment.state.positions) / h;
  HingeFlow flow = hinge_flow(*w.plan, problem.laws, environment.state, w.now.positions);
  environment.state.rest_angles = std::move(flow.rest_angles);
  report.bending -= flow.lost;
  report.yielding = flow.lost;
  environment.state.bristles = bristles_at_end(problem.contacts, w.now.contacts, w.now.positions);
  if (problem.layers) environment.state.pair_bristles = problem.layers->bristles_at_end(w.now.layers);
  environment.state.positions = w.now.positions;
  return solved;
}

/// One step of `h`, in halves where it cannot be solved as a whole, `halvings` times still. Once a half has
/// failed the other is not divided any more: the step has not converged anyway. Nor do shorter steps help
/// layers that holds have crushed, or what obstacles have squeezed.
StepReport advance(Environment& environment, double h, int halvings, NewtonWorkspace& w) {
  const State start = environment.state;
  StepReport report;
  const auto take_it = [&] {
    if (w.settings.part) w.settings.part(environment.state);
    return report;
  };
  if (try_step(environment, h, w, report)) return take_it();
  w.refactor = true;
  const bool stopped = w.settings.stop != nullptr && *w.settings.stop;
  const bool in_vain = crushed(environment, report.layer_distance) || squeezed(environment, report.no_room);
  if (halvings <= 0 || stopped || in_vain) return take_it();
  const State whole = std::exchange(environment.state, start);
  const StepReport first = advance(environment, 0.5 * h, halvings - 1, w);
  StepReport parts = joined(first, advance(environment, 0.5 * h, first.converged ? halvings - 1 : 0, w));
  environment.state.time = whole.time;
  add_work(report, parts);
  return parts;
}

/// How often a step may be halved: where layers meet, until nothing that is as fast as at its start goes
/// farther in a part than their thickness.
int halvings_of(const Environment& environment, const SolverSettings& settings) {
  constexpr double most_parts = 4096;
  if (!environment.self_contact || settings.halvings <= 0) return settings.halvings;
  const double way = settings.time_step * environment.state.velocities.rowwise().norm().maxCoeff();
  if (!std::isfinite(way)) return settings.halvings;
  const double parts = std::clamp(way / environment.self_contact->thickness, 1.0, most_parts);
  return std::max(settings.halvings, static_cast<int>(std::ceil(std::log2(parts))));
}

/// Layers thicker than the cells of a mesh would meet their own neighbours.
void check_thickness(const Sheet& sheet, const PairSurface& surface, double thickness) {
  for (std::size_t b = 0; b < sheet.bodies.size(); ++b) {
    double sum = 0;
    int count = 0;
    for (const auto& [i, j] : surface.edges) {
      if (surface.body[static_cast<std::size_t>(i)] != static_cast<int>(b)) continue;
      sum += (surface.rest.row(i) - surface.rest.row(j)).norm();
      ++count;
    }
    const std::string& name = sheet.bodies[b].name;
    if (thickness * count >= sum)
      throw data::input_error("self_contact", "thickness",
                              "found " + data::format_short(thickness) + " m, expected less than " +
                                  data::format_short(sum / count) + " m, the mean edge of the mesh" +
                                  (name.empty() ? "" : " of " + name));
  }
}

/// Vertices that holds carry rigidly in all axes.
std::vector<bool> carried_vertices(const Environment& environment) {
  Eigen::Array<bool, Eigen::Dynamic, 3> held(environment.state.positions.rows(), 3);
  held.setConstant(false);
  for (std::size_t k = 0; k < environment.state.held.size(); ++k) {
    const Hold& hold = environment.holds[k];
    const std::vector<int>& vertices = environment.state.held[k].vertices;
    for (std::size_t v = 0; v < vertices.size(); ++v)
      for (std::size_t axis = 0; axis < 3 && is_rigid(hold, v); ++axis)
        held(vertices[v], static_cast<Eigen::Index>(axis)) |= hold.axes[axis];
  }
  std::vector<bool> carried;
  for (Eigen::Index i = 0; i < held.rows(); ++i) carried.push_back(held.row(i).all());
  return carried;
}

/// Between layers that start in one place no force can say which is above.
void check_apart(const Sheet& sheet, PairSurface& surface, const Environment& environment) {
  const Points& positions = environment.state.positions;
  const double least = crushed_share * environment.self_contact->thickness;
  std::vector<Bounds> boxes;
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    const Eigen::Array3d place = positions.row(i).transpose().array();
    boxes.push_back({place, place});
  }
  std::vector<CandidatePair> pairs;
  find_candidates(surface, boxes, least, carried_vertices(environment), pairs);
  for (const CandidatePair& pair : pairs) {
    Vector3<double> x[4];
    for (int k = 0; k < 4; ++k) {
      const auto at = positions.row(pair.vertices[static_cast<std::size_t>(k)]);
      x[k] = {at[0], at[1], at[2]};
    }
    const double distance = nearest_points(pair.kind, x).distance;
    if (distance >= least) continue;
    const auto name_of = [&](int vertex) {
      const Body& body = sheet.bodies[static_cast<std::size_t>(body_of(sheet, vertex))];
      return "vertex " + std::to_string(vertex - body.first_vertex) +
             (body.name.empty() ? "" : " of " + body.name);
    };
    throw data::input_error(
        "self_contact", "start",
        "found the surface at " + name_of(pair.vertices[0]) + " " + data::format_short(distance) +
            " m from that at " + name_of(pair.vertices[pair.kind == PairKind::vertex_face ? 1 : 2]) +
            ", expected at least " + data::format_short(least) + " m: layers in one place cannot part; " +
            (pair.thickness < least ? "join the vertices there (flash-sim mesh)"
                                    : "start them a thickness apart"));
  }
}

/// Layers that start on both sides of each other would stay so, and so would a body inside a solid.
void check_start(const Sheet& sheet, PairSurface& surface, const Points& positions) {
  if (const auto passing = first_intersection(surface, positions)) {
    const auto name_of = [&](int triangle) {
      const Body& body = sheet.bodies[static_cast<size_t>(body_of(sheet, surface.triangles(triangle, 0)))];
      const int first = body.is_solid() ? 0 : body.first_triangle;
      return "triangle " + std::to_string(triangle - first) + (body.name.empty() ? "" : " of " + body.name);
    };
    throw data::input_error("self_contact", "start",
                            "found " + name_of(passing->first) + " passing through " +
                                name_of(passing->second) +
                                ", expected a surface that does not pass through itself");
  }
  if (const auto enclosed = first_enclosed(sheet, surface, positions))
    throw data::input_error("self_contact", "start",
                            "found " + sheet.bodies[static_cast<size_t>(enclosed->first)].name +
                                " wholly inside " + sheet.bodies[static_cast<size_t>(enclosed->second)].name +
                                ", expected it outside: surfaces alone meet, so that it would stay there");
}

}  // namespace

Solver::Solver(std::shared_ptr<const SheetPlan> plan, const SolverSettings& settings)
    : workspace_(std::make_unique<NewtonWorkspace>(std::move(plan), settings)) {}
Solver::Solver(const Sheet& sheet, const SolverSettings& settings)
    : Solver(make_sheet_plan(sheet), settings) {}
Solver::~Solver() = default;
Solver::Solver(const Solver& other) : workspace_(std::make_unique<NewtonWorkspace>(*other.workspace_)) {}
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver other) noexcept {
  workspace_ = std::move(other.workspace_);
  return *this;
}

StepReport Solver::step(Environment& environment) {
  NewtonWorkspace& w = *workspace_;
  const double h = w.settings.time_step;
  update_holds(environment, environment.state.time + h);
  if (environment.self_contact && !w.layers) {
    w.layers.emplace(w.plan->sheet);
    check_thickness(w.plan->sheet, w.layers->surface, environment.self_contact->thickness);
    check_start(w.plan->sheet, w.layers->surface, environment.state.positions);
    check_apart(w.plan->sheet, w.layers->surface, environment);
  }
  return advance(environment, h, halvings_of(environment, w.settings), w);
}

std::vector<ContactForce> Solver::contacts(const Environment& environment) const {
  const Iterate& end = workspace_->now;
  // Forces of an iterate that is not finite are none.
  if (!end.positions.allFinite()) return {};
  return contacts_of(workspace_->plan->sheet, environment, end.positions, end.contacts, end.layers);
}

void check_self_contact(const Sheet& sheet, double thickness, const Points& positions) {
  PairSurface surface(sheet);
  check_thickness(sheet, surface, thickness);
  check_start(sheet, surface, positions);
}

void Solver::forget() { workspace_->refactor = true; }

}  // namespace flash::sim
