#include "sim/oracle/projective.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <list>
#include <map>
#include <utility>

#include "data/files/error.h"
#include "sim/oracle/anderson.h"
#include "sim/oracle/projective_contact.h"
#include "sim/step/feasible_positions.h"
#include "sim/step/incremental_potential.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

Eigen::Map<const VectorXd> flat(const Points& x) { return {x.data(), x.size()}; }

}  // namespace

struct ProjectiveSolver::Workspace {
  std::shared_ptr<const SheetPlan> plan;
  ProjectiveSettings settings;
  std::list<std::pair<std::vector<data::SheetMaterial>, ProjectiveSystem>> systems;
  std::vector<ProjectiveContact> contacts;  ///< of the end of the last step
  VectorXd multiplier;                      ///< theirs

  Workspace(std::shared_ptr<const SheetPlan> plan_in, const ProjectiveSettings& settings_in)
      : plan(std::move(plan_in)), settings(settings_in) {}
  /// Systems are of materials alone, and made anew.
  Workspace(const Workspace& other)
      : plan(other.plan), settings(other.settings), contacts(other.contacts), multiplier(other.multiplier) {}

  ProjectiveSystem& system_of(const std::vector<data::SheetMaterial>& materials) {
    for (auto& [known, system] : systems)
      if (known == materials) return system;
    systems.emplace_back(materials, ProjectiveSystem(*plan, materials, settings.time_step));
    return systems.back().second;
  }
};

namespace {

/// The law of the contacts at an iterate, gaps linear in the multipliers: with dx = -h^2 A^-1 (force - H^T
/// lambda) from the multipliers at hand, and W for a change of them.
ContactProblem contact_problem(const std::vector<ProjectiveContact>& contacts, const ProjectiveSystem& system,
                               const ProjectiveSettings& settings, ContactMetric metric, const Points& force,
                               const VectorXd& multiplier) {
  const double h = settings.time_step;
  const Index n = force.rows();
  ContactProblem problem;
  problem.time_step = h;
  if (metric == ContactMetric::inertia) {
    const VectorXd inverse_mass = system.mass().cwiseInverse();
    problem.diagonal.resize(3 * contacts.size());
    for (std::size_t k = 0; k < contacts.size(); ++k)
      problem.diagonal.segment<3>(3 * k).setConstant(inverse_mass[contacts[k].vertex]);
    problem.apply_W = [&contacts, inverse_mass, n](const VectorXd& l, VectorXd& w) {
      w = along_contacts(contacts, inverse_mass.asDiagonal() * contact_forces(contacts, l, n));
    };
  } else if (static_cast<int>(contacts.size()) <= settings.dense_contacts &&
             settings.constraints.linear.solver != DualSolver::matrix_free) {
    problem.W = full_metric(contacts, system);
  } else {
    problem.diagonal = full_metric_diagonal(contacts, system);
    problem.apply_W = [&contacts, &system, n](const VectorXd& l, VectorXd& w) {
      w = along_contacts(contacts, system.solve(contact_forces(contacts, l, n)));
    };
  }
  problem.friction.resize(contacts.size());
  problem.free_gap =
      along_contacts(contacts, system.solve(-h * h * (force - contact_forces(contacts, multiplier, n))));
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    problem.friction[k] = contacts[k].friction;
    problem.free_gap.segment<3>(3 * k) += contacts[k].gap;
  }
  VectorXd known(multiplier.size());
  if (problem.W.size() > 0)
    known = problem.W * multiplier;
  else
    problem.apply_W(multiplier, known);
  problem.free_gap -= h * h * known;
  return problem;
}

/// Whether each contact moves its own vertex alone, so that the inertia metric is close to the full one.
bool carries_itself(const std::vector<ProjectiveContact>& contacts, const ProjectiveSystem& system) {
  return std::all_of(contacts.begin(), contacts.end(), [&](const ProjectiveContact& contact) {
    return system.mass()[contact.vertex] * system.inverse(contact.vertex, contact.vertex).maxCoeff() >= 0.5;
  });
}

/// What the inertia metric leaves when one contact vertex carries `carried` of them: N_s g h^2 / K of
/// penetration, N_s g h / K of creep.
std::string inertia_warning(double carried, double gravity, const ProjectiveSettings& settings) {
  const double creep = carried * gravity * settings.time_step / settings.iterations;
  char text[200];
  std::snprintf(text, sizeof text,
                "contact metric inertia: %.1f vertices carried per contact vertex leave about %.2g m of "
                "penetration and "
                "%.2g m/s of creep; use metric full",
                carried, creep * settings.time_step, creep);
  return text;
}

