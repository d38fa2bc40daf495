#include "sysid/infer/answer_work.h"

namespace flash::sysid {

void AnswerMeter::take(const AnswerWork& done, const AnswerWork& spared, double seconds) {
  done_.motions += done.motions;
  done_.scores += done.scores;
  most_.motions -= spared.motions;
  most_.scores -= spared.scores;
  (done.motions > 0 ? motion_seconds_ : score_seconds_) += seconds;
}

double AnswerMeter::seconds_left() const {
  const auto left = [](int done, int most, double seconds) {
    return done > 0 ? (most - done) * seconds / done : 0;
  };
  return left(done_.motions, most_.motions, motion_seconds_) +
         left(done_.scores, most_.scores, score_seconds_);
}

}  // namespace flash::sysid
