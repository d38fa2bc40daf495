#include "calib/detect/find_in_all.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

#include "calib/detect/detection_cache.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/machine/parallel.h"

namespace flash::calib {
namespace {

/// Throws data::InputError where the picture cannot be looked at: that is said of a place, not of a content.
Found find_in(const Frame& frame, const Dataset& dataset, const Rectifier& rectifier, const Finder& finder) {
  const GreyImage image = load_grey_image(frame.image);
  if (image.width == rectifier.width() && image.height == rectifier.height()) return finder(image);
  throw data::InputError("the picture is " + size_text(image.width, image.height) + ", " +
                         (dataset.camera ? dataset.camera_path : std::string("the first")) + " says " +
                         size_text(rectifier.width(), rectifier.height()));
}

Found find_or_say(const Frame& frame, const DetectionCache& cache, const std::function<Found()>& find) {
  try {
    return cache.get(frame.image, find);
  } catch (const data::InputError& error) {
    Found found;
    found.reason = error.what();
    return found;
  }
}

/// Whether a glance sees the chessboard in any of the first pictures.
bool is_glimpsed(const Dataset& dataset, const Target& board, const Rectifier& rectifier, int threads) {
  constexpr std::size_t kPictures = 4;
  std::atomic<bool> seen = false;
  data::for_each_in_parallel(std::min(kPictures, dataset.frames.size()), threads, [&](std::size_t i) {
    if (seen) return;
    try {
      const Finder finder = chessboard_finder(board, rectifier, Search::glance);
      if (!find_in(dataset.frames[i], dataset, rectifier, finder).sightings.empty()) seen = true;
    } catch (const data::InputError&) {
      return;  // a picture that cannot be read shows nothing
    }
  });
  return seen;
}

/// A board that is seen, of counts near those stated: people count squares, or outer corners.
std::optional<Target> miscounted_board(const Dataset& dataset, const Target& target,
                                       const Rectifier& rectifier, int threads) {
  // Larger ones first: a smaller one may be a part of the board.
  constexpr std::pair<int, int> kOff[] = {{1, 1}, {1, 0}, {0, 1}, {0, -1}, {-1, 0}, {-1, -1}, {-2, -2}};
  for (const auto& [columns, rows] : kOff) {
    Target other = target;
    other.columns += columns;
    other.rows += rows;
    if (other.columns < 3 || other.rows < 3) continue;
    if (is_glimpsed(dataset, other, rectifier, threads)) return other;
  }
  return {};
}

/// What is found in the pictures of a set, by one search after the other.
class Lookout {
 public:
  Lookout(const Dataset& dataset, const Target& target, const Rectifier& rectifier,
          const DetectSettings& settings, const std::function<void(int, int)>& progress)
      : dataset_(dataset),
        target_(target),
        rectifier_(rectifier),
        cache_(settings.cache, dataset.camera, target, settings.tell),
        threads_(settings.threads),
        progress_(progress),
        found_(dataset.frames.size()) {}

  void look_at(const std::vector<std::size_t>& pictures, Search search) {
    std::mutex mutex;
    std::vector<Finder> idle;  // a finder serves one thread at a time
    const auto take_finder = [&] {
      const std::lock_guard lock(mutex);
      if (idle.empty()) return make_finder(target_, rectifier_, search);
      Finder finder = std::move(idle.back());
      idle.pop_back();
      return finder;
    };
    data::for_each_in_parallel(pictures.size(), threads_, [&](std::size_t i) {
      const Frame& frame = dataset_.frames[pictures[i]];
      Finder finder = take_finder();
      Found& result = found_[pictures[i]];
      result = find_or_say(frame, cache_, [&] { return find_in(frame, dataset_, rectifier_, finder); });
      const std::lock_guard lock(mutex);
      idle.push_back(std::move(finder));
      if (!result.is_open) add_to_progress(1);
    });
  }

  /// Pictures in which a thorough search may see what another one has not.
  std::vector<std::size_t> open() const {
    std::vector<std::size_t> pictures;
    for (std::size_t k = 0; k < found_.size(); ++k)
      if (found_[k].is_open) pictures.push_back(k);
    return pictures;
  }

  bool sees_any() const {
    return std::any_of(found_.begin(), found_.end(), [](const Found& one) { return !one.sightings.empty(); });
  }

  void add_to_progress(std::size_t pictures) {
    done_ += static_cast<int>(pictures);
    if (progress_) progress_(done_, static_cast<int>(found_.size()));
  }

  /// For each frame.
  std::vector<Found> take_found() { return std::move(found_); }

 private:
  const Dataset& dataset_;
  const Target& target_;
  const Rectifier& rectifier_;
  DetectionCache cache_;
  int threads_;
  const std::function<void(int, int)>& progress_;
  int done_ = 0;
  std::vector<Found> found_;
};

/// Some of the pictures, evenly spread.
std::vector<std::size_t> sample(const std::vector<std::size_t>& pictures, std::size_t count) {
  if (pictures.size() <= count) return pictures;
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(pictures[i * pictures.size() / count]);
  return some;
}

}  // namespace

std::vector<Found> find_in_all(const Dataset& dataset, const Target& target, const Rectifier& rectifier,
                               const DetectSettings& settings,
                               const std::function<void(int, int)>& progress) {
  constexpr std::size_t kFirst = 6;
  Lookout lookout(dataset, target, rectifier, settings, progress);
  std::vector<std::size_t> all(dataset.frames.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  lookout.look_at(all, Search::nearby);
  if (!lookout.sees_any() && target.kind == TargetKind::chessboard) {
    if (const auto board = miscounted_board(dataset, target, rectifier, settings.threads)) {
      const std::string size = std::to_string(board->columns) + "x" + std::to_string(board->rows);
      throw data::InputError(dataset.source + ": the target is seen in none of " +
                             std::to_string(all.size()) + " pictures; but they show one of " + size +
                             " inner corners, where four squares meet: --target chessboard:" + size + ":" +
                             data::format_short(target.spacing));
    }
    lookout.look_at(sample(lookout.open(), kFirst), Search::thorough);
  }
  if (lookout.sees_any())
    lookout.look_at(lookout.open(), Search::thorough);
  else
    lookout.add_to_progress(lookout.open().size());
  return lookout.take_found();
}

}  // namespace flash::calib
