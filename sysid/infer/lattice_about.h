#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/estimate_errors.h"
#include "sysid/infer/motion_likelihood.h"
#include "sysid/infer/solver_check.h"

namespace flash::sysid {

inline constexpr int lattice_rounds = 8;  // Of motions about an answer. Work: a cap where they do not settle.

/// Motions of a lattice over what is searched: three values of each of up to four parameters. Of five and
/// more nothing is simulated about the answer.
std::size_t few_motions(const std::vector<Axis>& axes);

/// Where the emulator by few misses too much: four values of each.
std::size_t many_motions(const std::vector<Axis>& axes);

/// The motions at every point of `axes`; with `finer` axes (none: empty) those of a finer mesh at theirs.
/// Empty where one diverged or there is no finer mesh.
std::optional<Emulator> emulator_over(const Task& task, const std::vector<Axis>& axes,
                                      const std::vector<Axis>& finer, bool told_own);

/// An emulator, and the posterior by it.
struct Found {
  Emulator emulator;
  std::vector<Axis> axes;  ///< of it: at their values it is exact
  Look look;
  Estimate estimate;
  std::vector<KnownError> errors;  ///< all that the look knows
  std::string unrefined = {};      ///< why motions about it are missing that were asked for; mostly empty
};

/// Looks twice: for the estimate, and again with what solving it says of errors. `held`: errors by what is
/// held and of the cells, found at the first estimate unless they are there already. `before`: draws of an
/// earlier look, where that was sampled. Empty where the estimate diverges.
std::optional<Found> look_with(const Task& task, Emulator emulator, const std::vector<Axis>& axes,
                               const Extent& extent, const std::vector<double>& at,
                               std::vector<KnownError> errors, std::vector<KnownError>& held,
                               const std::optional<WeightedDraws>& before = {});

/// One lattice over an extent, of few values or of many, and what its motions say; empty where too many would
/// be needed, or one diverged.
std::optional<Found> look_about(const Task& task, const Extent& extent, const std::vector<double>& at,
                                bool finer, const std::vector<KnownError>& errors,
                                std::vector<KnownError>& held, bool many = false,
                                const std::optional<WeightedDraws>& before = {});

/// Motions simulated anew about the answer, where few simulations do: again while it leaves them or takes too
/// little of them; with more of them where the emulator misses much, and then about what is likely alone.
/// Found says where they were asked for and could not be had.
Found simulate_about(const Task& task, Found found, std::vector<KnownError>& held);

/// Simulations of one recording in a round of it, on the own mesh and on the finer one, at most; none where
/// they would be too many.
std::pair<std::size_t, std::size_t> most_motions(const std::vector<Axis>& axes);

/// All errors that are known but those of the emulator, and `more`.
std::vector<KnownError> errors_about(const Found& found, std::vector<KnownError> more);

/// The likelihood of motions on the mesh of `replays`, with all errors that are known but those of the
/// emulator and `more`.
MotionLikelihood likelihood_about(const Task& task, const Found& found, const std::vector<Replay>& replays,
                                  const std::vector<double>& values,
                                  const std::vector<ReplayResult>& reference, std::vector<KnownError> more);

/// By how much the emulator misses what was simulated at the estimate or at a draw of the posterior, the
/// larger: the mean distance of both surfaces over the weighing keyframes [m]. Draws are simulated with half
/// the step where that is an error by itself: what it changes at the estimate is taken off.
double missed_by_emulator(const Found& found);

/// How far each error of the estimate moves the surface, and the parameters if they had to explain it.
std::vector<SolverCheck> checks_of(const Task& task, const Found& found);

}  // namespace flash::sysid
