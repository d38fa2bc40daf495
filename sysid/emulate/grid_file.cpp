#include "sysid/emulate/grid_file.h"

#include <nlohmann/json.hpp>

#include "data/atomic_file.h"
#include "data/error.h"
#include "data/json_reader.h"
#include "data/sha256.h"

namespace flash::sysid {
namespace {

constexpr const char* kSchema = "flash-sysid-grid/1";

std::string text_of(const GridFile& grid) {
  nlohmann::json json = {{"schema", kSchema}, {"recordings", grid.recordings}};
  if (grid.fingerprint) json["fingerprint"] = *grid.fingerprint;
  json["axes"] = nlohmann::json::array();
  for (const Axis& axis : grid.axes)
    json["axes"].push_back({{"name", axis.name}, {"values", axis.values}, {"log", axis.logarithmic}});
  return json.dump(1) + "\n";
}

}  // namespace

std::string search_digest(const GridFile& grid) { return data::sha256(text_of(grid)); }

void save_grid_file(const GridFile& grid, const std::string& path) {
  data::write_atomically(path, text_of(grid));
}

GridFile load_grid_file(const std::string& path) {
  const nlohmann::json json = data::load_json(path);
  if (!json.is_object() || json.value("schema", "") != kSchema || !json.contains("axes") ||
      !json.contains("recordings"))
    throw data::InputError(path + ": schema: expected \"" + kSchema + "\" with axes and recordings");
  GridFile grid;
  try {
    for (const nlohmann::json& axis : json.at("axes")) {
      grid.axes.push_back({axis.at("name"), axis.at("values").get<std::vector<double>>(), axis.at("log")});
      if (grid.axes.back().values.empty())
        throw data::input_error(path, "axes.values", "found none, expected at least one");
    }
    grid.recordings = json.at("recordings").get<std::vector<std::string>>();
    if (json.contains("fingerprint") && json.at("fingerprint").is_object())
      grid.fingerprint = json.at("fingerprint").get<Fingerprint>();
  } catch (const nlohmann::json::exception& error) {
    throw data::InputError(path + ": " + error.what());
  }
  if (grid.recordings.empty())
    throw data::input_error(path, "recordings", "found none, expected at least one");
  return grid;
}

}  // namespace flash::sysid
