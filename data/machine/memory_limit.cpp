#include "data/machine/memory_limit.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>

namespace flash::data {

double memory_limit() {
  double least = std::numeric_limits<double>::infinity();
  const long pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGE_SIZE);
  if (pages > 0 && size > 0) least = static_cast<double>(pages) * static_cast<double>(size);
  double group = 0;
  if (std::ifstream("/sys/fs/cgroup/memory.max") >> group)
    least = std::min(least, group);  // "max": no number
  rlimit own{};
  if (getrlimit(RLIMIT_AS, &own) == 0 && own.rlim_cur != RLIM_INFINITY)
    least = std::min(least, static_cast<double>(own.rlim_cur));
  return least < std::numeric_limits<double>::infinity() ? least : 0;
}

}  // namespace flash::data
