#include "apps/prior_option.h"

#include <optional>
#include <string_view>

#include "data/error.h"
#include "data/text.h"
#include "sysid/emulate/parameter_grid.h"

namespace flash {

sysid::Prior parse_prior(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const std::string expected = "expected name=value:factor, as bending=1e-5:2";
  if (colon == std::string::npos) throw data::InputError("--prior: \"" + text + "\": " + expected);
  const sysid::Axis axis = sysid::parse_fixed(text.substr(0, colon), "--prior");
  const std::optional<double> spread = data::parse_number(std::string_view(text).substr(colon + 1));
  const bool factor = axis.values.front() > 0;
  if (!spread || !(*spread > (factor ? 1 : 0)))
    throw data::InputError("--prior: \"" + text + "\": found the spread " + text.substr(colon + 1) +
                           ", expected " + (factor ? "a factor above 1" : "a number above 0"));
  return {axis.name, axis.values.front(), *spread};
}

}  // namespace flash
