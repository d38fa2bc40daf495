#pragma once
#include <optional>

#include "sysid/infer/expected_work.h"

namespace flash::sysid {

enum class SearchStage { candidates, first_look, lattice, end };

/// How long a search still takes as a rule, from what its parts took until now: parts to come last as
/// ExpectedWork has them, times what those before lasted over that. Once there was a lattice, the next ones
/// last as long.
class TimeLeft {
 public:
  explicit TimeLeft(const ExpectedWork& expected) : expected_(expected) {}

  /// Parts to come in place of those expected before, in the same unit.
  void expect(const ExpectedWork& work) { expected_ = work; }

  /// `seconds_each`: of one candidate [s]; `left`: candidates.
  void take_candidates(double left, double seconds_each);

  /// `at`: on a clock of the caller's [s].
  void begin(SearchStage stage, double at);

  /// Empty while nothing was measured [s].
  std::optional<double> seconds(double at) const;

  /// Of a candidate, as measured; empty before that [s].
  std::optional<double> seconds_each() const;

 private:
  /// How long a stage lasts as a rule [s].
  double duration(SearchStage stage) const;

  ExpectedWork expected_;
  SearchStage stage_ = SearchStage::candidates;
  double began_ = 0;                    ///< of the stage [s]
  std::optional<double> seconds_each_;  ///< of a candidate
  double candidates_left_ = 0;
  int lattices_ = 0;            ///< begun
  double lattice_seconds_ = 0;  ///< of those that are over
};

}  // namespace flash::sysid
