#pragma once
#include "sim/law/host_device.h"
#include "sim/newton/step_numbers.h"

namespace flash::sim {

// The line search of Newton's iteration, for the processor and for a device. Of a line the potential [J],
// with friction at the normal forces of its start, and the norm of the residual [N] are known
// - at its start: start_potential() and start_residual()
// - at a point on it, the trial: trial_potential() and trial_residual(); end_slope() is that of the potential
//   there, by the length [J]; move(length) makes the trial the point so many directions from the start, or a
//   nearer one, and returns its length
// - at a second point: likewise, by move_second(length); take_second() makes it the trial

/// The potential guides the step. It is not exact where the surface is curved or the normal forces change.
/// Near the solution it falls by less than its rounding. So a smaller residual does as well. `coupled`: the
/// direction is that of forces which no potential has. `slope`: of the potential at the start.
template <typename Line>
FLASH_HOST_DEVICE bool acceptable(const Line& line, bool coupled, double slope, double length) {
  return (!coupled && line.trial_potential() <= line.start_potential() + armijo_share * length * slope) ||
         line.trial_residual() <= (1 - residual_share * length) * line.start_residual();
}

/// Halves a whole step until it is acceptable or too short; returns its length.
template <typename Line>
FLASH_HOST_DEVICE double shorten(Line& line, bool coupled, double slope) {
  double length = line.move(1);
  while (!acceptable(line, coupled, slope, length) && length > least_length) length = line.move(0.5 * length);
  return length;
}

/// By what a secant lengthens a step that ends where the slope is `end`.
FLASH_HOST_DEVICE inline double growth_of(double slope, double end) {
  const double secant = slope / (slope - end);
  return secant < least_growth ? least_growth : secant > greatest_growth ? greatest_growth : secant;
}

/// Goes on along the line, by secants, while the potential falls. A sheet about to buckle needs it: the
/// matrix, made positive, is stiffer than the sheet, and steps are too short. Returns the length of the
/// trial.
template <typename Line>
FLASH_HOST_DEVICE double lengthen(Line& line, double slope, double length) {
  while (length >= 1 && length < greatest_length) {
    const double end = line.end_slope();
    if (end > flat_slope * slope) break;
    const double further = line.move_second(length * growth_of(slope, end));
    if (line.second_potential() >= line.trial_potential() ||
        !(line.second_residual() < residual_growth * line.start_residual()))
      break;
    length = further;
    line.take_second();
  }
  return length;
}

}  // namespace flash::sim
