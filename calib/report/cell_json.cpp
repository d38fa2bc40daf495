#include "calib/report/cell_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/report/extrinsics_json.h"

namespace flash::calib {
namespace {

using Json = nlohmann::ordered_json;

Json frame_json(const CellFrame& frame) {
  Json json = to_json(frame.transform);
  Json covariance = Json::array();
  for (Eigen::Index i = 0; i < 6; ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < 6; ++j) row.push_back(frame.covariance(i, j));
    covariance.push_back(std::move(row));
  }
  json["covariance"] = std::move(covariance);
  return json;
}

}  // namespace

Json to_json(const Cell& cell, const std::optional<Eigen::Vector3d>& workspace) {
  Json json = {{"schema", "flash-cell/1"}, {"joint", cell.joint}};
  json["bases"] = Json::array();
  for (const CellFrame& base : cell.bases) {
    Json entry = frame_json(base);
    if (workspace) {
      const Eigen::Matrix3d covariance = point_covariance(base, base.transform.T.inverse() * *workspace);
      entry["workspace_sd_mm"] = {1e3 * std::sqrt(covariance(0, 0)), 1e3 * std::sqrt(covariance(1, 1)),
                                  1e3 * std::sqrt(covariance(2, 2))};
    }
    json["bases"].push_back(std::move(entry));
  }
  json["cameras"] = Json::array();
  for (const CellFrame& camera : cell.cameras) json["cameras"].push_back(frame_json(camera));
  json["workspace"] = workspace ? Json{workspace->x(), workspace->y(), workspace->z()} : Json(nullptr);
  if (cell.joint) {
    json["sigmas"] = {{"corner_px", cell.noise.corner},
                      {"robot_rotation_rad", cell.noise.rotation},
                      {"robot_translation_m", cell.noise.translation}};
    json["scales"] = Json::array();
    for (const TargetSize& size : cell.sizes) json["scales"].push_back(to_json(size));
    json["residuals"] = {{"reprojection_rms_px", cell.chain_rms}, {"corner_rms_px", cell.corner_rms}};
  }
  json["notices"] = cell.notices;
  json["provenance"] = {{"tool", "flash-calib"}, {"version", FLASH_VERSION}};
  return json;
}

}  // namespace flash::calib
