#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>

namespace flash::sysid {

/// Shares that were waited for in vain, by any thread.
struct AbsentShares {
  std::mutex mutex;
  std::set<int> indices;
};

/// The share that one of several programs takes of the motions of a search. They keep motions in one folder
/// (MotionStore): each simulates its own, and reads those of the others as they come. The programs need not
/// know of each other, since all ask for the same motions in the same order.
struct Shard {
  int index = 0;          ///< from 0
  int count = 1;          ///< programs; 1: all is simulated here
  bool waits = true;      ///< for the others; else OthersMissing is thrown
  double patience = 300;  ///< without a motion of theirs, after which it is simulated here [s]
  std::function<void(const std::string&)> told = {};  ///< that such are simulated here
  std::shared_ptr<AbsentShares> absent =
      std::make_shared<AbsentShares>();  ///< which are not waited for again
};

/// What is left to others who are not waited for.
struct OthersMissing : std::runtime_error {
  explicit OthersMissing(std::size_t count)
      : std::runtime_error(std::to_string(count) + " motions of other shares are missing"), motions(count) {}
  std::size_t motions;
};

/// Whose motion stands at `place` of a list, from 0: they take turns. Lists begin at unlike ones, since many
/// have a single motion. `first_key`: motion_key of the first in the list.
int owner_of(std::size_t place, const std::string& first_key, int count);

}  // namespace flash::sysid
