#include "sysid/infer/time_left.h"

#include <algorithm>

namespace flash::sysid {

void TimeLeft::take_candidates(double left, double seconds_each) {
  candidates_left_ = left;
  seconds_each_ = seconds_each;
}

void TimeLeft::begin(SearchStage stage, double at) {
  const double lasted = at - began_;
  if (stage_ == SearchStage::first_look && lasted > 0 && expected_.first_look > 0)
    seconds_each_ = lasted / expected_.first_look;
  if (stage_ == SearchStage::lattice) lattice_seconds_ += lasted;
  if (stage_ == SearchStage::candidates) candidates_left_ = 0;
  stage_ = stage;
  began_ = at;
  lattices_ += stage == SearchStage::lattice;
}

std::optional<double> TimeLeft::seconds_each() const {
  const int over = lattices_ - (stage_ == SearchStage::lattice);
  if (seconds_each_ || over <= 0) return seconds_each_;
  return lattice_seconds_ / over / expected_.lattice;
}

double TimeLeft::duration(SearchStage stage) const {
  const int over = lattices_ - (stage_ == SearchStage::lattice);
  const double each = seconds_each().value_or(0);
  switch (stage) {
    case SearchStage::candidates:
      return candidates_left_ * each;
    case SearchStage::first_look:
      return expected_.first_look * each;
    case SearchStage::lattice:
      return over > 0 ? lattice_seconds_ / over : expected_.lattice * each;
    case SearchStage::end:
      break;
  }
  return expected_.end * each;
}

std::optional<double> TimeLeft::seconds(double at) const {
  // Of its duration is left of a stage, at least. Work: for the time left alone.
  constexpr double kOverdue = 0.1;
  // Lattice that follows another, as a rule, however many there were. Work: for the time left alone.
  constexpr double kMore = 1;
  if (!seconds_each()) return std::nullopt;
  const double own = duration(stage_);
  double left = stage_ == SearchStage::candidates ? own : std::max(own - (at - began_), kOverdue * own);
  if (stage_ < SearchStage::first_look) left += duration(SearchStage::first_look);
  if (stage_ < SearchStage::lattice)
    left += expected_.lattices * duration(SearchStage::lattice);
  else if (stage_ == SearchStage::lattice && expected_.lattices > 0)
    left += std::max(expected_.lattices - lattices_, kMore) * duration(SearchStage::lattice);
  if (stage_ < SearchStage::end) left += duration(SearchStage::end);
  return left;
}

}  // namespace flash::sysid
