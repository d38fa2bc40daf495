#pragma once
#include <vector>

#include "sysid/emulate/grid_search.h"

namespace flash::sysid {

/// How long the parts of an answer take as a rule, in candidates of the search: 3 is as long as three take.
struct ExpectedWork {
  double first_look = 0;  ///< at the best candidate, with all errors of its solution
  double lattice = 0;     ///< one of motions about the answer, with the look at it
  double lattices = 0;    ///< how many there are as a rule
  double end = 0;         ///< from the last lattice to the answer
};

/// Simulations that run side by side.
struct SimulatedTogether {
  double count = 0;
  double each = 1;  ///< of one, in candidates
};

/// How long they take on some threads, in candidates as these follow each other on all threads: their sum, or
/// what the longest takes on a thread of its own.
double time_together(const std::vector<SimulatedTogether>& simulations, int threads);

/// What a motion takes over one of the search, by its vertices and steps over those of the search:
///
///     vertices^1.5 steps^0.5.
///
/// A factor of a fill that grows a little, and fewer iterations in shorter steps: lifts of 500 vertices took
/// 2.2 times as long on 1.9 times the vertices, 13 times on 3.8, and 1.3 times with half the step.
double motion_cost(double vertices, double steps);

/// What is expected of a search whose answer is about `values`, one for each axis: where cells are coarse for
/// the fold there, its lattices are simulated on smaller ones (on_cells_for_fold). Lattices are one or two
/// for one parameter, and more for more: the demo has five, the same search on ten times the candidates one.
ExpectedWork expected_work(const std::vector<Replay>& replays, const GridSettings& grid, bool solver_check,
                           const std::vector<double>& values);

/// The middle of what is searched.
std::vector<double> middle_of(const std::vector<Axis>& axes);

}  // namespace flash::sysid