/// Forces of holds and obstacles, and how well the contacts are met. `needed`: from the holds [N].
void report_forces(const Environment& environment, const ProjectiveSettings& settings,
                   const ContactSet& holds, const std::vector<ProjectiveContact>& contacts,
                   const VectorXd& multiplier, const Points& needed, ProjectiveReport& report) {
  report.hold_forces.assign(environment.holds.size(), Vector3d::Zero());
  report.obstacle_forces.assign(environment.obstacles.size(), Vector3d::Zero());
  for (const VertexConstraint& held : holds.constraints)
    add_hold_forces(held, vector3(needed, held.vertex), report.hold_forces);
  std::size_t loaded = 0;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ProjectiveContact& contact = contacts[k];
    const Vector3d l = multiplier.segment<3>(3 * k);
    report.obstacle_forces[contact.obstacle] += contact.directions.transpose() * l;
    report.penetration_max = std::max(report.penetration_max, -contact.gap[0]);
    report.cone_violation = std::max(report.cone_violation, l.tail<2>().norm() - contact.friction * l[0]);
    if (l[0] == 0) continue;
    ++loaded;
    report.complementarity = std::max(report.complementarity, std::abs(contact.gap[0]));
  }
  report.contacts = static_cast<int>(contacts.size());
  const auto vertices = static_cast<std::size_t>(needed.rows());
  if (report.metric == ContactMetric::inertia && loaded > 0 && vertices > 2 * loaded)
    report.warning = inertia_warning(static_cast<double>(vertices) / static_cast<double>(loaded),
                                     environment.gravity.norm(), settings);
}

}  // namespace

ProjectiveSolver::ProjectiveSolver(const Sheet& sheet, const ProjectiveSettings& settings)
    : ProjectiveSolver(make_sheet_plan(sheet), settings) {}
ProjectiveSolver::ProjectiveSolver(std::shared_ptr<const SheetPlan> plan, const ProjectiveSettings& settings)
    : workspace_(std::make_unique<Workspace>(std::move(plan), settings)) {}
ProjectiveSolver::~ProjectiveSolver() = default;
ProjectiveSolver::ProjectiveSolver(const ProjectiveSolver& other)
    : workspace_(std::make_unique<Workspace>(*other.workspace_)) {}
ProjectiveSolver::ProjectiveSolver(ProjectiveSolver&&) noexcept = default;
ProjectiveSolver& ProjectiveSolver::operator=(ProjectiveSolver other) noexcept {
  workspace_ = std::move(other.workspace_);
  return *this;
}

