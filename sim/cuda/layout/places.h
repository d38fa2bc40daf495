#pragma once
#include <algorithm>
#include <map>

namespace flash::sim::cuda {

/// Memory that is given back: the lowest place where a piece fits.
class Places {
 public:
  long take(long size) {
    long at = 0;
    for (const auto& [begin, end] : used_) {
      if (begin - at >= size) break;
      at = end;
    }
    if (size > 0) used_[at] = at + size;
    total_ = std::max(total_, at + size);
    return at;
  }
  void give_back(long at, long size) {
    if (size > 0) used_.erase(at);
  }
  long total() const { return total_; }

 private:
  std::map<long, long> used_;
  long total_ = 0;
};

}  // namespace flash::sim::cuda
