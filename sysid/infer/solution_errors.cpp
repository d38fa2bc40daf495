#include "sysid/infer/solution_errors.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

#include "sysid/emulate/mesh_projection.h"
#include "sysid/replay/coarse_cells.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

/// The estimate on other cells; empty where one motion diverged.
std::vector<ReplayResult> motions_on(const Task& task, const std::vector<Replay>& replays,
                                     const std::vector<double>& values) {
  std::vector<ReplayResult> results;
  for (const Replay& replay : replays) {
    results.push_back(task.store.run(replay, candidate_at(values, task.grid)));
    task.tell_motion();
    if (!results.back().finite) return {};
  }
  return results;
}

/// Sum of the squares over the first vertices, at the steps that both keep.
double squares_of(const Motion& a, const Motion& b, Eigen::Index vertices) {
  double sum = 0;
  for (std::size_t i = 0; i < std::min(a.positions.size(), b.positions.size()); ++i)
    if (a.positions[i].rows() > 0 && b.positions[i].rows() > 0)
      sum += (b.positions[i].topRows(vertices) - a.positions[i].topRows(vertices)).squaredNorm();
  return sum;
}

using Shared = std::shared_ptr<const Motions>;

/// The estimate on other cells or with another step; null where a motion diverged.
Shared shared_motions(const Task& task, const std::vector<Replay>& replays,
                      const std::vector<double>& values) {
  std::vector<ReplayResult> results = motions_on(task, replays, values);
  if (results.empty()) return nullptr;
  return std::make_shared<const Motions>(Motions{replays, std::move(results)});
}

KnownError error_of(const char* name, const Shared& from, const Shared& to, bool corrects, double times = 1) {
  KnownError error{{{-times, from}, {times, to}}, true, corrects, {}, name};
  return error;
}

// What lies beyond a difference between two meshes or steps, over it, where halving again leaves this share.
double beyond(double ratio) { return ratio / (1 - ratio); }
/// Share of an error that halving leaves, of first and of second order. Theory: 1/2 and 1/4.
constexpr double kFirstOrder = 0.5, kSecondOrder = 0.25;

/// Motions on other cells as the search's own mesh has them: on a sixteenth of the vertices.
Shared on_own_mesh(const Task& task, const Motions& motions) {
  Motions own{task.replays, motions.results};
  for (std::size_t r = 0; r < own.replays.size(); ++r) {
    const MeshProjection to_own = projection(motions.replays[r].surface, own.replays[r].surface);
    for (data::Points& positions : own.results[r].motion.positions)
      if (positions.rows() > 0) positions = projected(to_own, positions);
  }
  return std::make_shared<const Motions>(std::move(own));
}

/// What half of the cells of the sheet change; null where a motion diverged.
struct Halving {
  Shared before, after;
  explicit operator bool() const { return before && after; }
};

Halving halving_at(const Task& task, const HalvedSheet& sheet, const std::vector<double>& values) {
  const auto at = [&](const std::vector<Replay>& replays) -> Shared {
    const Shared motions = shared_motions(task, replays, values);
    return motions ? on_own_mesh(task, *motions) : nullptr;
  };
  return {at(sheet.before), at(sheet.after)};
}

bool has_other_cells(const Task& task) { return task.settings.solver_check && are_graded(task.replays); }

bool are_coarse(const Task& task, const std::vector<double>& values) {
  return coarse_cells(task.replays, candidate_at(values, task.grid)).has_value();
}

using Errors = std::vector<KnownError>;

Errors::const_iterator find(const Errors& errors, const char* name) {
  return std::find_if(errors.begin(), errors.end(),
                      [&](const KnownError& error) { return error.name == name; });
}

bool has(const Errors& errors, const char* name) { return find(errors, name) != errors.end(); }

bool is_of_sheet(const KnownError& error) {
  return error.name == half_sheet_cells || error.name == quarter_sheet_cells ||
         error.name == unsettled_sheet_cells;
}

