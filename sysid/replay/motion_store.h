#pragma once
#include <functional>
#include <string>
#include <vector>

#include "sysid/replay/replay.h"
#include "sysid/replay/shard.h"

namespace flash::sysid {

/// The motion of a candidate in a replay.
struct WantedMotion {
  const Replay* replay;
  ReplayCandidate candidate;
};

/// One that another shard is to simulate.
struct MissingMotion {
  std::string key;
  int owner;
  WantedMotion wanted;
};

/// What names a motion: the SHA-256 of everything that decides it.
std::string motion_key(const Replay& replay, const ReplayCandidate& candidate);

/// A folder of simulated motions, so that the same candidates can be scored again without simulating them:
/// against another recording of the same motion, under another objective, in a search with more values. A
/// motion is kept at the steps around its keyframes only, in double precision, in a file of its own named by
/// the SHA-256 of everything that decides it (sheet, start, grippers, table, solver, material, and the
/// sources of the solver: motions of another state of them are simulated again). Files are written whole or
/// not at all, with this name and the SHA-256 of their numbers; several programs may share a folder. Nothing
/// waits for the disk: a file that a power cut left otherwise than it was written is simulated again.
class MotionStore {
 public:
  /// Creates the folder; removes what programs that were killed a day ago or earlier left in it. Throws
  /// std::runtime_error where it cannot.
  explicit MotionStore(const std::string& folder, Shard shard = {});

  /// The candidates' motions at the scored steps, from the folder where they are there, else simulated and
  /// kept. `finished` as in sysid::run. Throws data::InputError naming a file that is whole and
  /// not that motion.
  void run(const Replay& replay, const std::vector<ReplayCandidate>& candidates,
           const std::function<void(std::size_t, ReplayResult)>& finished) const;

  /// That of one candidate.
  ReplayResult run(const Replay& replay, const ReplayCandidate& candidate) const;

  /// Simulates what the folder lacks of motions that are asked for next: those of a replay as a batch, and
  /// replays side by side. Of several shards each takes its own, tells of each (`simulated`, by any thread),
  /// and waits for the others; those that do not come in time it simulates, too. Throws OthersMissing where
  /// it is not to wait, data::Stopped where the solver is to stop.
  void prepare(const std::vector<WantedMotion>& wanted, const std::function<void()>& simulated = {}) const;

  /// Copies the whole motions of another folder that this one lacks. Returns how many.
  int take_from(const std::string& folder) const;

 private:
  std::string path_of(const std::string& key) const;
  bool has(const std::string& key) const;
  void read_or_simulate(const Replay& replay, const std::vector<ReplayCandidate>& candidates,
                        const std::function<void(std::size_t, ReplayResult)>& finished) const;
  void simulate(const std::vector<WantedMotion>& wanted, const std::function<void()>& simulated) const;
  void wait_for(std::vector<MissingMotion> missing) const;
  void give_up(const std::vector<MissingMotion>& missing) const;
  std::vector<WantedMotion> take_of_absent(std::vector<MissingMotion>& missing) const;

  std::string folder_;
  Shard shard_;
};

}  // namespace flash::sysid
