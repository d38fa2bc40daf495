#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/agreement.h"
#include "sysid/infer/answer_work.h"
#include "sysid/infer/clock_offset.h"
#include "sysid/infer/discrepancy.h"
#include "sysid/infer/finding.h"
#include "sysid/infer/model_comparison.h"
#include "sysid/infer/solver_check.h"
#include "sysid/observe/horizon.h"

namespace flash::sysid {

/// How posteriors are found: on grids of the searched box, or by importance sampling (sampled_look). A grid
/// of three parameters or more is too coarse for ridges, such as that of bending and friction.
enum class PosteriorMethod { by_count, grids, sampling };

struct AnswerSettings {
  std::optional<double> repeatability;                    ///< trial-to-trial distance of a keyframe [m]
  bool horizon = true;                                    ///< drop keyframes beyond the predictable
  bool solver_check = true;                               ///< solve the estimate again under finer settings
  PosteriorMethod posterior = PosteriorMethod::by_count;  ///< sampling from three searched parameters on
  std::vector<Axis> ranges = {};  ///< searched before the grid at hand; empty: its own
};

/// The motions of the estimate, and how far they are from what was observed.
struct Fit {
  std::vector<Replay> replays;        ///< on the mesh of the motions, one a recording
  std::vector<ReplayResult> motions;  ///< one a recording
  CandidateResult score;
};

/// What a search says of its parameters, and how that was checked.
struct Answer {
  int best = -1;                             ///< candidate of least score; -1: none was usable
  std::vector<double> values;                ///< the estimate, one an axis
  CandidateResult estimate;                  ///< simulated on the search's own mesh and scored
  std::vector<ReplayResult> motions;         ///< of the estimate there, one a recording
  Fit fit;                                   ///< on cells of no size where the answer is of these, else there
  std::vector<ParameterFinding> parameters;  ///< one an axis, in order
  Eigen::MatrixXd covariance_log;  ///< of log(parameter) in order of the axes; empty where one may be zero
  Eigen::VectorXd weights;      ///< of each sample, in the unit of the asset; empty where the weight is known
  Eigen::MatrixXd samples;      ///< of the posterior, values of the axes, a draw a row
  std::vector<Misfit> misfits;  ///< one a recording
  std::vector<ClockOffset> clocks;               ///< one a recording
  Eigen::VectorXd open_information;              ///< see model_comparison.h
  std::vector<LeftResiduals> residuals;          ///< of `fit`, one a recording
  std::optional<Agreement> agreement;            ///< of several recordings
  std::vector<SolverCheck> checks;               ///< of the estimate; empty without them
  std::vector<std::optional<Horizon>> horizons;  ///< of each recording
  bool by_points = false;  ///< of motions too abrupt to interpolate: intervals reach to the values next to
                           ///< the likely ones (up_to_neighbours)
  std::optional<double> grasp_size;  ///< about which the answer is, where it is told to be another than was
                                     ///< assumed [m]
  std::vector<std::string> warnings;
  std::vector<std::string> contradicted;  ///< what was held and the recordings contradict; mostly none
};

/// From a finished search to its answer, by the motions that it kept (`grid.rollouts`), which are simulated
/// again where they are gone.
///
/// Keyframes beyond the time to which the best candidate can be predicted lose their weight (in `results` and
/// `replays`). Motions between the candidates are interpolated (TwoMeshMotions), with `solver_check` as cells
/// of no size would move, from a second mesh of half the cell. How likely they are, the signed distances of
/// what was observed say under noise and a discrepancy of the model (MotionLikelihood). Where few simulations
/// do, a small lattice about what is found is simulated on both meshes, and the answer comes from its
/// motions. Errors of the solution are known shapes in the likelihood: what the interpolation misses at the
/// estimate, at some draws of the posterior, twice the step to the mesh of no cells, and what half the step
/// and four times the iterations change. The motions are corrected by all but the second. So are the errors
/// of what the search holds without a measurement (held_parameters). `told`: of the work that most_work
/// counts.
Answer find_answer(GridResults& results, std::vector<Replay>& replays, const GridSettings& grid,
                   const AnswerSettings& settings, const TellWork& told = {});

/// Where a search goes on from a `start` inside the range of `grid.axes`, one value an axis: three values of
/// each parameter, as far about what its motions make likely as the posterior needs. `around`: the first
/// three. A parameter that is not told to a cell of `grid.axes` has more, thirty simulations in all (of four
/// parameters 81).
std::vector<Axis> design_about(const std::vector<Replay>& replays, const GridSettings& grid,
                               const std::vector<double>& start, const Extent& around,
                               const AnswerSettings& settings, const TellWork& told = {});

/// The most work that design_about takes.
AnswerWork most_design_work(const GridSettings& grid, std::size_t recordings);

/// The most work that find_answer takes. The motions of the grid itself are kept already and do not count.
AnswerWork most_work(const GridSettings& grid, std::size_t recordings, bool solver_check);

}  // namespace flash::sysid