/// The cells halved, and where they are coarse halved again.
std::vector<HalvedSheet> sheets_at(const Task& task, const std::vector<double>& values) {
  std::vector<HalvedSheet> sheets = {halved_sheet(task.replays, 1)};
  if (are_coarse(task, values)) sheets.push_back(halved_sheet(task.replays, 2));
  return sheets;
}

/// Those that is_of_sheet, by sheets_at; none where half of the cells diverge.
Errors errors_of_sheet(const Task& task, const std::vector<HalvedSheet>& sheets,
                       const std::vector<double>& values) {
  Errors errors;
  const Halving first = halving_at(task, sheets.front(), values);
  if (!first) return errors;
  const Halving second = sheets.size() > 1 ? halving_at(task, sheets[1], values) : Halving{};
  if (!second) {
    errors.push_back(error_of(half_sheet_cells, first.before, first.after, true, 1 + beyond(kSecondOrder)));
  } else {
    const double ratio = observed_ratio({first.before->results, first.after->results},
                                        {second.before->results, second.after->results});
    const double share = std::clamp(ratio, kSecondOrder, kFirstOrder);
    errors.push_back(error_of(half_sheet_cells, first.before, first.after, true));
    errors.push_back(error_of(quarter_sheet_cells, second.before, second.after, true, 1 + beyond(share)));
    for (KnownError& error : errors) error.spread = share;
    if (ratio > most_ratio)
      errors.push_back(
          error_of(unsettled_sheet_cells, second.before, second.after, false, 1 + beyond(share)));
  }
  errors.front().found_at = values;
  return errors;
}

}  // namespace

double observed_ratio(const Difference& first, const Difference& second) {
  double squares[2] = {0, 0};
  for (std::size_t r = 0; r < first.from.size(); ++r) {
    const Eigen::Index vertices = first.from[r].motion.positions.front().rows();
    squares[0] += squares_of(first.from[r].motion, first.to[r].motion, vertices);
    squares[1] += squares_of(second.from[r].motion, second.to[r].motion, vertices);
  }
  return squares[0] > 0 ? std::sqrt(squares[1] / squares[0]) : 0;
}

std::vector<KnownError> errors_of_cells(const Task& task, const Emulator& emulator,
                                        const std::vector<double>& values,
                                        const std::vector<ReplayResult>& here) {
  if (!has_other_cells(task)) return {};
  const std::vector<HalvedSheet> sheets = sheets_at(task, values);
  Errors errors = errors_of_sheet(task, sheets, values);
  if (emulator.share == own_mesh) return errors;
  const Shared half = shared_motions(task, sheets.front().before, values),
               finer = shared_motions(task, replays_of(emulator), values);
  if (half && finer && observed_ratio({here, half->results}, {half->results, finer->results}) > most_ratio)
    errors.push_back(error_of(unsettled_cells, std::make_shared<const Motions>(Motions{task.replays, here}),
                              finer, false));
  return errors;
}

bool has_left_cells(const Posterior& posterior, const std::vector<KnownError>& errors) {
  // Standard deviations of the posterior: an estimate that moved farther has its cells halved anew. Chosen:
  // not varied.
  constexpr double kFar = 0.5;
  const auto error = find(errors, half_sheet_cells);
  if (error == errors.end() || !error->corrects) return false;
  for (std::size_t k = 0; k < posterior.axes.size(); ++k) {
    if (posterior.axes[k].values.size() < 2) continue;
    const auto column = static_cast<Eigen::Index>(k);
    const Eigen::ArrayXd draws = posterior.samples.col(column).array();
    const double variance = (draws - draws.mean()).square().mean(),
                 way = posterior.estimate[column] - coordinate_of(posterior.axes[k], error->found_at[k]);
    if (way * way > kFar * kFar * variance) return true;
  }
  return false;
}

