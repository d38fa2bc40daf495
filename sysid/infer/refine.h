#pragma once
#include <optional>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/answer_work.h"
#include "sysid/infer/profile.h"
#include "sysid/infer/solver_check.h"

namespace flash::sysid {

/// The answer of a search whose motions were kept.
struct Refined {
  GridVerdict
      verdict;  ///< parameters, estimate and covariance between the values of the grid, the rest of it
  std::vector<SolverCheck> checks;
  double interpolation = 0;  ///< by which the score of the estimate, simulated, is off [m]
};

/// Looks between the candidates of a grid by interpolating their motions (TwoMeshMotions), not their scores:
/// with `solver_check` as cells of no size would move, from a second mesh of half the cell. Where few
/// simulations do, a small lattice about what is found, as wide as its intervals need, is simulated on both
/// meshes, and estimate and intervals come from its motions. The difference between the finer mesh and the
/// limit remains as uncertainty to both sides, so does what the interpolated motion differs from the
/// simulated one at the estimate; half the step and four times the iterations, there, widen to one. `whole`:
/// of the grid itself. Empty where a candidate diverged, or the estimate, simulated, is worse than the best
/// candidate.
std::optional<Refined> refine(const GridResults& results, const GridVerdict& whole,
                              const std::vector<Replay>& replays, const GridSettings& grid,
                              std::optional<double> repeatability, bool solver_check,
                              const TellWork& told = {});

/// The most work that refine takes. The motions of the grid itself are kept already and do not count.
AnswerWork most_work(const GridSettings& grid, std::size_t recordings, bool solver_check);

}  // namespace flash::sysid
