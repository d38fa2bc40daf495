#include "sysid/grid_search.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>

namespace flash::sysid {
namespace {

/// FNV-1a, 64 bits: tells inputs apart, promises nothing against intent.
class Hash {
 public:
  void add(const void* bytes, std::size_t size) {
    const auto* byte = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < size; ++i) state_ = (state_ ^ byte[i]) * 0x100000001b3ULL;
  }
  void add(double value) { add(&value, sizeof value); }
  void add(const std::string& text) {
    add(static_cast<double>(text.size()));
    add(text.data(), text.size());
  }
  template <class Derived>
  void add_matrix(const Eigen::DenseBase<Derived>& matrix) {
    add(static_cast<double>(matrix.rows()));
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
      for (Eigen::Index j = 0; j < matrix.cols(); ++j) add(static_cast<double>(matrix(i, j)));
    }
  }
  std::string text() const {
    char buffer[17];
    std::snprintf(buffer, sizeof buffer, "%016llx", static_cast<unsigned long long>(state_));
    return buffer;
  }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

void add_recording(const Replay& replay, Hash& hash) {
  const data::Recording& recording = replay.recording;
  hash.add(recording.name);
  hash.add_matrix(recording.gravity);
  hash.add_matrix(recording.mesh.vertices);
  hash.add_matrix(recording.mesh.triangles);
  hash.add_matrix(recording.start);
  hash.add(recording.has_table);
  hash.add_matrix(recording.table_point);
  hash.add_matrix(recording.table_normal);
  hash.add_matrix(recording.nuisance.offset);
  hash.add(recording.nuisance.yaw);
  hash.add(recording.nuisance.time);
  for (const auto& [name, trajectory] : recording.trajectories) {
    hash.add(name);
    for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
      hash.add(trajectory.times[i]);
      hash.add_matrix(trajectory.poses[i].matrix());
    }
  }
  const auto shape = replay.settings.grasp_shape;
  for (const data::RecordedGrasp& grasp : recording.grasps) {
    hash.add(grasp.gripper);
    for (const int vertex : grasp.select.vertices) hash.add(vertex);
    if (grasp.select.corner) hash.add(2 * (*grasp.select.corner)[0] + (*grasp.select.corner)[1]);
    if (grasp.select.position) hash.add_matrix(*grasp.select.position);
    for (const double value :
         {grasp.from, grasp.to, replay.settings.grasp_within.value_or(grasp.select.within), grasp.depth,
          grasp.pitch, static_cast<double>(shape.value_or(grasp.shape))}) {
      hash.add(value);
    }
    hash.add_matrix(grasp.direction);
  }
  for (const Observation& observation : replay.observations) {
    hash.add(observation.t);
    hash.add(observation.weight);
    hash.add_matrix(observation.points);
    hash.add_matrix(observation.contour);
    hash.add_matrix(observation.markers);
    if (observation.force) hash.add_matrix(*observation.force);
  }
  for (const double value : {replay.start, static_cast<double>(replay.steps), replay.settings.closing_time,
                             replay.settings.solver.time_step, replay.settings.solver.tolerance,
                             static_cast<double>(replay.settings.solver.max_iterations)}) {
    hash.add(value);
  }
}

}  // namespace

CandidateResult score_motions(const std::vector<Replay>& replays, const std::vector<ReplayResult>& results,
                              const ScoreSettings& settings) {
  CandidateResult result;
  result.converged = true;
  bool finite = true;
  std::vector<RegistrationProblem> problems;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    result.converged = result.converged && results[r].converged;
    result.residual_max = std::max(result.residual_max, results[r].residual_max);
    result.penetration_max = std::max(result.penetration_max, results[r].penetration_max);
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

std::string fingerprint(const std::vector<Replay>& replays, const GridSettings& settings) {
  Hash hash;
  for (const Replay& replay : replays) add_recording(replay, hash);
  const data::SheetMaterial& m = settings.base.material;
  for (const double value :
       {static_cast<double>(m.constitutive), static_cast<double>(m.bending_model), m.membrane_stiffness,
        m.poissons_ratio, m.areal_density, m.bending_rigidity, m.friction, m.air_drag, m.stiffness_damping,
        settings.base.thickness.value_or(-1), static_cast<double>(settings.base.bending_from_thickness)}) {
    hash.add(value);
  }
  for (const auto* axes : {&settings.axes, &settings.fixed}) {
    for (const Axis& axis : *axes) {
      hash.add(axis.name);
      for (const double value : axis.values) hash.add(value);
    }
  }
  const ScoreSettings& score = settings.score;
  for (const double value :
       {static_cast<double>(score.objective.robust.kind), score.objective.robust.trim_fraction,
        score.objective.robust.huber_delta, score.objective.cloud_sigma, score.objective.contour_sigma,
        score.objective.marker_sigma, score.objective.force_sigma,
        static_cast<double>(score.objective.two_sided), static_cast<double>(score.registration.iterations),
        score.registration.softening, static_cast<double>(score.registration.points_per_keyframe),
        score.registration.tolerance, static_cast<double>(score.shared.offset),
        static_cast<double>(score.shared.yaw), static_cast<double>(score.shared.time)}) {
    hash.add(value);
  }
  for (const double time : score.registration.time_starts) hash.add(time);
  return hash.text();
}

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
  for (Replay& replay : single) replay.settings.threads = 1;
  const Clock::time_point begin = Clock::now();
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      while (!(stop != nullptr && stop->load())) {
        const std::size_t i = next++;
        if (i >= wanted.size()) return;
        const std::vector<double>& values = grid[wanted[i]];
        const ReplayCandidate candidate = make_candidate(settings.base, axes, values);
        std::vector<ReplayResult> motions;
        for (const Replay& replay : single) motions.push_back(std::move(run(replay, {candidate}).front()));
        CandidateResult result = score_motions(single, motions, settings.score);
        result.id = wanted[i];
        result.values.assign(values.begin(),
                             values.begin() + static_cast<std::ptrdiff_t>(settings.axes.size()));

        const std::lock_guard lock(mutex);
        store.append(result);
        state.best_score = std::min(state.best_score, result.score);
        ++state.done;
        const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
        state.candidates_per_second = (state.done - done_before) / std::max(seconds, 1e-9);
        state.seconds_left = (state.total - state.done) / state.candidates_per_second;
        if (progress) progress(state);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
      next = wanted.size();
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