bool follow_with_cells(const Task& task, const std::vector<double>& values, std::vector<KnownError>& errors) {
  if (!has_other_cells(task) || !has(errors, half_sheet_cells)) return false;
  std::vector<HalvedSheet> sheets = sheets_at(task, values);
  const bool coarse_by_now = sheets.size() > 1 && !has(errors, quarter_sheet_cells);
  if (!coarse_by_now) sheets.resize(1);
  std::vector<WantedMotion> wanted;
  for (const HalvedSheet& sheet : sheets)
    for (const std::vector<Replay>* replays : {&sheet.before, &sheet.after})
      for (const Replay& replay : *replays) wanted.push_back({&replay, candidate_at(values, task.grid)});
  if (task.told) task.told({}, {-static_cast<int>(wanted.size()), 0});
  task.store.prepare(wanted);
  if (coarse_by_now) {
    Errors there = errors_of_sheet(task, sheets, values);
    if (there.empty()) return false;
    std::erase_if(errors, is_of_sheet);
    std::move(there.begin(), there.end(), std::back_inserter(errors));
    return true;
  }
  const Halving here = halving_at(task, sheets.front(), values);
  if (!here) return false;
  KnownError& error = errors[static_cast<std::size_t>(find(errors, half_sheet_cells) - errors.begin())];
  error.terms[0].motions = here.before;
  error.terms[1].motions = here.after;
  error.found_at = values;
  return true;
}

std::vector<KnownError> errors_of_step(const Task& task, const std::vector<double>& values) {
  if (!task.settings.solver_check) return {};
  const auto at = [&](const std::vector<Replay>& replays, double share) {
    return shared_motions(task, with_step(replays, share), values);
  };
  const Shared half = at(task.replays, 0.5), quarter = at(task.replays, 0.25);
  if (!half || !quarter) return {};
  return {error_of(quarter_step, half, quarter, true, 1 + beyond(kFirstOrder))};
}

std::vector<std::vector<Replay>> replays_of_solution(const Task& task, const std::vector<double>& values) {
  std::vector<std::vector<Replay>> all;
  if (task.settings.solver_check) all.push_back(with_step(task.replays, 0.25));
  if (!has_other_cells(task)) return all;
  for (HalvedSheet& sheet : sheets_at(task, values)) {
    all.push_back(std::move(sheet.before));
    all.push_back(std::move(sheet.after));
  }
  return all;
}

void warn_of_cells(const Task& task, const std::vector<double>& values, const std::vector<KnownError>& errors,
                   std::vector<std::string>& warnings) {
  if (has(errors, unsettled_cells))
    warnings.emplace_back(
        "the motion does not settle as the cells at the grasp shrink: the intervals take what smaller ones "
        "change as a whole; search on a finer mesh, or with a smaller --grasp-cell");
  if (has(errors, unsettled_sheet_cells))
    warnings.emplace_back(
        "the motion does not settle as the cells of the sheet are halved twice: the intervals take what the "
        "second halving changes as a whole; search on a finer mesh");
  const auto coarse = coarse_cells(task.replays, candidate_at(values, task.grid));
  if (coarse) warnings.push_back(coarse_cells_text(*coarse));
  if (!has_other_cells(task)) return;
  if (!has(errors, half_sheet_cells))
    warnings.emplace_back(
        "the motion on half of the cells of the sheet diverges: the answer is not corrected for the cells of "
        "the sheet, nor do the intervals allow for them; search on a finer mesh, or with a shorter "
        "--time-step");
  else if (coarse && !has(errors, quarter_sheet_cells))
    warnings.emplace_back(
        "the cells of the sheet are coarse, and were halved once alone: the motion on a quarter of them "
        "diverges, or was not asked for; search on a finer mesh");
}

bool is_of_solution(const KnownError& error) {
  return is_of_sheet(error) || error.name == unsettled_cells || error.name == quarter_step;
}

}  // namespace flash::sysid
