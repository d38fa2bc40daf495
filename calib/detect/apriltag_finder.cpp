#include <apriltag.h>
#include <tag16h5.h>
#include <tag25h9.h>
#include <tag36h10.h>
#include <tag36h11.h>
#include <tagStandard41h12.h>
#include <tagStandard52h13.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "calib/detect/corner_shapes.h"
#include "calib/detect/finder.h"
#include "calib/detect/opencv_image.h"

namespace flash::calib {
namespace {

constexpr double kLeastMargin = 15;  // of the decoded bits from their threshold, of 255
constexpr int kMostWrongBits = 1;    // of a tag's code
constexpr int kGridTags = 4;         // that a view of an aprilgrid must show

struct FamilyKind {
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

FamilyKind family_kind(const std::string& name) {
  static const std::map<std::string, FamilyKind> known = {
      {"36h11", {tag36h11_create, tag36h11_destroy}},
      {"36h10", {tag36h10_create, tag36h10_destroy}},
      {"25h9", {tag25h9_create, tag25h9_destroy}},
      {"16h5", {tag16h5_create, tag16h5_destroy}},
      {"Standard41h12", {tagStandard41h12_create, tagStandard41h12_destroy}},
      {"Standard52h13", {tagStandard52h13_create, tagStandard52h13_destroy}}};
  return known.at(name);
}

/// A tag as it is seen: corners as printed, upper left, upper right, lower right, lower left [px].
struct Tag {
  int id;
  Quad corners;
  double border;  ///< width of the black border as a share of the side
  bool is_rough;  ///< corners are good to a pixel only
};

/// A picture whose dark parts have lost a pixel all around: what touched at a corner stands apart.
GreyImage thinned(const GreyImage& image) {
  GreyImage result = image;
  cv::Mat picture = as_mat(result);
  cv::dilate(as_mat(image), picture, cv::Mat());
  return result;
}

/// Each corner moved away from the middle, so that the sides move by `distance` [px] in a view from the
/// front.
Quad widened(const Quad& quad, double distance) {
  const Eigen::Vector2d middle = (quad[0] + quad[1] + quad[2] + quad[3]) / 4;
  Quad result = quad;
  for (Eigen::Vector2d& corner : result) corner += std::sqrt(2.0) * distance * (corner - middle).normalized();
  return result;
}

/// The library's detector with its families.
class TagDetector {
 public:
  /// kalibr: tags with the double border of Kalibr's grids as well.
  TagDetector(const std::string& family, bool kalibr) : kind_(family_kind(family)) {
    detector_->quad_decimate = 1;  // small tags would be lost, and corners be less sure
    add(kind_.create(), 1.0);
    if (!kalibr) return;
    apriltag_family_t* wide = kind_.create();
    wide->width_at_border += 2;
    wide->total_width += 2;
    for (std::uint32_t i = 0; i < wide->nbits; ++i) {
      ++wide->bit_x[i];
      ++wide->bit_y[i];
    }
    add(wide, 2.0);
  }
  ~TagDetector() {
    detector_.reset();
    for (const auto& [family, border] : borders_) kind_.destroy(family);
  }
  TagDetector(const TagDetector&) = delete;
  TagDetector& operator=(const TagDetector&) = delete;

  /// The tags of a grid that fills the crossings of its gaps, as Kalibr's does, touch the squares there: the
  /// library takes them for one shape. Those it misses are looked for in a thinned picture.
  std::vector<Tag> detect_grid(const GreyImage& image, int tags) {
    std::vector<Tag> found = detect(image);
    if (static_cast<int>(found.size()) >= tags) return found;
    for (Tag& tag : detect(thinned(image))) {
      if (std::any_of(found.begin(), found.end(), [&](const Tag& known) { return known.id == tag.id; }))
        continue;
      tag.corners = widened(tag.corners, 1);
      tag.is_rough = true;
      found.push_back(tag);
    }
    return found;
  }

  std::vector<Tag> detect(const GreyImage& image) {
    image_u8_t view = {image.width, image.height, image.width,
                       const_cast<std::uint8_t*>(image.pixels.data())};
    zarray_t* list = apriltag_detector_detect(detector_.get(), &view);
    std::vector<Tag> tags;
    for (int k = 0; k < zarray_size(list); ++k) {
      apriltag_detection_t* seen = nullptr;
      zarray_get(list, k, &seen);
      if (seen->hamming > kMostWrongBits || seen->decision_margin < kLeastMargin) continue;
      Tag tag{seen->id, {}, borders_.at(seen->family) / seen->family->width_at_border, false};
      // Counter-clockwise from the lower left, and the centre of the first pixel at (0.5, 0.5).
      for (std::size_t i = 0; i < 4; ++i)
        tag.corners[i] = Eigen::Vector2d(seen->p[3 - i][0] - 0.5, seen->p[3 - i][1] - 0.5);
      tags.push_back(tag);
    }
    apriltag_detections_destroy(list);
    return tags;
  }

 private:
  void add(apriltag_family_t* family, double border) {
    borders_[family] = border;
    // The library's table of codes that are two bits off takes 3 GB for the largest family.
    apriltag_detector_add_family_bits(detector_.get(), family, kMostWrongBits);
  }

