#pragma once
#include <nlohmann/json_fwd.hpp>

#include "data/asset/asset.h"

namespace flash::data {

class JsonObject;

/// The unit of each number of an asset in "flash-asset/1", by its name in the file: {"young": "Pa", ...}.
/// Those of `numbers`, an object of the file, alone; a number without a unit has "1".
nlohmann::ordered_json units_of(const nlohmann::ordered_json& numbers, const Asset& asset);

/// Throws InputError where `units` names what is no number of an asset, or states another unit than the one
/// that the number is read in.
void check_units(const JsonObject& units, const Asset& asset);

}  // namespace flash::data
