#pragma once
#include <string>
#include <vector>

#include "calib/calibrate/cell.h"

namespace flash::calib {

/// A joint solution is none where its recordings contradict each other.
struct CellCheckSettings {
  double corners = 3;  ///< noise of corners over the largest that a member has by itself
  double away = 3;     ///< of a camera from where a member alone has it, over the member's 95 % region
};

/// Why a cell that was solved jointly cannot be used, a sentence each: corners scatter as they do in no
/// member by itself; a camera is not where a member alone puts it; an arm is wrong by more than arms are; a
/// place is not known. refined: the solution; cell: its frames.
std::vector<std::string> cell_contradictions(const std::vector<CellMember>& members,
                                             const Refinement& refined, const Cell& cell,
                                             const CellCheckSettings& settings = {});

}  // namespace flash::calib
