#include "sysid/capture/segmented_cell.h"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "data/files/atomic_file.h"
#include "data/files/json_reader.h"

namespace flash::sysid {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "flash-segment/1";

Json numbers(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

}  // namespace

void save_segmented_cell(const SegmentedCell& cell, const std::string& path) {
  Json json = {{"schema", kSchema}};
  json["table"] = nullptr;
  if (cell.table)
    json["table"] = {{"point", numbers(cell.table->point)}, {"normal", numbers(cell.table->normal)}};
  json["times"] = cell.times;
  json["trajectory"] =
      cell.trajectory.empty() ? Json(nullptr) : Json(data::relative_path(cell.trajectory, path));
  json["cameras"] = Json::array();
  for (const Eigen::Vector3d& camera : cell.cameras) json["cameras"].push_back(numbers(camera));
  data::write_atomically(path, data::format_json(json));
}

SegmentedCell load_segmented_cell(const std::string& path) {
  const nlohmann::json json = data::load_json(path);
  const data::JsonObject file(json, path);
  file.expect_fields({"schema", "table", "times", "trajectory", "cameras"});
  if (file.string("schema", "") != kSchema) throw file.error("schema", "\"" + std::string(kSchema) + "\"");
  SegmentedCell cell;
  if (file.has("table")) {
    const data::JsonObject table = file.object("table");
    table.expect_fields({"point", "normal"});
    cell.table = {table.vector("point", 3), table.direction("normal", Eigen::Vector3d::UnitZ())};
    if (!(cell.table->normal.z() > 0)) throw table.error("normal", "one that points up");
  }
  if (file.has("times")) {
    const Eigen::VectorXd times = file.vector("times", -1);
    for (Eigen::Index i = 1; i < times.size(); ++i)
      if (!(times[i] > times[i - 1])) throw file.error("times", "strictly increasing times");
    cell.times.assign(times.begin(), times.end());
  }
  if (file.has("trajectory"))
    cell.trajectory = (std::filesystem::path(path).parent_path() / file.string("trajectory")).string();
  if (file.has("cameras")) {
    const nlohmann::json& cameras = file.raw("cameras");
    if (!cameras.is_array()) throw file.error("cameras", "a list of places");
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      const nlohmann::json place = {{"place", cameras[k]}};
      cell.cameras.emplace_back(
          data::JsonObject(place, path, "cameras[" + std::to_string(k) + "]").vector("place", 3));
    }
  }
  return cell;
}

std::string segmented_cell_of(const std::string& clouds) {
  namespace fs = std::filesystem;
  const fs::path file = fs::weakly_canonical(fs::absolute(clouds)).parent_path() / "segment.json";
  // A name that other tools have too: theirs is none of ours.
  std::error_code unknown;
  if (!fs::is_regular_file(file, unknown)) return "";
  const nlohmann::json json = nlohmann::json::parse(data::read_file(file.string()), nullptr, false);
  if (!json.is_object() || !json.contains("schema") || !json["schema"].is_string()) return "";
  return json["schema"].get<std::string>().starts_with("flash-segment/") ? file.string() : "";
}

double height_under(const SegmentedCell::Table& table, const Eigen::Vector3d& point) {
  const Eigen::Vector3d from = point - table.point;
  return table.point.z() - (from.x() * table.normal.x() + from.y() * table.normal.y()) / table.normal.z();
}

}  // namespace flash::sysid
