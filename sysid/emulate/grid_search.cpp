#include "sysid/emulate/grid_search.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "data/error.h"
#include "sysid/replay/motion_store.h"

namespace flash::sysid {

ReplayCandidate candidate_at(const std::vector<double>& values, const GridSettings& grid) {
  std::vector<Axis> axes = grid.axes;
  axes.insert(axes.end(), grid.fixed.begin(), grid.fixed.end());
  std::vector<double> all = values;
  for (const Axis& axis : grid.fixed) all.push_back(axis.values.front());
  return make_candidate(grid.base, axes, all);
}

CandidateResult score_motions(const std::vector<Replay>& replays, const std::vector<ReplayResult>& results,
                              const ScoreSettings& settings) {
  CandidateResult result;
  result.converged = true;
  bool finite = true;
  std::vector<RegistrationProblem> problems;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    result.converged = result.converged && results[r].converged;
    result.residual_max = sim::worst(result.residual_max, results[r].residual_max);
    result.penetration_max = sim::worst(result.penetration_max, results[r].penetration_max);
    finite = finite && results[r].finite;
    problems.push_back(registration_problem(replays[r], results[r].motion));
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

namespace {

CandidateResult score_candidate(const std::vector<Replay>& replays, const GridSettings& settings,
                                const std::vector<Axis>& axes, const std::vector<double>& values,
                                const std::optional<MotionStore>& kept) {
  const ReplayCandidate candidate = make_candidate(settings.base, axes, values);
  std::vector<ReplayResult> motions;
  for (const Replay& replay : replays)
    motions.push_back(kept ? kept->run(replay, candidate) : std::move(run(replay, {candidate}).front()));
  CandidateResult result = score_motions(replays, motions, settings.score);
  result.values.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(settings.axes.size()));
  return result;
}

}  // namespace

bool grid_search(const std::vector<Replay>& replays, const GridSettings& settings, ResultsStore& store,
                 const std::function<void(const Progress&)>& progress, const std::atomic<bool>* stop) {
  using Clock = std::chrono::steady_clock;
  std::vector<Axis> axes = settings.axes;
  axes.insert(axes.end(), settings.fixed.begin(), settings.fixed.end());
  check_axes(axes, settings.base.material.constitutive);
  const std::vector<std::vector<double>> grid = cartesian_product(axes);

  std::vector<int> wanted;
  for (int id = 0; id < static_cast<int>(grid.size()); ++id) {
    if (!store.contains(id)) wanted.push_back(id);
  }
  Progress state;
  state.total = static_cast<int>(grid.size());
  state.done = state.total - static_cast<int>(wanted.size());
  const int done_before = state.done;
  state.best_score = std::numeric_limits<double>::infinity();
  for (const CandidateResult& result : store.results().candidates) {
    state.best_score = std::min(state.best_score, result.score);
  }

  std::vector<Replay> single =
      replays;  // one candidate a thread: the solver is not to spawn threads of its own
  for (Replay& replay : single) {
    replay.settings.threads = 1;
    if (stop != nullptr) replay.settings.solver.stop = stop;
  }
  const std::optional<MotionStore> kept =
      settings.rollouts.empty() ? std::nullopt : std::optional<MotionStore>(settings.rollouts);
  const Clock::time_point begin = Clock::now();
  std::mutex mutex;  // of all below
  std::condition_variable written;
  std::size_t next = 0, next_to_write = 0;  // indices into wanted
  std::map<std::size_t, CandidateResult> finished;
  std::exception_ptr failure;
  bool stopped = false;
  const auto work = [&] {
    std::unique_lock lock(mutex);
    try {
      while (true) {
        // Results are written in order of id: those that come early wait, a batch of them at most.
        written.wait(lock, [&] {
          return failure || stopped || next >= wanted.size() ||
                 next < next_to_write + static_cast<std::size_t>(settings.envs);
        });
        if (failure || stopped || next >= wanted.size()) return;
        const std::size_t i = next++;
        lock.unlock();
        if (stop != nullptr && *stop) throw data::Stopped();
        CandidateResult result = score_candidate(single, settings, axes, grid[wanted[i]], kept);
        result.id = wanted[i];
        lock.lock();

        state.best_score = std::min(state.best_score, result.score);
        ++state.done;
        finished.emplace(i, std::move(result));
        std::vector<CandidateResult> batch;
        for (; !finished.empty() && finished.begin()->first == next_to_write; ++next_to_write) {
          batch.push_back(std::move(finished.begin()->second));
          finished.erase(finished.begin());
        }
        if (!batch.empty()) store.append(batch);
        written.notify_all();
        const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
        state.candidates_per_second = (state.done - done_before) / std::max(seconds, 1e-9);
        state.seconds_left = (state.total - state.done) / state.candidates_per_second;
        if (progress) progress(state);
      }
    } catch (const data::Stopped&) {
      if (!lock.owns_lock()) lock.lock();
      stopped = true;
      written.notify_all();
    } catch (...) {
      if (!lock.owns_lock()) lock.lock();
      failure = std::current_exception();
      written.notify_all();
    }
  };
  {
    std::vector<std::jthread> workers;
    const int threads = std::clamp(std::min(settings.threads, settings.envs), 1,
                                   std::max(1, static_cast<int>(wanted.size())));
    for (int t = 1; t < threads; ++t) workers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return state.done == state.total;
}

}  // namespace flash::sysid
