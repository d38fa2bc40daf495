#pragma once
#include <array>
#include <optional>
#include <vector>

#include "sysid/emulate/two_mesh_motions.h"
#include "sysid/infer/answer_work.h"
#include "sysid/infer/importance_sampling.h"
#include "sysid/infer/motion_likelihood.h"
#include "sysid/infer/posterior.h"

namespace flash::sysid {

/// One range an axis.
using Extent = std::vector<std::array<double, 2>>;

/// From the first to the last value of each axis.
Extent extent_of(const std::vector<Axis>& axes);

/// From the value of an axis below each value to the one above.
Extent cells_about(const std::vector<double>& values, const std::vector<Axis>& axes);

/// A posterior over one extent, and the likelihood that it is of.
struct Look {
  MotionLikelihood likelihood;
  Posterior posterior;
  std::optional<WeightedDraws> draws = {};  ///< of a sampled one (sampled_look)
};

/// What stands in for the simulations of a search.
struct Emulator {
  std::vector<ModelledReplay> models;  ///< one a recording
  double share = 0;                    ///< see TwoMeshMotions
  std::size_t first = 0;               ///< recording of the search that the first is of
  std::vector<Axis> finer = {};        ///< values at which the finer mesh was simulated; empty: at none
};

/// Modelled motions at values inside the range, one a recording; `share`: see TwoMeshMotions.
std::vector<ReplayResult> motions_at(const Emulator& emulator, const std::vector<double>& values,
                                     double share);

/// How modelled motions change about `values` with each searched parameter, over an extent of it.
std::vector<MotionChange> rates_at(const Emulator& emulator, const std::vector<double>& values,
                                   const Extent& extent, const std::vector<Axis>& axes);

/// The likelihood of modelled motions at every point of a grid, in order.
Eigen::VectorXd deviance_over(const Emulator& emulator, const std::vector<Axis>& axes,
                              const MotionLikelihood& likelihood, const GridSettings& grid,
                              const TellWork& told = {});

/// The likelihood of modelled motions at points, one value an axis, in order.
Eigen::VectorXd deviance_at(const Emulator& emulator, const std::vector<std::vector<double>>& points,
                            const MotionLikelihood& likelihood, const GridSettings& grid,
                            const TellWork& told = {});

/// At how many a look asks for the likelihood.
enum class Points { hundreds, dozens };

/// The grid over an extent at which a look asks for the likelihood: 17, 9, 7 or 5 points along each of 1, 2,
/// 3, or 4 and more searched axes for hundreds, 9, 7, 4 or 3 for dozens. An axis of one value keeps it.
std::vector<Axis> axes_over(const Extent& extent, const std::vector<Axis>& searched,
                            Points points = Points::hundreds);

/// An extent about the estimate, of which the interval of every parameter takes a half or which ends with the
/// range of `axes`; `extent`, on which the posterior stands, itself where it is not much too large and cuts
/// nothing likely off.
Extent next_extent(const Extent& extent, const Posterior& posterior, const std::vector<Axis>& axes,
                   Points points = Points::hundreds);

/// Posteriors over some points, each about the estimate of the one before, until the interval of
/// every parameter takes a third to a half of the extent or ends with the range of `axes`. A point costs a
/// look at the observations, no simulation. The likelihood is linear about the estimate before. `start`: the
/// first extent; `at`: where it is linear first.
Look narrow(const Emulator& emulator, const Extent& start, const std::vector<double>& at,
            const std::vector<Axis>& axes, const GridSettings& grid, std::optional<double> repeatability,
            const std::vector<KnownError>& errors, const TellWork& told = {},
            Points points = Points::hundreds);

/// The most points that narrow looks at over such axes.
int most_scores(const std::vector<Axis>& axes, Points points = Points::hundreds);

/// Values at which motions are simulated anew about an answer, evenly over the extent of each axis: `count`
/// where that is no wider than a cell of the search, else as many, to nine, as `at_most` points allow.
std::vector<Axis> lattice(const Extent& extent, const std::vector<Axis>& searched, int count,
                          std::size_t at_most);

/// Whether a lattice has, in any direction, cells of no more than `share` of those of `axes`.
bool is_finer(const std::vector<Axis>& lattice, const std::vector<Axis>& axes, double share = 0.5);

/// Whether an extent goes beyond the values of `axes`.
bool reaches_beyond(const Extent& extent, const std::vector<Axis>& axes);

/// Where to simulate next: `extent` itself where nothing likely is beyond it within the searched range, and
/// the posterior takes half of it or more. Else an extent about the estimate, twice as far on a side that
/// the posterior leaves.
Extent next_lattice(const Extent& extent, const Posterior& posterior, const std::vector<Axis>& searched);

}  // namespace flash::sysid
