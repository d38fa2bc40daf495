#include "sysid/report/search_folder.h"

#include <filesystem>

#include "data/files/error.h"
#include "sysid/emulate/candidate_lines.h"

namespace flash::sysid {

SearchFolder load_search_folder(const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / "summary.json").string();
  SearchFolder search{load_summary(path), load_grid_results(folder)};
  if (const std::string digest = digest_of(search.results); search.summary.results_digest != digest)
    throw data::input_error(path, "results_digest",
                            "found \"" + search.summary.results_digest + "\", expected \"" + digest +
                                "\", as of the tables beside it: it was made from others; grid --resume "
                                "writes it anew");
  return search;
}

}  // namespace flash::sysid
