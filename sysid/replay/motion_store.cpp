#include "sysid/replay/motion_store.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/sha256.h"
#include "data/files/text.h"
#include "data/machine/parallel.h"
#include "sim/device_error.h"
#include "sim/law/vertex_contact.h"

namespace flash::source_digest {

std::string_view motions();  // of all that decides how a candidate moves

}  // namespace flash::source_digest

namespace flash::sysid {
namespace {

constexpr std::string_view kMagic = "flash-rollout/4\n";
constexpr const char* kExtension = ".rollout";
constexpr std::size_t kDigest = 64;  // Hexadecimal digits of a SHA-256. Work.
/// The key, and the sum of what follows [bytes]. Work.
constexpr std::size_t kHeader = kMagic.size() + 2 * kDigest;

/// Numbers as the bytes they are.
class Bytes {
 public:
  Bytes() = default;
  Bytes(std::string text, std::size_t room) : text_(std::move(text)) { text_.reserve(text_.size() + room); }
  template <class Number>
  void add(Number number) {
    static_assert(std::is_arithmetic_v<Number>);
    text_.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  template <class Derived>
  void add_matrix(const Eigen::PlainObjectBase<Derived>& matrix) {
    add(static_cast<std::int64_t>(matrix.rows()));
    add(static_cast<std::int64_t>(matrix.cols()));
    text_.append(reinterpret_cast<const char*>(matrix.data()),
                 static_cast<std::size_t>(matrix.size()) * sizeof(typename Derived::Scalar));
  }
  void add_text(const std::string& text) {
    add(static_cast<std::int64_t>(text.size()));
    text_ += text;
  }
  const std::string& text() const { return text_; }
  void overwrite(std::size_t at, const std::string& text) { text_.replace(at, text.size(), text); }

 private:
  std::string text_;
};

class BytesReader {
 public:
  BytesReader(std::string_view text, const std::string& path) : text_(text), path_(path) {}
  template <class Number>
  Number take() {
    Number number;
    take_bytes(&number, sizeof number);
    return number;
  }
  /// Of three columns.
  data::Points take_points(Eigen::Index expected, const char* what) {
    const auto rows = take<std::int64_t>(), columns = take<std::int64_t>();
    if (rows != expected || columns != 3)
      fail(what, std::to_string(rows) + " x " + std::to_string(columns), std::to_string(expected) + " x 3");
    if ((text_.size() - place_) / (3 * sizeof(double)) < static_cast<std::size_t>(rows)) end_is_missing();
    data::Points matrix(rows, columns);
    take_bytes(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double));
    return matrix;
  }
  void expect_end() const {
    if (place_ != text_.size())
      fail("length", std::to_string(text_.size()) + " bytes", std::to_string(place_));
  }
  [[noreturn]] void fail(const char* what, const std::string& found, const std::string& expected) const {
    throw data::InputError(path_ + ": " + what + ": found " + found + ", expected " + expected +
                           "; remove the file, and its motion is simulated again");
  }

