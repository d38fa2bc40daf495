#pragma once

namespace flash::sysid {

/// By how much later a recording's observations were made than their times say, errors of the solution taken
/// out.
struct ClockOffset {
  double estimate = 0, sd = 0;  ///< [s]
};

}  // namespace flash::sysid
