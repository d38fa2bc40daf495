#pragma once
#include <string>
#include <string_view>

namespace flash::data {

/// Whether this processor has instructions for it, which take a tenth of the time.
bool has_sha256_instructions();

/// SHA-256 of some bytes, 64 hexadecimal digits (FIPS 180-4). The digest is the same with and without the
/// instructions.
std::string sha256(std::string_view bytes, bool by_instructions = has_sha256_instructions());

}  // namespace flash::data
