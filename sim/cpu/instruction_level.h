#pragma once
#include <vector>

namespace flash::sim {

/// Instruction sets that the kernels are compiled for: x86-64-v2 (SSE 4.2), x86-64-v3 (AVX2, FMA) and
/// x86-64-v4 (AVX-512); on other architectures the compiler's own. Results depend on the level, by rounding,
/// and on nothing else of the machine.
enum class InstructionLevel { generic, v2, v3, v4 };

/// The name of a level, such as "x86-64-v3".
const char* to_string(InstructionLevel level);

/// The levels that this machine has, lowest first; it needs x86-64-v2.
std::vector<InstructionLevel> instruction_levels();

InstructionLevel highest_instruction_level();

struct Kernels;

/// The kernels compiled for a level, one of instruction_levels(). Throws std::invalid_argument for another.
const Kernels& kernels_of(InstructionLevel level);

}  // namespace flash::sim
