#include "calib/detect/detection_cache.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <system_error>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/sha256.h"
#include "data/files/text.h"

namespace flash::source_digest {

std::string_view detections();  // of the finders

}  // namespace flash::source_digest

namespace flash::calib {
namespace {

/// Points of the target, each once, at places in or near a picture.
bool is_sound(const Sighting& sighting, int points) {
  constexpr double kFarthest = 1e6;  // [px]
  const std::set<int> different(sighting.points.begin(), sighting.points.end());
  return sighting.pixels.size() == sighting.points.size() && different.size() == sighting.points.size() &&
         (different.empty() || (*different.begin() >= 0 && *different.rbegin() < points)) &&
         std::all_of(sighting.pixels.begin(), sighting.pixels.end(),
                     [](const Eigen::Vector2d& pixel) { return pixel.cwiseAbs().maxCoeff() < kFarthest; });
}

/// Of all other fields, and of the name, which is of the picture.
std::string digest_of(nlohmann::json json, const std::string& path) {
  json.erase("digest");
  return data::sha256(std::filesystem::path(path).filename().string() +
                      json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

/// points: of the target. None where the file is not there, or is not as it was written.
std::optional<Found> read(const std::string& path, int points) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  try {
    const nlohmann::json json = data::load_json(path);
    if (json.at("digest") != digest_of(json, path)) return std::nullopt;
    Found found;
    found.reason = json.at("reason").get<std::string>();
    for (const nlohmann::json& item : json.at("sightings")) {
      Sighting sighting{item.at("refiner").get<std::string>(), item.at("points").get<std::vector<int>>(), {}};
      for (const nlohmann::json& pixel : item.at("pixels"))
        sighting.pixels.emplace_back(pixel.at(0).get<double>(), pixel.at(1).get<double>());
      if (!is_sound(sighting, points)) return std::nullopt;
      found.sightings.push_back(std::move(sighting));
    }
    return found;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

void write(const Found& found, const std::string& path) {
  nlohmann::json json = {{"reason", found.reason}, {"sightings", nlohmann::json::array()}};
  for (const Sighting& sighting : found.sightings) {
    nlohmann::json pixels = nlohmann::json::array();
    for (const Eigen::Vector2d& pixel : sighting.pixels) pixels.push_back({pixel.x(), pixel.y()});
    json["sightings"].push_back(
        {{"refiner", sighting.refiner}, {"points", sighting.points}, {"pixels", std::move(pixels)}});
  }
  json["digest"] = digest_of(json, path);
  data::write_atomically(path, json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

/// What ends no search, as nothing is wrong with the folder itself.
bool is_full(const std::error_code& code) {
  return code == std::errc::no_space_on_device || code == std::errc::file_too_large || code.value() == EDQUOT;
}

}  // namespace

DetectionCache::DetectionCache(std::string folder, const std::optional<data::CameraIntrinsics>& camera,
                               const Target& target, Tell tell)
    : folder_(std::move(folder)),
      points_(static_cast<int>(target_points(target).cols())),
      tell_(std::move(tell)) {
  if (folder_.empty()) return;
  const auto add = [&](double value) { key_ += data::format_number(value) + ' '; };
  key_ = std::string(source_digest::detections()) + ' ' + target.dictionary + ' ';
  // Corners are the same whatever the size: only the shape counts.
  const double size = target.spacing > 0 ? target.spacing : target.marker_size;
  for (const double value :
       {static_cast<double>(target.kind), static_cast<double>(target.columns),
        static_cast<double>(target.rows), target.marker_size / size, target.marker_gap / size,
        static_cast<double>(target.first_id), static_cast<double>(target.has_origin)})
    add(std::round(1e6 * value) / 1e6);
  if (!camera) return;
  for (const double value :
       {static_cast<double>(camera->width), static_cast<double>(camera->height), camera->fx, camera->fy,
        camera->cx, camera->cy, static_cast<double>(camera->model)})
    add(value);
  for (const double value : camera->distortion) add(value);
}

Found DetectionCache::get(const std::string& image, const std::function<Found()>& find) const {
  if (folder_.empty()) return find();
  std::string bytes;
  try {
    bytes = data::read_file(image);
  } catch (const data::InputError&) {
    return find();  // says why it cannot be read
  }
  const std::string path = (std::filesystem::path(folder_) / (data::sha256(key_ + bytes) + ".json")).string();
  if (std::optional<Found> kept = read(path, points_)) return std::move(*kept);
  if (std::error_code error; tell_ && std::filesystem::is_regular_file(path, error)) {
    const std::scoped_lock lock(telling_);
    tell_(path + ": is not as it was written; what it keeps of " + image + " is found anew");
  }
  Found found = find();
  try {
    if (!found.is_open) write(found, path);
  } catch (const std::system_error& error) {
    if (!is_full(error.code())) throw;
    std::call_once(told_, [&] {
      if (tell_) tell_(folder_ + ": " + error.code().message() + "; what is found is not kept");
    });
  }
  return found;
}

}  // namespace flash::calib