 private:
  [[noreturn]] void end_is_missing() const {
    fail("length", std::to_string(text_.size()) + " bytes", "more");
  }
  void take_bytes(void* to, std::size_t size) {
    if (text_.size() - place_ < size) end_is_missing();
    std::memcpy(to, text_.data() + place_, size);
    place_ += size;
  }
  std::string_view text_;
  const std::string& path_;
  std::size_t place_ = 0;
};

std::string key_of(const Replay& replay, const ReplayCandidate& candidate, const std::vector<int>& kept) {
  const sim::Environment world = make_environment(replay, candidate);
  Bytes bytes;
  bytes.add_text(std::string(kMagic));  // a file of another format has another name
  bytes.add_text(std::string(source_digest::motions()));
  bytes.add_matrix(replay.recording.mesh.vertices);
  bytes.add_matrix(replay.recording.mesh.triangles);
  bytes.add_matrix(world.state.positions);
  bytes.add_matrix(world.state.velocities);
  bytes.add_matrix(world.gravity);
  const data::SheetMaterial& m = world.materials[0];
  for (const double value :
       {static_cast<double>(m.constitutive), static_cast<double>(m.bending_model), m.membrane_stiffness,
        m.poissons_ratio, m.areal_density, m.bending_rigidity, m.friction, m.air_drag, m.stiffness_damping,
        m.weave.bending_ratio, m.weave.twisting_ratio, m.weave.warp_direction, replay.start,
        replay.settings.solver.time_step, replay.settings.solver.tolerance,
        static_cast<double>(replay.settings.solver.max_iterations),
        static_cast<double>(replay.settings.device), static_cast<double>(replay.recording.has_table),
        sim::bristle_length(replay.settings.solver.time_step)})
    bytes.add(value);
  if (m.weave.is_of_membrane())
    for (const double value : {m.weave.young_ratio, m.weave.shear_ratio, m.weave.warp_direction})
      bytes.add(value);
  bytes.add_matrix(replay.recording.table_point);
  bytes.add_matrix(replay.recording.table_normal);
  for (const sim::Hold& hold : world.holds) {
    for (const int vertex : hold.vertices) bytes.add(vertex);
    for (const double value : {hold.from, hold.to, hold.closing_time}) bytes.add(value);
    bytes.add_matrix(hold.targets);
    if (hold.stiffness.size() > 0) bytes.add_matrix(hold.stiffness);
    if (hold.frame == sim::base_frame) continue;
    for (const Eigen::Isometry3d& pose : world.schedule->frames[static_cast<std::size_t>(hold.frame)])
      bytes.add_matrix(pose.matrix());
  }
  for (const sim::PointMass& mass : world.point_masses) {
    bytes.add(mass.vertex);
    bytes.add(mass.mass);
  }
  if (const auto found = world.solids.find(0); found != world.solids.end()) {
    const data::SolidMaterial& solid = found->second;
    bytes.add_matrix(replay.recording.tetrahedra);
    for (const double value :
         {static_cast<double>(solid.constitutive), static_cast<double>(replay.settings.element_order),
          solid.youngs_modulus, solid.poissons_ratio, solid.density, solid.friction, solid.air_drag,
          solid.stiffness_damping})
      bytes.add(value);
  }
  if (std::isfinite(m.yield_curvature)) bytes.add(m.yield_curvature);
  if (const auto& layers = world.self_contact)
    for (const double value : {layers->thickness, layers->friction, layers->pressure}) bytes.add(value);
  for (const sim::RestTriangle& triangle : replay.sheet().triangles)
    if (triangle.stiff) bytes.add_matrix(triangle.vertices);
  if (const auto& size = candidate.nuisance.grasp_size) {  // a mesh moved to it
    bytes.add_text("grasp_size");
    bytes.add(*size);
  }
  bytes.add(replay.steps);  // a file has the force of each
  for (const int step : kept) bytes.add(step);
  return data::sha256(bytes.text());
}

void save(const ReplayResult& result, const std::vector<int>& kept, const std::string& key,
          const std::string& path) {
  // A motion is megabytes: they are written once, behind room for their sum.
  const std::size_t sum_at = kMagic.size() + kDigest;
  std::size_t numbers = 3 * result.motion.forces.size() + 16;
  for (const int step : kept)
    numbers += static_cast<std::size_t>(result.motion.positions[static_cast<std::size_t>(step)].size()) + 2;
  Bytes bytes(std::string(kMagic) + key + std::string(kDigest, ' '), numbers * sizeof(double));
  for (const double value : {result.motion.start, result.motion.step, result.residual_max,
                             result.penetration_max, result.unconverged_share})
    bytes.add(value);
  bytes.add(static_cast<char>(result.converged));
  bytes.add(static_cast<char>(result.finite));
  for (const int step : kept) bytes.add_matrix(result.motion.positions[static_cast<std::size_t>(step)]);
  data::Points forces(static_cast<Eigen::Index>(result.motion.forces.size()), 3);
  for (Eigen::Index i = 0; i < forces.rows(); ++i)
    forces.row(i) = result.motion.forces[static_cast<std::size_t>(i)].transpose();
  bytes.add_matrix(forces);
  bytes.overwrite(sum_at, data::sha256(std::string_view(bytes.text()).substr(kHeader)));
  data::write_atomically(path, bytes.text(), data::Sync::later);
}

bool is_whole(std::string_view text) {
  return text.starts_with(kMagic) && text.size() >= kHeader &&
         data::sha256(text.substr(kHeader)) == text.substr(kMagic.size() + kDigest, kDigest);
}

std::string_view key_in(std::string_view text) { return text.substr(kMagic.size(), kDigest); }

/// Empty where the file is not as it was written, as a power cut may leave it: then it is simulated again.
std::optional<ReplayResult> load(const Replay& replay, const std::vector<int>& kept, const std::string& key,
                                 const std::string& path) {
  const std::string text = data::read_file(path);
  const std::string_view whole = text;
  if (!is_whole(whole)) return std::nullopt;
  BytesReader bytes(whole.substr(kHeader), path);
  if (key_in(whole) != key) bytes.fail("key", "that of another motion", key);
  ReplayResult result;
  for (double* value : {&result.motion.start, &result.motion.step, &result.residual_max,
                        &result.penetration_max, &result.unconverged_share})
    *value = bytes.take<double>();
  result.converged = bytes.take<char>() != 0;
  result.finite = bytes.take<char>() != 0;
  result.motion.positions.assign(static_cast<std::size_t>(replay.steps) + 1, data::Points(0, 3));
  const Eigen::Index vertices = replay.surface.vertices.rows();
  for (const int step : kept)
    result.motion.positions[static_cast<std::size_t>(step)] = bytes.take_points(vertices, "vertices");
  const data::Points forces = bytes.take_points(replay.steps, "forces");
  for (Eigen::Index i = 0; i < forces.rows(); ++i)
    result.motion.forces.emplace_back(forces.row(i).transpose());
  bytes.expect_end();
  return result;
}

}  // namespace

std::string motion_key(const Replay& replay, const ReplayCandidate& candidate) {
  return key_of(replay, candidate, scored_steps(replay));
}

MotionStore::MotionStore(const std::string& folder, Shard shard) : folder_(folder), shard_(std::move(shard)) {
  std::filesystem::create_directories(folder);
  data::remove_old_leftovers(folder, kExtension);
}

std::string MotionStore::path_of(const std::string& key) const {
  return (std::filesystem::path(folder_) / (key + kExtension)).string();
}

bool MotionStore::has(const std::string& key) const { return std::filesystem::exists(path_of(key)); }

void MotionStore::run(const Replay& replay, const std::vector<ReplayCandidate>& candidates,
                      const std::function<void(std::size_t, ReplayResult)>& finished) const {
  if (shard_.count > 1) {
    std::vector<WantedMotion> wanted;
    for (const ReplayCandidate& candidate : candidates) wanted.push_back({&replay, candidate});
    prepare(wanted);
  }
  read_or_simulate(replay, candidates, finished);
}

void MotionStore::read_or_simulate(const Replay& replay, const std::vector<ReplayCandidate>& candidates,
                                   const std::function<void(std::size_t, ReplayResult)>& finished) const {
  const std::vector<int> kept = scored_steps(replay);
  std::vector<std::string> wanted(candidates.size());
  data::for_each_in_parallel(candidates.size(), replay.settings.threads, [&](std::size_t i) {
    std::string key = key_of(replay, candidates[i], kept);
    std::optional<ReplayResult> found;
    if (has(key)) found = load(replay, kept, key, path_of(key));
    if (found)
      finished(i, std::move(*found));
    else
      wanted[i] = std::move(key);
  });
  std::vector<std::size_t> missing;
  std::vector<ReplayCandidate> simulated;
  std::vector<std::string> keys;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (wanted[i].empty()) continue;
    keys.push_back(std::move(wanted[i]));
    missing.push_back(i);
    simulated.push_back(candidates[i]);
  }
  try {
    sysid::run(replay, simulated, kept, [&](std::size_t k, ReplayResult result) {
      save(result, kept, keys[k], path_of(keys[k]));
      finished(missing[k], std::move(result));
    });
  } catch (const sim::DeviceError& error) {
    throw error.renumbered([&](std::size_t k) { return missing.at(k); });
  }
}

