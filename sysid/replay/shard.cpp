#include "sysid/replay/shard.h"

namespace flash::sysid {

int owner_of(std::size_t place, const std::string& first_key, int count) {
  constexpr std::size_t kDigits = 8;  // Of a SHA-256, whose digits are even. Work.
  const std::size_t start = std::stoul(first_key.substr(0, kDigits), nullptr, 16);
  return static_cast<int>((start + place) % static_cast<std::size_t>(count));
}

}  // namespace flash::sysid