  FamilyKind kind_;
  std::map<apriltag_family_t*, double> borders_;  ///< in modules
  std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector_{apriltag_detector_create(),
                                                                                 apriltag_detector_destroy};
};

/// Kalibr prints its tags turned against the library's idea of upright: where the tags of a grid lie says
/// which corner comes first. Empty where they do not lie as the grid has them.
std::vector<Tag> upright(const std::vector<Tag>& tags, const Target& target, const Rectifier& rectifier) {
  const Eigen::Matrix3Xd points = target_points(target);
  std::vector<Eigen::Vector2d> plane, pixels;
  for (const Tag& tag : tags) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& corner : tag.corners) middle += rectifier.rectified(corner) / 4;
    plane.emplace_back(points.middleCols<4>(4 * tag.id).rowwise().mean().head<2>());
    pixels.push_back(middle);
  }
  const Eigen::Matrix3d H = homography(plane, pixels, 5);
  if (H.isZero()) return {};
  std::vector<Tag> turned;
  for (const Tag& tag : tags) {
    double least = 1e300;
    Tag best = tag;
    for (std::size_t turn = 0; turn < 4; ++turn) {
      Tag candidate = tag;
      std::rotate(candidate.corners.begin(), candidate.corners.begin() + static_cast<std::ptrdiff_t>(turn),
                  candidate.corners.end());
      double error = 0;
      for (int i = 0; i < 4; ++i)
        error += (apply(H, points.col(4 * tag.id + i).head<2>()) -
                  rectifier.rectified(candidate.corners[static_cast<std::size_t>(i)]))
                     .squaredNorm();
      if (error < least) {
        least = error;
        best = candidate;
      }
    }
    const double side = (tag.corners[1] - tag.corners[0]).norm();
    if (std::sqrt(least / 4) < 0.25 * side) turned.push_back(best);  // else it lies elsewhere: another's id
  }
  return turned;
}

/// The tags that belong to the target, or why there are none.
std::vector<Tag> chosen(std::vector<Tag> tags, const Target& target, const Rectifier& rectifier,
                        std::string& reason) {
  const bool grid = target.kind == TargetKind::aprilgrid;
  const int count = grid ? target.columns * target.rows : 1;
  if (target.first_id >= 0)
    std::erase_if(
        tags, [&](const Tag& tag) { return tag.id < target.first_id || tag.id >= target.first_id + count; });
  if (tags.empty()) {
    reason =
        "no tag of " + target.dictionary +
        (target.first_id < 0 ? ""
                             : " with id " + std::to_string(target.first_id) + (grid ? " or above" : ""));
  } else if (!grid && tags.size() > 1) {
    const bool same = tags[0].id == tags[1].id;
    reason = same ? "tag " + std::to_string(tags[0].id) + " is seen more than once"
                  : "tags " + std::to_string(tags[0].id) + " and " + std::to_string(tags[1].id) +
                        " are seen: name one instead of any";
  } else if (grid) {
    tags = static_cast<int>(tags.size()) < kGridTags ? std::vector<Tag>() : upright(tags, target, rectifier);
    if (static_cast<int>(tags.size()) < kGridTags)
      reason = "fewer than " + std::to_string(kGridTags) + " tags lie as in the grid";
  }
  return reason.empty() ? tags : std::vector<Tag>();
}

}  // namespace

std::optional<Target> shown_tags(const GreyImage& image, const Target& stated, const Rectifier& rectifier) {
  const bool grid = stated.kind == TargetKind::aprilgrid;
  Target best = stated;
  std::size_t most = grid ? kGridTags - 1 : 0;
  for (const char* family : {"36h11", "25h9", "36h10", "16h5", "Standard41h12"}) {
    Target other = stated;
    other.dictionary = family;
    TagDetector detector(family, grid);
    const std::vector<Tag> tags =
        grid ? detector.detect_grid(image, stated.columns * stated.rows) : detector.detect(image);
    if (!grid && !tags.empty() && stated.first_id >= 0) other.first_id = tags.front().id;
    std::string reason;
    std::size_t count = chosen(tags, other, rectifier, reason).size();
    if (grid && count == 0) {
      std::swap(other.columns, other.rows);
      count = chosen(tags, other, rectifier, reason).size();
    }
    if (count <= most) continue;
    most = count;
    best = other;
  }
  return to_words(best) == to_words(stated) ? std::nullopt : std::optional(best);
}

Finder apriltag_finder(const Target& target, const Rectifier& rectifier) {
  const bool grid = target.kind == TargetKind::aprilgrid;
  const auto detector = std::make_shared<TagDetector>(target.dictionary, grid);
  return [target, grid, &rectifier, detector](const GreyImage& image) {
    Found found;
    Sighting fitted{kImageModel, {}, {}}, library{"apriltag", {}, {}};
    const std::vector<Tag> seen =
        grid ? detector->detect_grid(image, target.columns * target.rows) : detector->detect(image);
    for (const Tag& tag : chosen(seen, target, rectifier, found.reason)) {
      const double outside = grid ? std::min(tag.border, target.marker_gap / target.marker_size) : tag.border;
      Quad seed;
      std::transform(tag.corners.begin(), tag.corners.end(), seed.begin(),
                     [&](const Eigen::Vector2d& pixel) { return rectifier.rectified(pixel); });
      const std::optional<Quad> sides = fit_quad(image, rectifier, seed, tag.border, outside);
      for (int i = 0; i < 4; ++i) {
        const int point = (grid ? 4 * tag.id : 0) + i;
        if (!tag.is_rough) {
          library.points.push_back(point);
          library.pixels.push_back(tag.corners[static_cast<std::size_t>(i)]);
        }
        if (!sides) continue;
        fitted.points.push_back(point);
        fitted.pixels.push_back(rectifier.distorted((*sides)[static_cast<std::size_t>(i)]));
      }
    }
    if (!fitted.points.empty()) found.sightings.push_back(std::move(fitted));
    if (!library.points.empty()) found.sightings.push_back(std::move(library));
    if (found.sightings.empty() && found.reason.empty()) found.reason = "the tags seen have no clear edges";
    return found;
  };
}

}  // namespace flash::calib