ReplayResult MotionStore::run(const Replay& replay, const ReplayCandidate& candidate) const {
  ReplayResult only;
  run(replay, {candidate}, [&](std::size_t, ReplayResult result) { only = std::move(result); });
  return only;
}

void MotionStore::prepare(const std::vector<WantedMotion>& wanted,
                          const std::function<void()>& simulated) const {
  std::vector<std::string> keys;
  for (const WantedMotion& motion : wanted) keys.push_back(motion_key(*motion.replay, motion.candidate));
  std::vector<WantedMotion> own;
  std::vector<MissingMotion> of_others;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (has(keys[i])) continue;
    const int owner = owner_of(i, keys.front(), shard_.count);
    if (owner == shard_.index)
      own.push_back(wanted[i]);
    else
      of_others.push_back({keys[i], owner, wanted[i]});
  }
  simulate(own, simulated);
  if (!of_others.empty()) wait_for(std::move(of_others));
}

int MotionStore::take_from(const std::string& folder) const {
  int taken = 0;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder)) {
    const std::string key = entry.path().stem().string();
    if (entry.path().extension() != kExtension || has(key)) continue;
    const std::string text = data::read_file(entry.path().string());
    if (!is_whole(text) || key_in(text) != key) continue;
    data::write_atomically(path_of(key), text, data::Sync::later);
    ++taken;
  }
  return taken;
}

