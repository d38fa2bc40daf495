#include "apps/sysid/progress_line.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "data/files/text.h"

namespace flash {
namespace {

std::string duration_text(double seconds) {
  char text[32];
  if (seconds < 90) {
    std::snprintf(text, sizeof text, "%.0f s", seconds);
  } else if (seconds < 5400) {
    std::snprintf(text, sizeof text, "%.0f min", seconds / 60);
  } else {
    std::snprintf(text, sizeof text, "%.1f h", seconds / 3600);
  }
  return text;
}

std::string left_text(double seconds) { return "about " + duration_text(seconds) + " left"; }

}  // namespace

ProgressLine::ProgressLine(const CommonOptions& options)
    : visible_(!options.quiet), terminal_(isatty(STDERR_FILENO) != 0) {}

ProgressLine::~ProgressLine() {
  if (drawn_) std::cerr << '\n';
}

/// `share`: of the way.
bool ProgressLine::due(double share) {
  if (!visible_) return false;
  if (terminal_ || share >= 1) return true;
  const int tenths = static_cast<int>(10 * share);
  const double since = std::chrono::duration<double>(Clock::now() - last_).count();
  if (since < 30 && (tenths == tenths_ || since < 1)) return false;
  tenths_ = tenths;
  return true;
}

void ProgressLine::show(const sysid::Progress& progress, std::optional<double> seconds_left) {
  if (!due(static_cast<double>(progress.done) / std::max(1, progress.total))) return;
  char line[160], best[40] = "none has a score";
  if (std::isfinite(progress.best_score))
    std::snprintf(best, sizeof best, "best %.2f mm", 1000 * progress.best_score);
  std::snprintf(line, sizeof line, "%d of %d candidates, %.2f/s, %s%s", progress.done, progress.total,
                progress.candidates_per_second, best,
                seconds_left ? (", with the answer " + left_text(*seconds_left)).c_str() : "");
  draw(line);
}

void ProgressLine::show(const sysid::AnswerMeter& meter, std::optional<double> seconds_left) {
  const double elapsed = std::chrono::duration<double>(Clock::now() - begin_).count();
  // Below 1: what is expected is never over.
  if (!due(seconds_left ? elapsed / (elapsed + std::max(*seconds_left, 1e-3)) : 0)) return;
  const auto part = [](int count, int of, const std::string& what) {
    return data::format_count(static_cast<std::size_t>(count)) + " of at most " +
           data::format_count(static_cast<std::size_t>(of)) + what;
  };
  draw("the answer: " + part(meter.done().motions, meter.most().motions, " motions, ") +
       part(meter.done().scores, meter.most().scores, " scores between them") +
       (seconds_left ? ", " + left_text(*seconds_left) : ""));
}

void ProgressLine::draw(const std::string& line) {
  last_ = Clock::now();
  drawn_ = terminal_;
  std::cerr << (terminal_ ? "\r" : "") << line << (terminal_ ? "\033[K" : "\n") << std::flush;
}

}  // namespace flash
