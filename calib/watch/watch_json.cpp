#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/calibrate/extrinsics.h"
#include "calib/report/extrinsics_json.h"
#include "calib/report/json_list.h"
#include "calib/watch/watch_state.h"

namespace flash::calib {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180 / M_PI;

/// x y by turns, in hundredths of a pixel.
Json pixels(const Eigen::Matrix2Xd& places) {
  Json values = Json::array();
  for (Eigen::Index i = 0; i < places.size(); ++i) values.push_back(std::round(1e2 * places.data()[i]) / 1e2);
  return values;
}

Json to_json(const LastPicture& last) {
  return {{"name", last.name},
          {"looked_at", last.looked_at},
          {"has_pose", last.has_pose},
          {"found", last.found},
          {"expected", last.expected},
          {"reason", last.reason},
          {"corners_px", pixels(last.corners)}};
}

Json to_json(const ImageCoverage& image) {
  Json rows = Json::array();
  for (const auto& row : image.counts.rowwise()) rows.push_back(list(row));
  return {{"share", image.share}, {"counts", std::move(rows)}};
}

Json to_json(const TurnCoverage& turns) {
  Json json = {{"spread_deg", list(turns.spread_deg)}, {"sentence", turns.sentence}};
  json["axes"] = Json::array();
  for (const auto& axis : turns.axes.colwise()) json["axes"].push_back(list(axis));
  json["turns_deg"] = Json::array();
  for (const Eigen::Vector3d& turn : turns.turns_deg) json["turns_deg"].push_back(list(turn));
  return json;
}

Json to_json(const NextPose& next) {
  Json json = calib::to_json(NamedTransform{"base", "gripper", next.T_base_gripper});
  json["move"] = next.move;
  json["view"] = next.view;
  json["outline_px"] = pixels(next.outline);
  json["turn_deg"] = list(next.turn_deg);
  json["translation_sd_mm"] = 1e3 * next.translation_sd;
  json["rotation_sd_deg"] = kDegrees * next.rotation_sd;
  return json;
}

Json to_json(const WatchAnswer& answer, const WatchState& state) {
  Json json = {{"views", answer.views}, {"not_yet", answer.not_yet}, {"no_plan", answer.no_plan}};
  if (!answer.calibration) return json;
  const Calibration& calibration = *answer.calibration;
  const ToldDeviations told = told_deviations(calibration, calibration.covariance, Axes::parent);
  Json sd_mm = Json::array(), sd_deg = Json::array();
  for (std::size_t k = 0; k < 6; ++k)
    (k < 3 ? sd_mm : sd_deg).push_back(told[k] ? Json((k < 3 ? 1e3 : kDegrees) * *told[k]) : Json(nullptr));
  const KnownAfter known = known_after(answer);
  json["used"] = calibration.used.size();
  json["usable"] = calibration.usable;
  json["transform"] = calib::to_json(NamedTransform{state.parent, state.child, calibration.poses.X});
  json["sd_mm"] = std::move(sd_mm);
  json["sd_deg"] = std::move(sd_deg);
  json["translation_sd_mm"] = 1e3 * known.translation_sd;
  json["rotation_sd_deg"] = kDegrees * known.rotation_sd;
  json["warnings"] = calibration.warnings;
  return json;
}

}  // namespace

Json to_json(const WatchState& state) {
  Json json = {{"schema", "flash-watch/1"},        {"width", state.width},
               {"height", state.height},           {"pictures", state.pictures},
               {"with_target", state.with_target}, {"with_pose", state.with_pose},
               {"looking", state.looking},         {"solving", state.solving},
               {"waiting", state.waiting},         {"notes", state.notes},
               {"advice", state.advice},           {"weakest", state.weakest}};
  json["last"] = state.last ? to_json(*state.last) : Json(nullptr);
  json["image"] = to_json(state.image);
  json["turns"] = to_json(state.turns);
  json["next"] = state.next ? to_json(*state.next) : Json(nullptr);
  json["answer"] = state.answer ? to_json(*state.answer, state) : Json(nullptr);
  json["history"] = Json::array();
  for (const KnownAfter& known : state.history)
    json["history"].push_back({{"views", known.views},
                               {"translation_sd_mm", 1e3 * known.translation_sd},
                               {"rotation_sd_deg", kDegrees * known.rotation_sd}});
  return json;
}

}  // namespace flash::calib