void MotionStore::simulate(const std::vector<WantedMotion>& wanted,
                           const std::function<void()>& simulated) const {
  std::map<const Replay*, std::vector<ReplayCandidate>> batches;
  for (const WantedMotion& motion : wanted) batches[motion.replay].push_back(motion.candidate);
  if (batches.empty()) return;
  std::vector<std::pair<const Replay*, std::vector<ReplayCandidate>>> all(batches.begin(), batches.end());
  const auto work = [](const auto& batch) {
    const Replay& replay = *batch.first;
    return static_cast<double>(batch.second.size()) * static_cast<double>(replay.surface.vertices.rows()) /
           replay.settings.solver.time_step;
  };
  // The longest first, or all wait for it.
  std::sort(all.begin(), all.end(), [&](const auto& a, const auto& b) { return work(a) > work(b); });
  data::for_each_in_parallel(all.size(), all.front().first->settings.threads, [&](std::size_t k) {
    read_or_simulate(*all[k].first, all[k].second, [&](std::size_t, const ReplayResult&) {
      if (simulated) simulated();
    });
  });
}

void MotionStore::wait_for(std::vector<MissingMotion> missing) const {
  using Clock = std::chrono::steady_clock;
  const std::atomic<bool>* stop = missing.front().wanted.replay->settings.solver.stop;
  auto last = Clock::now();
  while (true) {
    // A client of a network disk looks for new files where a folder is opened anew.
    const std::filesystem::directory_iterator opened(folder_);
    if (std::erase_if(missing, [&](const MissingMotion& motion) { return has(motion.key); }) > 0)
      last = Clock::now();
    if (missing.empty()) return;
    if (!shard_.waits) throw OthersMissing(missing.size());
    if (stop != nullptr && *stop) throw data::Stopped();
    const double waited = std::chrono::duration<double>(Clock::now() - last).count();
    if (waited >= shard_.patience) give_up(missing);
    const std::vector<WantedMotion> taken = take_of_absent(missing);
    simulate(taken, {});
    if (!taken.empty()) continue;
    constexpr double kOften = 0.2, kSeldom = 2;  // Of looking for files [s]. Work.
    std::this_thread::sleep_for(std::chrono::duration<double>(std::clamp(0.05 * waited, kOften, kSeldom)));
  }
}

void MotionStore::give_up(const std::vector<MissingMotion>& missing) const {
  const std::scoped_lock lock(shard_.absent->mutex);
  for (const MissingMotion& motion : missing)
    if (shard_.absent->indices.insert(motion.owner).second && shard_.told)
      shard_.told("no motion of share " + std::to_string(motion.owner + 1) + " of " +
                  std::to_string(shard_.count) + " came for " + data::format_short(shard_.patience) +
                  " s: its share is simulated here");
}

std::vector<WantedMotion> MotionStore::take_of_absent(std::vector<MissingMotion>& missing) const {
  const auto is_absent = [&](const MissingMotion& motion) {
    return shard_.absent->indices.contains(motion.owner);
  };
  const std::scoped_lock lock(shard_.absent->mutex);
  const auto end = std::stable_partition(missing.begin(), missing.end(), is_absent);
  if (end == missing.begin()) return {};
  // Those who wait begin at unlike ones, and simulate as many as they can at a time.
  const auto count = static_cast<std::size_t>(end - missing.begin());
  std::rotate(missing.begin(),
              missing.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(shard_.index) * count /
                                                            static_cast<std::size_t>(shard_.count)),
              end);
  const ReplaySettings& settings = missing.front().wanted.replay->settings;
  const int at_once = settings.device == sim::Device::cuda ? settings.envs : settings.threads;
  std::vector<WantedMotion> taken;
  for (std::size_t i = 0; i < std::min(count, static_cast<std::size_t>(std::max(1, at_once))); ++i)
    taken.push_back(missing[i].wanted);
  missing.erase(missing.begin(), missing.begin() + std::ssize(taken));
  return taken;
}

}  // namespace flash::sysid
