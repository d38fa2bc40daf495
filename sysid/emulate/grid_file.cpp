#include "sysid/emulate/grid_file.h"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/sha256.h"
#include "data/files/text.h"

namespace flash::sysid {
namespace {

constexpr const char* kSchema = "flash-sysid-grid/1";

std::string text_of(const GridFile& grid) {
  nlohmann::json json = {{"schema", kSchema}, {"recordings", grid.recordings}};
  if (grid.fingerprint) json["fingerprint"] = *grid.fingerprint;
  json["axes"] = nlohmann::json::array();
  for (const Axis& axis : grid.axes)
    json["axes"].push_back({{"name", axis.name}, {"values", axis.values}, {"log", axis.logarithmic}});
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::vector<std::string> texts_of(const data::JsonObject& file, const char* key) {
  std::vector<std::string> texts;
  if (!file.raw(key).is_array()) throw file.error(key, "a list of texts");
  for (const nlohmann::json& text : file.raw(key)) {
    if (!text.is_string()) throw file.error(key, "a list of texts");
    texts.push_back(text.get<std::string>());
  }
  return texts;
}

}  // namespace

std::string search_digest(const GridFile& grid) { return data::sha256(text_of(grid)); }

void save_grid_file(const GridFile& grid, const std::string& path) {
  data::write_atomically(path, text_of(grid));
}

GridFile load_grid_file(const std::string& path) {
  const nlohmann::json json = data::load_json(path);
  const data::JsonObject file(json, path);
  if (file.string("schema", "") != kSchema || !file.has("axes") || !file.has("recordings"))
    throw data::InputError(path + ": schema: expected \"" + kSchema + "\" with axes and recordings");
  GridFile grid;
  for (const data::JsonObject& axis : file.objects("axes")) {
    const Eigen::VectorXd values = axis.vector("values", -1);
    if (values.size() == 0) throw axis.error("values", "at least one number");
    if (!axis.has("log")) throw axis.error("log", "true or false");
    grid.axes.push_back({axis.string("name"), {values.begin(), values.end()}, axis.boolean("log", false)});
  }
  grid.recordings = texts_of(file, "recordings");
  if (grid.recordings.empty()) throw file.error("recordings", "at least one name");
  if (file.has("fingerprint")) {
    Fingerprint& fingerprint = grid.fingerprint.emplace();
    const data::JsonObject texts = file.object("fingerprint");
    for (const auto& [name, text] : texts.value().items()) fingerprint[name] = texts.string(name.c_str());
  }
  return grid;
}

std::vector<std::string> share_folders(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<std::string> folders;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(folder) / "shards", none))
    if (data::parse_integer(entry.path().filename().string()) && entry.is_directory(none))
      folders.push_back(entry.path().string());
  return folders;
}

std::vector<std::string> grid_files(const std::string& folder) {
  std::vector<std::string> folders = share_folders(folder), files;
  folders.insert(folders.begin(), folder);
  for (const std::string& of : folders)
    if (const auto file = std::filesystem::path(of) / "grid.json"; std::filesystem::exists(file))
      files.push_back(file.string());
  return files;
}

}  // namespace flash::sysid
