#pragma once
#include <array>
#include <optional>
#include <vector>

#include "sysid/emulate/two_mesh_motions.h"
#include "sysid/infer/answer_work.h"
#include "sysid/infer/profile.h"

namespace flash::sysid {

/// One range an axis.
using Extent = std::vector<std::array<double, 2>>;

/// From the first to the last value of each axis.
Extent extent_of(const std::vector<Axis>& axes);

/// One grid within the searched range, and what its scores say with no regard to solver or interpolation.
struct Zoomed {
  GridResults results;
  GridVerdict verdict;
  std::vector<Eigen::MatrixXd> information;  ///< of the keyframes at the estimate
};

/// Registers and scores modelled motions at every point of a grid. `share`: see TwoMeshMotions.
GridResults score_models(const std::vector<ModelledReplay>& models, const std::vector<Axis>& axes,
                         double share, const GridSettings& settings, const TellWork& told = {});

/// An extent about the estimate, of which the interval of every parameter takes a half or which ends with the
/// range of `axes`; `extent`, on which the verdict stands, itself where it is not much too large and leaves
/// no interval open.
Extent next_extent(const Extent& extent, const GridVerdict& verdict, const std::vector<Axis>& axes);

/// Grids of some hundred points, each about the estimate of the one before, until the interval of every
/// parameter takes a third to a half of the extent or ends with the searched range. A point costs a score, no
/// simulation. `start`: the first extent.
Zoomed zoom(const std::vector<ModelledReplay>& models, double share, const Extent& start,
            const GridSettings& settings, std::optional<double> repeatability, const TellWork& told = {});

/// The most scores that zoom takes over such axes: the points of all its grids.
int most_scores(const std::vector<Axis>& axes);

/// Values at which motions are simulated anew about an answer: `count` over the extent of an axis, evenly,
/// where that is no wider than a cell of the search; else the values of the search.
std::vector<Axis> lattice(const Extent& extent, const std::vector<Axis>& searched, int count);

/// Where to simulate next: `extent` itself where every interval of the verdict ends inside it or with the
/// searched range, and `zoomed`, the extent that it was read on, is half of it or more. Else an extent about
/// the estimate, twice as far on a side that an interval leaves.
Extent next_lattice(const Extent& extent, const Extent& zoomed, const GridVerdict& verdict,
                    const std::vector<Axis>& searched);

}  // namespace flash::sysid
