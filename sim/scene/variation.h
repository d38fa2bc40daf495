#pragma once
#include <array>
#include <string>
#include <vector>

#include "sim/scene/environment.h"

namespace flash::sim {

/// What differs between environments of one scene, as a factor on what the scene has.
struct Variation {
  std::string name;              ///< one of variation_names
  double low = 1.0, high = 1.0;  ///< of the factor, above 0
  bool logarithmic = false;      ///< even in the logarithm of the factor

  bool operator==(const Variation&) const = default;
};

/// young (E t of sheets, E of solids), bending, density (of sheets per area), friction (of materials,
/// obstacles and layers).
inline constexpr std::array variation_names = {"young", "bending", "density", "friction"};

/// Reads "bending=0.5:2:log,friction=0.2:0.8". Throws data::InputError, naming `option`.
std::vector<Variation> parse_variations(const std::string& text, const std::string& option);

/// Whether an environment has what would differ, and not as 0, which no factor changes.
bool applies(const Variation& variation, const Environment& environment);

/// The factor of `variations[index]` in environment `number`. Environment 0 is the scene itself, and has 1.
/// The others are spread evenly over all variations together, whatever their number: the points of Halton
/// (1960) from the second on, of which the first ones are those of any smaller number of environments. The
/// first one is the middle of the first range, often the scene itself.
double factor_of(const std::vector<Variation>& variations, std::size_t index, int number);

/// Environment `number` of those that differ from `environment`.
Environment varied(Environment environment, const std::vector<Variation>& variations, int number);

}  // namespace flash::sim
