#include "sysid/infer/estimate_errors.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "data/files/text.h"
#include "sysid/infer/held.h"
#include "sysid/infer/solution_errors.h"
#include "sysid/infer/verdict.h"
#include "sysid/infer/weight_scale.h"

namespace flash::sysid {
namespace {

/// Over the last step to cells of no size: how unsure it is. Theory: an error of first order ends at a share
/// of 2, one of second order at 4/3.
constexpr double kUnsure = 2;

/// Of the standard deviation assumed of what is held: what the recordings tell better than so is named.
/// Chosen: not varied.
constexpr double kFarBetter = 0.25;

bool all_finite(const std::vector<ReplayResult>& results) {
  return std::all_of(results.begin(), results.end(),
                     [](const ReplayResult& result) { return result.finite; });
}

/// Motions of the estimate on both meshes, as far as the emulator has them.
std::vector<WantedMotion> wanted_at(const Task& task, const Emulator& emulator,
                                    const ReplayCandidate& candidate) {
  std::vector<WantedMotion> wanted;
  for (std::size_t r = 0; r < task.replays.size(); ++r) {
    wanted.push_back({&task.replays[r], candidate});
    if (emulator.share != own_mesh) wanted.push_back({&emulator.models[r].replay, candidate});
  }
  return wanted;
}

/// What a search holds that was not measured. `values`: of the axes.
std::vector<HeldParameter> held_of(const Task& task, const std::vector<double>& values) {
  std::vector<HeldParameter> all = held_parameters(task.grid, task.replays, values);
  if (spread_of_scale(task.grid, task.replays) > 0)  // the posterior takes it in without an approximation
    std::erase_if(all, [](const HeldParameter& held) { return held.name.ends_with("density"); });
  return all;
}

void add_wanted(const Task& task, const std::vector<HeldParameter>& all, const std::vector<double>& values,
                std::vector<WantedMotion>& wanted) {
  for (const HeldParameter& held : all)
    for (const double value : held.values)
      for (const Replay& replay : task.replays)
        wanted.push_back({&replay, candidate_with(values, task.grid, held.name, value)});
}

std::vector<std::vector<double>> draws_of(const Posterior& posterior) {
  const Eigen::MatrixXd samples = samples_of(posterior);
  std::vector<std::vector<double>> draws;
  for (int draw = 0; draw < emulator_draws; ++draw) {
    const Eigen::VectorXd row =
        samples.row((2 * draw + 1) * samples.rows() / (2 * emulator_draws)).transpose();
    draws.emplace_back(row.begin(), row.end());
  }
  return draws;
}

/// Simulated motions, one a replay, at each of some values.
std::vector<std::vector<ReplayResult>> simulated_at(const Task& task, const std::vector<Replay>& replays,
                                                    const std::vector<std::vector<double>>& points) {
  std::vector<ReplayCandidate> candidates;
  for (const std::vector<double>& values : points) candidates.push_back(candidate_at(values, task.grid));
  std::vector<std::vector<ReplayResult>> results(points.size(), std::vector<ReplayResult>(replays.size()));
  for (std::size_t r = 0; r < replays.size(); ++r)
    task.store.run(replays[r], candidates, [&](std::size_t i, ReplayResult result) {
      results[i][r] = std::move(result);
      task.tell_motion();
    });
  return results;
}

constexpr const char* half_step_name = "half_step";

}  // namespace

void simulate_ahead(const Task& task, const Emulator& emulator, const Posterior& posterior,
                    const std::vector<FinerSettings>& finer, bool with_held, bool with_solution) {
  const std::vector<double> values = posterior.values();
  const ReplayCandidate candidate = candidate_at(values, task.grid);
  std::vector<WantedMotion> wanted = wanted_at(task, emulator, candidate);
  const std::vector<Replay>* of_draws = &task.replays;
  for (const FinerSettings& each : finer) {
    for (const Replay& replay : each.replays) wanted.push_back({&replay, candidate});
    if (each.what == half_step_name) of_draws = &each.replays;
  }
  if (with_held) add_wanted(task, held_of(task, values), values, wanted);
  std::vector<std::vector<Replay>> of_solution;
  if (with_solution) of_solution = replays_of_solution(task, values);
  for (const std::vector<Replay>& replays : of_solution)
    for (const Replay& replay : replays) wanted.push_back({&replay, candidate});
  for (const std::vector<double>& draw : draws_of(posterior))
    for (const Replay& replay : *of_draws) wanted.push_back({&replay, candidate_at(draw, task.grid)});
  task.store.prepare(wanted);
}

std::vector<Replay> replays_of(const Emulator& emulator) {
  std::vector<Replay> replays;
  for (const ModelledReplay& model : emulator.models) replays.push_back(model.replay);
  return replays;
}

namespace {

/// Motions at a value that is held, and how much of the way to it that is.
struct HeldMotions {
  double share = 1;
  std::shared_ptr<const Motions> motions;  ///< null: none, however near
};

/// At one side of what is held; nearer where they diverge.
HeldMotions motions_towards(const Task& task, const std::vector<double>& values, const HeldParameter& held,
                            std::size_t side) {
  // Of the deviation of what is held: a motion nearer than that, where others diverge, says too little.
  // Chosen: not varied.
  constexpr double kNearest = 1.0 / 8;
  for (double share = 1; share >= kNearest; share /= 2) {
    if (share < 1 && task.told) task.told({}, {-static_cast<int>(task.replays.size()), 0});
    const ReplayCandidate candidate = candidate_with(values, task.grid, held.name, held.nearer(side, share));
    std::vector<ReplayResult> results;
    for (const Replay& replay : task.replays) {
      results.push_back(task.store.run(replay, candidate));
      task.tell_motion();
    }
    if (all_finite(results))
      return {share, std::make_shared<const Motions>(Motions{task.replays, std::move(results)})};
  }
  return {};
}

}  // namespace

std::vector<KnownError> errors_of_held(const Task& task, const std::vector<double>& values,
                                       const std::vector<ReplayResult>& here) {
  std::vector<KnownError> errors;
  const auto middle = std::make_shared<const Motions>(Motions{task.replays, here});
  const std::vector<HeldParameter> all = held_of(task, values);
  std::vector<WantedMotion> wanted;
  add_wanted(task, all, values, wanted);
  task.store.prepare(wanted);
  for (const HeldParameter& held : all) {
    HeldMotions low = motions_towards(task, values, held, 0), high = motions_towards(task, values, held, 1);
    if (!low.motions && !high.motions) continue;
    const bool bends = low.motions && high.motions && low.share == 1 && high.share == 1;
    for (HeldMotions* const side : {&low, &high})
      if (!side->motions) *side = {0, middle};
    const double slope = 1 / (low.share + high.share);
    KnownError error{{{-slope, low.motions}, {slope, high.motions}}, held.shared};
    if (bends) error.bend = {{0.5, low.motions}, {-1, middle}, {0.5, high.motions}};
    error.name = held.name;
    errors.push_back(std::move(error));
  }
  return errors;
}

namespace {

/// `asked`, `spread`: standard deviations of what was assumed.
std::string grasp_text(const HeldParameter& held, double asked, double spread) {
  const auto mm = [](double size) { return data::format_short(std::round(1e5 * size) / 100) + " mm"; };
  const double told = held.nearer(asked < 0 ? 0 : 1, std::abs(asked));
  return "the recordings tell that the grasp holds " + mm(told) + " of the sheet, give or take " +
         mm(spread * 0.5 * (held.values[1] - held.values[0])) + ": the answer, simulated at " + mm(held.at) +
         ", allows for that";
}

}  // namespace

void warn_of_held(const Task& task, const std::vector<double>& values, const MotionLikelihood& likelihood,
                  const std::vector<KnownError>& errors, std::vector<std::string>& warnings) {
  for (const HeldParameter& held : held_of(task, values))
    if (std::none_of(errors.begin(), errors.end(),
                     [&](const auto& error) { return error.name == held.name; }))
      warnings.push_back(held.name + " was not measured, and motions at other values of it diverge: the " +
                         "intervals do not allow for an error of it. Measure it (--hold " + held.name +
                         "=VALUE:measured), or take a shorter --time-step");
  for (std::size_t e = 0; e < errors.size(); ++e)
    for (const HeldParameter& held : held_parameters(task.grid, task.replays, values))
      if (errors[e].name == "grasp_size" && held.name == errors[e].name &&
          likelihood.spread_of(e) < kFarBetter)
        warnings.push_back(grasp_text(held, likelihood.asked_of(e), likelihood.spread_of(e)));
      else if (errors[e].name == held.name && held.name != "grasp_stiffness" &&
               likelihood.spread_of(e) < kFarBetter)
        warnings.push_back(held.name +
                           (task.grid.deviations.contains(held.name)
                                ? " is told by the recordings far better than was stated"
                                : " was not measured, and the recordings tell it") +
                           ": search it as well");
}

std::vector<std::string> contradicted_stiffnesses(const Task& task, const std::vector<double>& values,
                                                  const MotionLikelihood& likelihood,
                                                  const std::vector<KnownError>& errors) {
  // Of the standard deviation assumed: a held stiffness that is asked to be farther away is contradicted.
  // Chosen: not varied.
  constexpr double kAnother = 0.25;
  // Standard deviations of what the recordings tell, from which a held stiffness is contradicted. Theory:
  // once in twenty.
  constexpr double kSure = 2;
  std::vector<std::string> texts;
  for (const HeldParameter& held : held_parameters(task.grid, task.replays, values)) {
    if (!is_stiffness(held.name) || task.grid.deviations.contains(held.name)) continue;
    const auto error = std::find_if(errors.begin(), errors.end(),
                                    [&](const KnownError& each) { return each.name == held.name; });
    if (error == errors.end()) continue;
    const auto e = static_cast<std::size_t>(error - errors.begin());
    const double asked = likelihood.asked_of(e), spread = likelihood.spread_of(e);
    if (!(std::abs(asked) > std::max(kAnother, kSure * spread) && spread < kFarBetter)) continue;
    const double factor = held.values[1] / held.at;
    const std::string unit = " " + unit_of(parameter_named(held.name), task.grid.base);
    texts.push_back(held.name + " was held at " + data::format_short(held.at) + unit +
                    ", which was not measured, and the recordings ask for about " +
                    data::format_short(held.at * std::pow(factor, asked)) + unit +
                    ": what else they tell hangs on it. Search it too (" + option_of(held.name) + ")");
  }
  return texts;
}

std::vector<KnownError> errors_at_draws(const Task& task, const Emulator& emulator, const Estimate& estimate,
                                        const Posterior& posterior) {
  std::vector<KnownError> errors;
  const std::vector<Replay> on_model = replays_of(emulator);
  const double share = 1 / std::sqrt(static_cast<double>(emulator_draws));
  const auto half_step = std::find_if(estimate.errors.begin(), estimate.errors.end(),
                                      [](const KnownError& error) { return error.name == half_step_name; });
  const bool halved = half_step != estimate.errors.end();
  const std::vector<Replay>& replays = halved ? half_step->terms[1].motions->replays : task.replays;
  const std::vector<std::vector<double>> draws = draws_of(posterior);
  std::vector<std::vector<ReplayResult>> at_draws = simulated_at(task, replays, draws);
  for (std::size_t draw = 0; draw < draws.size(); ++draw) {
    const std::vector<double>& values = draws[draw];
    Motions simulated{replays, std::move(at_draws[draw])};
    if (!all_finite(simulated.results)) continue;
    MotionChange missed = {
        {-share, std::make_shared<const Motions>(Motions{on_model, motions_at(emulator, values, own_mesh)})},
        {share, std::make_shared<const Motions>(std::move(simulated))}};
    if (halved)  // what the step changes at the estimate is an error by itself
      for (const MotionTerm& term : half_step->terms) missed.push_back({-share * term.factor, term.motions});
    errors.push_back({std::move(missed)});
  }
  return errors;
}

std::optional<std::vector<ReplayResult>> simulate_at(const Task& task, const Emulator& emulator,
                                                     const std::vector<double>& values, bool finer,
                                                     std::vector<ReplayResult>& own) {
  const ReplayCandidate candidate = candidate_at(values, task.grid);
  if (finer) task.store.prepare(wanted_at(task, emulator, candidate));
  own.clear();
  for (const Replay& replay : task.replays) {
    own.push_back(task.store.run(replay, candidate));
    task.tell_motion();
    if (!own.back().finite) return std::nullopt;
  }
  // Where both meshes are simulated the emulator is not asked: x = (1 - share) own + share finer.
  std::vector<ReplayResult> simulated = finer ? own : motions_at(emulator, values, emulator.share);
  const std::vector<ReplayResult> modelled =
      finer ? std::vector<ReplayResult>() : motions_at(emulator, values, own_mesh);
  for (std::size_t r = 0; r < own.size(); ++r) {
    Motion& motion = simulated[r].motion;
    const Motion on_model = emulator.models[r].model.on_its_mesh(own[r].motion);
    if (!finer) {
      add(motion, 1, on_model);
      add(motion, -1, modelled[r].motion);
      continue;
    }
    motion = on_model;
    if (emulator.share == own_mesh) continue;
    const ReplayResult there = task.store.run(emulator.models[r].replay, candidate);
    task.tell_motion();
    if (!there.finite) return std::nullopt;
    add(motion, emulator.share, there.motion);
    add(motion, -emulator.share, on_model);
  }
  return simulated;
}

std::optional<Estimate> solve_at(const Task& task, const Emulator& emulator,
                                 const std::vector<double>& values, std::vector<FinerSettings> finer) {
  Estimate estimate;
  const ReplayCandidate candidate = candidate_at(values, task.grid);
  const std::vector<Replay> on_model = replays_of(emulator);
  const std::vector<ReplayResult> model = motions_at(emulator, values, emulator.share);
  auto simulated = simulate_at(task, emulator, values, true, estimate.motions);
  if (!simulated) return std::nullopt;
  const auto add_error = [&](const std::string& name, Motions from, Motions to, bool corrects,
                             double times = 1) {
    const auto shared = [](Motions& motions) { return std::make_shared<const Motions>(std::move(motions)); };
    estimate.errors.push_back({{{-times, shared(from)}, {times, shared(to)}}, true, corrects, {}, name});
  };
  add_error("estimate_itself", {on_model, model}, {on_model, std::move(*simulated)}, true);
  if (!task.settings.solver_check) return estimate;
  if (emulator.share != own_mesh)
    add_error("double_mesh", {on_model, motions_at(emulator, values, finer_mesh)}, {on_model, model}, false,
              kUnsure);
  for (FinerSolution& each : finer_solutions(std::move(finer), candidate, task.store)) {
    for (std::size_t r = 0; r < task.replays.size(); ++r) task.tell_motion();
    add_error(each.what, {task.replays, estimate.motions}, {std::move(each.replays), std::move(each.motions)},
              true);
  }
  return estimate;
}

}  // namespace flash::sysid
