#pragma once
#include <functional>

#include "sysid/emulate/grid_search.h"

namespace flash::sysid {

/// What the answer of a search with kept motions takes beside its candidates.
struct AnswerWork {
  int motions = 0;  ///< simulated, or read where an earlier search kept them
  int scores = 0;   ///< of interpolated motions
};

/// Told of work that is `done`, and of work that was allowed for and turned out not to be needed (`spared`;
/// below 0: needed beside it), by any thread.
using TellWork = std::function<void(const AnswerWork& done, const AnswerWork& spared)>;

/// How much work there is left at most, and for how long, from what the work before took.
class AnswerMeter {
 public:
  explicit AnswerMeter(const AnswerWork& most) : most_(most) {}

  /// `seconds`: since the work before was told.
  void take(const AnswerWork& done, const AnswerWork& spared, double seconds);

  const AnswerWork& done() const { return done_; }
  const AnswerWork& most() const { return most_; }
  double seconds_left() const;  ///< of the kinds of work of which some is done

 private:
  AnswerWork done_, most_;
  double motion_seconds_ = 0, score_seconds_ = 0;
};

}  // namespace flash::sysid
