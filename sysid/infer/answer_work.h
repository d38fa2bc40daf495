#pragma once
#include <functional>

#include "sysid/emulate/grid_search.h"

namespace flash::sysid {

/// What the answer of a search with kept motions takes beside its candidates.
struct AnswerWork {
  int motions = 0;   ///< simulated, or read where an earlier search kept them
  int scores = 0;    ///< of interpolated motions
  int lattices = 0;  ///< of motions about the answer, told as they begin
  int ends = 0;      ///< 1 as soon as no lattice follows
};

/// Told of work that is `done`, and of work that was allowed for and turned out not to be needed (`spared`;
/// below 0: needed beside it), by any thread.
using TellWork = std::function<void(const AnswerWork& done, const AnswerWork& spared)>;

/// How much work is done, and is there at most.
class AnswerMeter {
 public:
  explicit AnswerMeter(const AnswerWork& most) : most_(most) {}

  void take(const AnswerWork& done, const AnswerWork& spared);

  const AnswerWork& done() const { return done_; }
  const AnswerWork& most() const { return most_; }

 private:
  AnswerWork done_, most_;
};

}  // namespace flash::sysid
