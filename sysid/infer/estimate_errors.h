#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/answer.h"
#include "sysid/infer/motion_likelihood.h"
#include "sysid/infer/solver_check.h"

namespace flash::sysid {

// Shares of a TwoMeshMotions: own mesh, finer one, no cells. Theory: of second order (Richardson 1911).
inline constexpr double own_mesh = 0, finer_mesh = 1, no_cells = 4.0 / 3;

/// Draws at which an emulator is tried. Chosen: a motion each, so few; not varied.
inline constexpr int emulator_draws = 4;

/// Motions simulated at an estimate, a recording: itself, three finer ones, and the draws. Work.
inline constexpr int motions_at_estimate = 4 + emulator_draws;

/// What all steps of an answer need.
struct Task {
  const std::vector<Replay>& replays;
  const std::vector<Replay>& finer;  ///< on half the cell; empty where there are none, or none are asked for
  const GridSettings& grid;          ///< axes: of which every candidate has a motion
  const std::vector<Axis>& ranges;   ///< in which the answer is sought, with the cells of the search
  const AnswerSettings& settings;
  const MotionStore& store;
  const TellWork& told;

  void tell_motion() const {
    if (told) told({1, 0}, {});
  }
};

/// The estimate simulated, and what it says of errors of the solution.
struct Estimate {
  std::vector<ReplayResult> motions;  ///< on the search's own mesh
  std::vector<KnownError> errors;     ///< of the solution, named as a SolverCheck is
};

std::vector<Replay> replays_of(const Emulator& emulator);

/// Simulates side by side what solve_at, errors_at_draws and, `with_held` and `with_solution`, errors_of_held
/// and those of solution_errors ask for about a posterior.
void simulate_ahead(const Task& task, const Emulator& emulator, const Posterior& posterior,
                    const std::vector<FinerSettings>& finer, bool with_held, bool with_solution);

/// By what is held and not measured, about an estimate: how the motion changes with it, and how that bends.
/// Where a motion diverges one nearer is taken, down to an eighth of the way, or the other side alone, and
/// the change is linear. What diverges on both sides is left out; warn_of_held names it.
std::vector<KnownError> errors_of_held(const Task& task, const std::vector<double>& values,
                                       const std::vector<ReplayResult>& here);

/// Names what was held without a measurement and the `errors` lack, and what the recordings tell far better
/// than was assumed. `values`: the estimate.
void warn_of_held(const Task& task, const std::vector<double>& values, const MotionLikelihood& likelihood,
                  const std::vector<KnownError>& errors, std::vector<std::string>& warnings);

/// Names a stiffness that was held without a measurement where the recordings tell that it is another. How
/// the motion changes with it was seen at one estimate: a ridge of it and friction leads away from there.
std::vector<std::string> contradicted_stiffnesses(const Task& task, const std::vector<double>& values,
                                                  const MotionLikelihood& likelihood,
                                                  const std::vector<KnownError>& errors);

/// What the emulator misses at some draws of a posterior, and what half the step of time changes there other
/// than at the estimate: errors of which any mixture is as likely.
std::vector<KnownError> errors_at_draws(const Task& task, const Emulator& emulator, const Estimate& estimate,
                                        const Posterior& posterior);

/// Motions simulated at values, as the emulator's mesh has them; empty where one diverged. `own`: on the
/// search's own mesh. `finer`: on the finer mesh too; else the emulator's difference between both stays.
std::optional<std::vector<ReplayResult>> simulate_at(const Task& task, const Emulator& emulator,
                                                     const std::vector<double>& values, bool finer,
                                                     std::vector<ReplayResult>& own);

/// Simulates the estimate, on finer meshes and under `finer` settings too. Empty where a motion diverged.
std::optional<Estimate> solve_at(const Task& task, const Emulator& emulator,
                                 const std::vector<double>& values, std::vector<FinerSettings> finer);

}  // namespace flash::sysid
