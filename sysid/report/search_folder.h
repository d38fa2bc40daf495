#pragma once
#include <string>

#include "sysid/emulate/results_reader.h"
#include "sysid/report/summary.h"

namespace flash::sysid {

/// What a search that came to its end left in its folder.
struct SearchFolder {
  Summary summary;
  GridResults results;
};

/// Reads summary.json and the results it was made from. Throws data::InputError as load_summary and
/// load_grid_results do, and where the summary was made from other tables than those beside it.
SearchFolder load_search_folder(const std::string& folder);

}  // namespace flash::sysid
