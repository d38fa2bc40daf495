#include "sysid/emulate/grid_search.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <mutex>
#include <optional>

#include "data/files/error.h"
#include "data/numbers/worst.h"
#include "sim/device_error.h"
#include "sysid/replay/motion_store.h"

namespace flash::sysid {

void add_holds(const std::vector<Hold>& holds, GridSettings& settings) {
  for (const Hold& hold : holds) {
    (hold.measured ? settings.fixed : settings.axes).push_back(hold.axis);
    if (hold.deviation) settings.deviations[hold.axis.name] = *hold.deviation;
  }
}

ReplayCandidate candidate_at(const std::vector<double>& values, const GridSettings& grid) {
  std::vector<Axis> axes = grid.axes;
  axes.insert(axes.end(), grid.fixed.begin(), grid.fixed.end());
  axes.insert(axes.end(), grid.centres.begin(), grid.centres.end());
  std::vector<double> all = values;
  for (const std::vector<Axis>* held : {&grid.fixed, &grid.centres})
    for (const Axis& axis : *held) all.push_back(axis.values.front());
  return make_candidate(grid.base, axes, all);
}

CandidateResult score_motions(const std::vector<Replay>& replays, const std::vector<ReplayResult>& results,
                              const ScoreSettings& settings, const std::vector<CloudSearches>& searches) {
  CandidateResult result;
  result.converged = true;
  bool finite = true;
  std::vector<RegistrationProblem> problems;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    result.converged = result.converged && results[r].converged;
    result.residual_max = data::worst(result.residual_max, results[r].residual_max);
    result.penetration_max = data::worst(result.penetration_max, results[r].penetration_max);
    finite = finite && results[r].finite;
    problems.push_back(registration_problem(replays[r], results[r].motion));
    if (!searches.empty()) problems.back().searches = searches[r];
  }
  if (!finite) {
    result.status = CandidateStatus::diverged;
    result.converged = false;
    result.score = std::numeric_limits<double>::infinity();
    result.recordings.resize(replays.size());
    for (RecordingScore& recording : result.recordings) recording.score = result.score;
    return result;
  }
  result.status = result.converged ? CandidateStatus::ok : CandidateStatus::unconverged;
  const std::vector<RegistrationFit> fits =
      register_motions(problems, settings.objective, settings.registration, settings.shared);
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const RegistrationFit& fit = fits[r];
    RecordingScore& recording = result.recordings.emplace_back();
    recording.score = fit.score;
    recording.offset = fit.registration.offset;
    recording.yaw = fit.registration.yaw;
    recording.time_offset = fit.registration.time_offset;
    recording.bounds_hit = fit.bounds_hit;
    for (std::size_t k = 0; k < replays[r].observations.size(); ++k) {
      const Observation& observation = replays[r].observations[k];
      recording.keyframes.push_back(
          {observation.t, fit.keyframe_scores[k], static_cast<int>(observation.count()), observation.weight});
    }
    result.score += fit.score / static_cast<double>(replays.size());
  }
  return result;
}

std::vector<Registration> registrations_of(const std::vector<Replay>& replays,
                                           const std::vector<ReplayResult>& results,
                                           const ScoreSettings& settings) {
  std::vector<RegistrationProblem> problems;
  std::vector<Registration> starts;
  bool finite = true;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    problems.push_back(registration_problem(replays[r], results[r].motion));
    starts.push_back(problems.back().start);
    finite = finite && results[r].finite;
  }
  if (!finite) return starts;
  return find_registrations(problems, settings.objective, settings.registration, settings.shared);
}

namespace {

/// Appends results in order of id as they come, and tells how far the search is.
class Results {
 public:
  Results(ResultsStore& store, int total, const std::function<void(const Progress&)>& progress)
      : store_(store), progress_(progress) {
    state_.total = total;
    state_.done = done_before_ = static_cast<int>(store.results().candidates.size());
    state_.best_score = std::numeric_limits<double>::infinity();
    for (const CandidateResult& result : store.results().candidates)
      state_.best_score = std::min(state_.best_score, result.score);
  }

  /// Of the candidate that is `place`th of those that were wanted.
  void take(std::size_t place, CandidateResult result) {
    const std::scoped_lock lock(mutex_);
    state_.best_score = std::min(state_.best_score, result.score);
    ++state_.done;
    finished_.emplace(place, std::move(result));
    std::vector<CandidateResult> next;
    for (; !finished_.empty() && finished_.begin()->first == next_to_write_; ++next_to_write_) {
      next.push_back(std::move(finished_.begin()->second));
      finished_.erase(finished_.begin());
    }
    if (!next.empty()) store_.append(next);
    const double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
    state_.candidates_per_second = (state_.done - done_before_) / std::max(seconds, 1e-9);
    state_.seconds_left = (state_.total - state_.done) / state_.candidates_per_second;
    if (progress_) progress_(state_);
  }

  bool complete() const { return state_.done == state_.total; }

