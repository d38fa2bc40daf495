#include "sim/cpu/instruction_level.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#ifdef __x86_64__
#include <cpuid.h>
#endif

#include "sim/cpu/kernels.h"

namespace flash::sim {

const char* to_string(InstructionLevel level) {
  switch (level) {
    case InstructionLevel::v2:
      return "x86-64-v2";
    case InstructionLevel::v3:
      return "x86-64-v3";
    case InstructionLevel::v4:
      return "x86-64-v4";
    default:
      return "generic";
  }
}

#ifdef __x86_64__

// sim/cpu/kernels is compiled once for each level.
namespace v2 {
extern const Kernels kernels;
}
namespace v3 {
extern const Kernels kernels;
}
namespace v4 {
extern const Kernels kernels;
}

namespace {

const Kernels& compiled_for(InstructionLevel level) {
  return level == InstructionLevel::v4   ? v4::kernels
         : level == InstructionLevel::v3 ? v3::kernels
                                         : v2::kernels;
}

/// F16C, MOVBE and LZCNT, for which __builtin_cpu_supports of GCC 12 and clang 14 has no names. A virtual
/// machine may hide any of them, and LZCNT gives wrong numbers where it is absent.
bool has_rest_of_v3() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  constexpr unsigned standard = bit_F16C | bit_MOVBE, extended = bit_LZCNT;
  return __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & standard) == standard &&
         __get_cpuid(0x80000001, &a, &b, &c, &d) != 0 && (c & extended) == extended;
}

}  // namespace

std::vector<InstructionLevel> instruction_levels() {
  std::vector<InstructionLevel> levels = {InstructionLevel::v2};
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") || !__builtin_cpu_supports("bmi") ||
      !__builtin_cpu_supports("bmi2") || !has_rest_of_v3())
    return levels;
  levels.push_back(InstructionLevel::v3);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    levels.push_back(InstructionLevel::v4);
  return levels;
}

#else

namespace generic {
extern const Kernels kernels;
}

namespace {

const Kernels& compiled_for(InstructionLevel) { return generic::kernels; }

}  // namespace

std::vector<InstructionLevel> instruction_levels() { return {InstructionLevel::generic}; }

#endif

InstructionLevel highest_instruction_level() { return instruction_levels().back(); }

const Kernels& kernels_of(InstructionLevel level) {
  const std::vector<InstructionLevel> levels = instruction_levels();
  if (std::find(levels.begin(), levels.end(), level) == levels.end())
    throw std::invalid_argument("this machine does not have the instructions of " +
                                std::string(to_string(level)));
  return compiled_for(level);
}

}  // namespace flash::sim
