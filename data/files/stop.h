#pragma once
#include <atomic>

#include "data/files/error.h"

namespace flash::data {

/// Throws Stopped once `stop` is set; null: never.
inline void end_once(const std::atomic<bool>* stop) {
  if (stop != nullptr && *stop) throw Stopped();
}

}  // namespace flash::data
