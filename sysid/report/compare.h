#pragma once
#include <map>
#include <string>
#include <vector>

#include "sysid/infer/model_comparison.h"
#include "sysid/report/summary.h"

namespace flash::sysid {

/// A search as it is compared: what it found, and what its estimate leaves.
struct FinishedSearch {
  std::string name;
  Summary summary;
  std::vector<LeftResiduals> residuals;
};

/// One of several searches of the same observations.
struct ComparedSearch {
  double excess = 0;       ///< -2 log likelihood of its estimate over that of the reference
  double occupied = 0;     ///< log of the share of what it left open that is likely
  double probability = 0;  ///< were all as likely before
  std::map<std::string, std::string> differs;  ///< settings and held values that are not alike in all
};

/// Reads what a search left in its folder. Throws data::InputError as load_search_folder does, and where the
/// search is of an earlier program, which kept no residuals, or came to no estimate.
FinishedSearch load_finished_search(const std::string& folder);

/// How likely searches of the same observations are beside each other, by their generalized marginal
/// likelihood (Bissiri, Holmes and Walker 2016): exp(-excess / 2) times what of all that it left open each
/// leaves likely, so that a model of more parameters pays for them. The reference is the search of least mean
/// distance. Throws data::InputError where what was observed is not the same in all: recordings, keyframes
/// that count, observations, and how they count.
std::vector<ComparedSearch> compare(const std::vector<FinishedSearch>& searches);

}  // namespace flash::sysid