ProjectiveReport ProjectiveSolver::step(Environment& environment) {
  Workspace& w = *workspace_;
  const ProjectiveSettings& settings = w.settings;
  const double h = settings.time_step, time = environment.state.time + h;
  if (const Hold* soft = first_soft_hold(environment))
    throw data::input_error("hold " + soft->name, "stiffness",
                            "the projective method knows rigid holds alone; use Newton's");
  const std::vector<BodyLaw> laws = body_laws(*w.plan, environment);
  ProjectiveSystem& system = w.system_of(environment.materials);
  update_holds(environment, time);
  const IncrementalPotential step(*w.plan, laws, environment, h);

  Points x = environment.state.positions + h * environment.state.velocities;
  const ContactStep contact_step(w.plan->sheet, environment, h,
                                 {.speed = std::numeric_limits<double>::infinity()});
  const ContactSet holds = begin_step(contact_step, x);
  project_to_feasible(contact_step, holds, x);
  const Index n = x.rows();
  std::vector<Vector3d> free_axes(n, Vector3d::Ones());
  std::array<std::vector<int>, 3> held;
  for (const VertexConstraint& hold : holds.constraints) {
    free_axes[hold.vertex] = {hold.free.xx, hold.free.yy, hold.free.zz};
    for (int axis = 0; axis < 3; ++axis)
      if (hold.free.at(axis, axis) == 0) held[axis].push_back(hold.vertex);
  }
  system.hold(held);
  const double gravity = environment.gravity.norm() > 0 ? environment.gravity.norm() : 9.81;
  const double force_scale = system.mass().norm() * gravity;

  ProjectiveReport report;
  report.metric = ContactMetric::inertia;
  Anderson anderson(settings.acceleration);
  std::map<std::pair<int, int>, Vector3d> known;  // multipliers of the last iteration, to start the next from
  std::vector<ProjectiveContact> contacts;
  VectorXd multiplier;
  Points force, residual, plain;
  Points reaction = Points::Zero(n, 3);
  double bound = 0;  // on the potential of an accelerated iterate
  bool accelerated = false;
  for (;; ++report.iterations) {
    ElasticEnergy elastic;
    const double potential = step.evaluate(x, force, elastic);
    // The plain iteration lowers the potential of the step, contact forces frozen, because A bounds its
    // curvature; an accelerated iterate that raises it is taken back. A guard by the residual would not do:
    // on the way through a buckle the residual has to rise.
    const double there = potential + contact_potential(environment, time, h, contacts, multiplier, x);
    if (accelerated && report.iterations < settings.iterations && !(there <= bound)) {
      anderson.reset();
      x = plain;
      accelerated = false;
      continue;
    }
    const Points free_motion = system.solve(-h * h * (force - reaction));
    contacts = find_contacts(w.plan->sheet, environment, time, h, x,
                             2 * free_motion.rowwise().norm() + VectorXd::Constant(n, 1e-6), free_axes,
                             settings.tangent_angle);
    multiplier = VectorXd::Zero(3 * contacts.size());
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const auto found = known.find({contacts[k].vertex, contacts[k].obstacle});
      if (found != known.end()) multiplier.segment<3>(3 * k) = contacts[k].directions * found->second;
    }
    if (settings.metric != ContactMetric::automatic)
      report.metric = settings.metric;
    else if (!carries_itself(contacts, system))
      report.metric = ContactMetric::full;  // for the rest of the step
    double violation = 0;
    if (!contacts.empty()) {
      const ContactProblem problem =
          contact_problem(contacts, system, settings, report.metric, force, multiplier);
      // The multipliers are solved as exactly as this iteration deserves: to a part of the way still to go.
      ConstraintSettings inner = settings.constraints;
      inner.tolerance = std::max(inner.tolerance, 1e-3 * free_motion.rowwise().norm().maxCoeff());
      if (problem.W.size() == 0) inner.linear.tolerance = std::max(inner.linear.tolerance, 1e-3);
      const ConstraintReport solved = solve_contacts(problem, inner, multiplier);
      report.constraint_iterations += solved.iterations;
      VectorXd gap(multiplier.size());
      for (std::size_t k = 0; k < contacts.size(); ++k) gap.segment<3>(3 * k) = contacts[k].gap;
      violation = contact_violation(problem, gap, multiplier);
    }
    reaction = contact_forces(contacts, multiplier, n);
    known.clear();
    for (std::size_t k = 0; k < contacts.size(); ++k)
      known[{contacts[k].vertex, contacts[k].obstacle}] =
          contacts[k].directions.transpose() * multiplier.segment<3>(3 * k);

    residual = force - reaction;
    for (Index i = 0; i < n; ++i) residual.row(i).array() *= free_axes[i].transpose().array();
    const Points motion = system.solve(-h * h * residual);
    report.residual = residual.norm() / force_scale;
    report.membrane = elastic.membrane;
    report.bending = elastic.bending;
    report.converged = report.residual <= settings.tolerance && violation <= settings.contact_tolerance;
    report.solves += 1;
    if (report.converged || report.iterations == settings.iterations) break;

    const double here = potential + contact_potential(environment, time, h, contacts, multiplier, x);
    bound = here + 1e-13 * std::abs(here);
    plain = x + motion;
    if (report.metric == ContactMetric::inertia && !contacts.empty()) {
      x = plain;
    } else {
      x = Eigen::Map<const Points>(anderson.next(flat(x), flat(motion)).data(), n, 3);
      accelerated = settings.acceleration > 0;
    }
  }

  report_forces(environment, settings, holds, contacts, multiplier, force - reaction, report);
  w.contacts = std::move(contacts);
  w.multiplier = std::move(multiplier);
  environment.state.velocities = (x - environment.state.positions) / h;
  environment.state.positions = x;
  environment.state.time = time;
  const Points& v = environment.state.velocities;
  report.kinetic = 0.5 * (system.mass().asDiagonal() * v).cwiseProduct(v).sum();
  report.gravitational = -(system.mass().transpose() * x * environment.gravity)(0);
  return report;
}

std::vector<ContactForce> ProjectiveSolver::contacts(const Environment& environment) const {
  const Workspace& w = *workspace_;
  std::vector<ContactForce> all;
  for (std::size_t k = 0; k < w.contacts.size(); ++k) {
    const ProjectiveContact& touch = w.contacts[k];
    const Vector3d l = w.multiplier.segment<3>(3 * static_cast<Index>(k));
    if (l[0] == 0) continue;
    ContactForce contact{.body = body_of(w.plan->sheet, touch.vertex),
                         .other = touch.obstacle,
                         .vertices = {touch.vertex, -1, -1, -1}};
    contact.point = contact.other_point = environment.state.positions.row(touch.vertex).transpose();
    contact.normal = touch.directions.row(0).transpose();
    contact.normal_force = l[0];
    contact.friction = touch.directions.bottomRows<2>().transpose() * l.tail<2>();
    all.push_back(contact);
  }
  return all;
}

}  // namespace flash::sim
