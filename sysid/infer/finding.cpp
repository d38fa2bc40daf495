#include "sysid/infer/finding.h"

namespace flash::sysid {

std::string to_string(Identifiable identifiable) {
  switch (identifiable) {
    case Identifiable::yes:
      return "yes";
    case Identifiable::lower_bound:
      return "lower_bound";
    case Identifiable::upper_bound:
      return "upper_bound";
    case Identifiable::no:
      break;
  }
  return "no";
}

std::string to_string(RangeEdge edge) {
  return edge == RangeEdge::low ? "low" : edge == RangeEdge::high ? "high" : "";
}

std::string edge_text(RangeEdge edge) {
  return edge == RangeEdge::low    ? "the best value is the lowest searched: search lower"
         : edge == RangeEdge::high ? "the best value is the highest searched: search higher"
                                   : "";
}

}  // namespace flash::sysid
