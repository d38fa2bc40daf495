#pragma once
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/adaptive_design.h"
#include "sysid/report/search_folder.h"

namespace flash::sysid {

/// Where a fit begins that goes on from a search.
struct FitStart {
  GridSettings grid;           ///< axes, constants and deviations alone
  std::vector<double> values;  ///< of the search's estimate, one an axis
  Extent around;               ///< its intervals, or what stays open; of what is held the value alone
};

/// What the search held stays held, unless `held` says otherwise, and what it found is where the fit begins.
/// `held`: "friction=0.3" as parse_hold reads it, or a name alone: at the value where the search found the
/// parameter, or as it held it. Throws data::InputError naming --hold: unknown or given twice, a name that
/// the search has no value of, or no parameter left.
FitStart fit_start(const SearchFolder& search, const std::vector<std::string>& held);

}  // namespace flash::sysid
