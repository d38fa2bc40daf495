#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "sysid/emulate/parameter_grid.h"
#include "sysid/emulate/results_store.h"
#include "sysid/observe/registration.h"
#include "sysid/replay/replay.h"
#include "sysid/replay/shard.h"

namespace flash::sysid {

struct ScoreSettings {
  Objective objective;
  RegistrationSettings registration;
  SharedRegistration shared;  ///< between the recordings of one search
};

struct GridSettings {
  MaterialBase base;
  std::vector<Axis> axes;   ///< searched; the last runs fastest
  std::vector<Axis> fixed;  ///< one value each
  /// One value each: of what is held and not known, where recordings tell that it is another than was
  /// assumed.
  std::vector<Axis> centres = {};
  std::map<std::string, double> deviations =
      {};  ///< standard deviation of what is held, where one was stated
  ScoreSettings score;
  int envs = 64;  ///< candidates in a batch, at most
  int threads = 1;
  std::string rollouts;  ///< folder that keeps the motions (MotionStore); empty: none are kept
  Shard shard = {};      ///< of the motions; the others are of programs that share `rollouts`
};

/// A value that was measured becomes a constant, another an axis of one value.
void add_holds(const std::vector<Hold>& holds, GridSettings& settings);

struct Progress {
  int done = 0;  ///< candidates with a result, those of an earlier run included
  int total = 0;
  double candidates_per_second = 0;  ///< of this run
  double seconds_left = 0;
  double best_score = 0;  ///< [m]; infinity before the first
};

/// Candidate of a search at values that need not be on the grid, one an axis.
ReplayCandidate candidate_at(const std::vector<double>& values, const GridSettings& grid);

/// Registers and scores simulated motions, one a replay. `searches`: for each replay's clouds, or none.
CandidateResult score_motions(const std::vector<Replay>& replays, const std::vector<ReplayResult>& results,
                              const ScoreSettings& settings, const std::vector<CloudSearches>& searches = {});

/// The registrations that score_motions finds, without the scores; of motions that diverged none is sought.
std::vector<Registration> registrations_of(const std::vector<Replay>& replays,
                                           const std::vector<ReplayResult>& results,
                                           const ScoreSettings& settings);

/// Simulates and scores every candidate of the grid that `store` does not hold yet and appends it there,
/// `envs` candidates at a time, a batch a recording. Candidates that diverge or miss the
/// tolerance are marked, never a reason to stop. Results are appended in order of id, so that the files do
/// not depend on threads; an end at any moment loses at most `envs` of them. `progress` is called after each
/// candidate, one thread at a time; `stop`, once set, ends the search after the steps in work, and the
/// candidates in work are left out, as after a sim::DeviceError, which names its. True when all is there.
/// Of several shards each first simulates its own motions of all candidates. Throws OthersMissing.
bool grid_search(const std::vector<Replay>& replays, const GridSettings& settings, ResultsStore& store,
                 const std::function<void(const Progress&)>& progress = {},
                 const std::atomic<bool>* stop = nullptr);

}  // namespace flash::sysid
