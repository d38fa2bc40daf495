#pragma once
#include <memory>
#include <string>
#include <vector>

#include "sysid/observe/sheet_shift.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// A motion of each recording, kept once however many errors it is part of.
struct Motions {
  std::vector<Replay> replays;  ///< of the motions; other meshes and steps than those observed, or the same
  std::vector<ReplayResult> results;
};

struct MotionTerm {
  double factor = 1;
  std::shared_ptr<const Motions> motions;
};

/// A sum of motions whose factors add up to zero.
using MotionChange = std::vector<MotionTerm>;

/// An error of known shape: of u standard deviations it moves the sheet by s u terms + (s u)^2 bend, s its
/// spread.
struct KnownError {
  MotionChange terms;
  bool shared = true;      ///< all recordings have the same error, not each its own
  bool corrects = false;   ///< the likelihood is that of motions moved by it; its size stays uncertain
  MotionChange bend = {};  ///< none where empty
  std::string name = {};   ///< of what is wrong, where it has one
  double spread = 1;       ///< standard deviation, of the terms
  std::vector<double> found_at = {};  ///< values of the estimate, where that counts
};

/// The change of recording r at each keyframe of `replay`, on its mesh, `time_offset` [s] after the clock of
/// the recording.
SheetShifts shifts_of(const MotionChange& change, std::size_t r, const Replay& replay, double time_offset);

}  // namespace flash::sysid
