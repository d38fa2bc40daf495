#pragma once
#include <chrono>
#include <optional>
#include <string>

#include "apps/sysid/options.h"
#include "sysid/infer/answer_work.h"

namespace flash {

/// Progress with rate and time left on stderr: one line drawn over itself on a terminal, elsewhere a line
/// each tenth of the way (at most one a second) or half a minute. Silent with --quiet.
class ProgressLine {
 public:
  explicit ProgressLine(const CommonOptions& options);
  ~ProgressLine();
  /// `seconds_left`: of the whole search, its answer included.
  void show(const sysid::Progress& progress, std::optional<double> seconds_left);
  void show(const sysid::AnswerMeter& meter, std::optional<double> seconds_left);

 private:
  using Clock = std::chrono::steady_clock;
  bool due(double share);
  void draw(const std::string& line);

  bool visible_, terminal_;
  bool drawn_ = false;
  int tenths_ = 0;  ///< of the way, at the last line
  Clock::time_point begin_ = Clock::now(), last_ = begin_;
};

}  // namespace flash
