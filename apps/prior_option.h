#pragma once
#include <string>

#include "sysid/infer/fit/prior.h"

namespace flash {

/// "bending=1e-5:2" of --prior. Throws data::InputError that names the option.
sysid::Prior parse_prior(const std::string& text);

}  // namespace flash
