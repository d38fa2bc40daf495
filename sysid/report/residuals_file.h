#pragma once
#include <string>
#include <vector>

#include "sysid/infer/model_comparison.h"

namespace flash::sysid {

/// The text of residuals.csv: what the estimate leaves of every observation that counts, recording by
/// recording. Its digest (residuals_digest) stands in the summary, as what errors of known shape cost does.
std::string residuals_text(const std::vector<LeftResiduals>& recordings);

/// 16 digits of a SHA-256 of the text.
std::string residuals_digest(const std::string& text);

/// Reads residuals.csv. `error_costs`: of each recording. Throws data::InputError naming file and line of
/// what cannot be read, and where the text is not that of `digest`.
std::vector<LeftResiduals> load_residuals(const std::string& path, const std::string& digest,
                                          const std::vector<double>& error_costs);

}  // namespace flash::sysid