 private:
  using Clock = std::chrono::steady_clock;
  ResultsStore& store_;
  const std::function<void(const Progress&)>& progress_;
  Progress state_;
  int done_before_ = 0;
  Clock::time_point begin_ = Clock::now();
  std::mutex mutex_;
  std::size_t next_to_write_ = 0;
  std::map<std::size_t, CandidateResult> finished_;  ///< those that wait for one before them
};

/// Simulates candidates on every replay, as a batch each, and scores each on the thread that finished it.
void score_candidates(const std::vector<Replay>& replays, const ScoreSettings& settings,
                      const std::vector<CloudSearches>& searches,
                      const std::vector<ReplayCandidate>& candidates, const std::optional<MotionStore>& kept,
                      const std::function<void(std::size_t, CandidateResult)>& scored) {
  std::vector<std::vector<ReplayResult>> motions(candidates.size());
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const auto finished = [&](std::size_t i, ReplayResult result) {
      motions[i].push_back(std::move(result));
      if (r + 1 < replays.size()) return;
      scored(i, score_motions(replays, motions[i], settings, searches));
      motions[i].clear();
    };
    if (kept)
      kept->run(replays[r], candidates, finished);
    else
      run(replays[r], candidates, scored_steps(replays[r]), finished);
  }
}

/// Simulates this shard's motions of all candidates, and waits for those of the others.
void share_out(const std::vector<Replay>& replays, const std::vector<ReplayCandidate>& candidates,
               const MotionStore& kept, const std::function<void(const Progress&)>& progress) {
  std::vector<WantedMotion> wanted;
  for (const ReplayCandidate& candidate : candidates)
    for (const Replay& replay : replays) wanted.push_back({&replay, candidate});
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  std::mutex mutex;
  Progress state;
  state.total = static_cast<int>(candidates.size());
  state.best_score = std::numeric_limits<double>::infinity();
  std::size_t motions = 0;
  kept.prepare(wanted, [&] {
    const std::scoped_lock lock(mutex);
    state.done = static_cast<int>(++motions / replays.size());
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    state.candidates_per_second = state.done / std::max(seconds, 1e-9);
    state.seconds_left = (state.total - state.done) / std::max(state.candidates_per_second, 1e-9);
    if (progress && state.done > 0) progress(state);
  });
}

}  // namespace

bool grid_search(const std::vector<Replay>& replays, const GridSettings& settings, ResultsStore& store,
                 const std::function<void(const Progress&)>& progress, const std::atomic<bool>* stop) {
  std::vector<Axis> axes = settings.axes;
  axes.insert(axes.end(), settings.fixed.begin(), settings.fixed.end());
  check_axes(axes, settings.base);
  const std::vector<std::vector<double>> grid = cartesian_product(axes);
  std::vector<int> wanted;
  for (int id = 0; id < static_cast<int>(grid.size()); ++id) {
    if (!store.contains(id)) wanted.push_back(id);
  }
  std::vector<Replay> batched = replays;
  for (Replay& replay : batched) {
    replay.settings.threads = settings.threads;
    replay.settings.envs = settings.envs;
    if (stop != nullptr) replay.settings.solver.stop = stop;
  }
  std::optional<MotionStore> kept;
  if (!settings.rollouts.empty()) kept.emplace(settings.rollouts, settings.shard);
  std::vector<CloudSearches> searches;
  for (const Replay& replay : batched)
    searches.push_back(device_searches(replay, settings.score.registration.points_per_keyframe));
  if (kept && settings.shard.count > 1) {
    std::vector<ReplayCandidate> candidates;
    for (const std::vector<double>& values : grid)
      candidates.push_back(make_candidate(settings.base, axes, values));
    try {
      share_out(batched, candidates, *kept, progress);
    } catch (const data::Stopped&) {
      return false;
    }
  }
  Results results(store, static_cast<int>(grid.size()), progress);
  const auto at_once = static_cast<std::size_t>(std::max(1, settings.envs));
  for (std::size_t first = 0; first < wanted.size(); first += at_once) {
    std::vector<ReplayCandidate> candidates;
    for (std::size_t i = first; i < std::min(wanted.size(), first + at_once); ++i)
      candidates.push_back(make_candidate(settings.base, axes, grid[wanted[i]]));
    try {
      score_candidates(batched, settings.score, searches, candidates, kept,
                       [&](std::size_t i, CandidateResult result) {
                         const std::vector<double>& values = grid[wanted[first + i]];
                         result.id = wanted[first + i];
                         result.values.assign(values.begin(), values.begin() + std::ssize(settings.axes));
                         results.take(first + i, std::move(result));
                       });
    } catch (const data::Stopped&) {
      return results.complete();
    } catch (const sim::DeviceError& error) {
      const auto id_of = [&](std::size_t i) { return static_cast<std::size_t>(wanted[first + i]); };
      throw error.renumbered(id_of, "candidate");
    }
  }
  return results.complete();
}

}  // namespace flash::sysid
