#include "sysid/infer/answer_work.h"

namespace flash::sysid {

void AnswerMeter::take(const AnswerWork& done, const AnswerWork& spared) {
  done_.motions += done.motions;
  done_.scores += done.scores;
  most_.motions -= spared.motions;
  most_.scores -= spared.scores;
}

}  // namespace flash::sysid
