#include "sysid/replay/motion_store.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <type_traits>

#include "data/atomic_file.h"
#include "data/error.h"
#include "data/sha256.h"

namespace flash::sysid {
namespace {

constexpr const char* kMagic = "flash-rollout/2\n";

/// Numbers as the bytes they are.
class Bytes {
 public:
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

 private:
  std::string text_;
};

class BytesReader {
 public:
  BytesReader(std::string text, std::string path) : text_(std::move(text)), path_(std::move(path)) {
    if (text_.rfind(kMagic, 0) != 0) fail();
    place_ = std::strlen(kMagic);
  }
  template <class Number>
  Number take() {
    Number number;
    take_bytes(&number, sizeof number);
    return number;
  }
  template <class Matrix>
  Matrix take_matrix() {
    const auto rows = take<std::int64_t>(), columns = take<std::int64_t>();
    const auto left = static_cast<std::int64_t>((text_.size() - place_) / sizeof(double));
    if (rows < 0 || columns != 3 || rows > left / columns) fail();
    Matrix matrix(rows, columns);
    take_bytes(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double));
    return matrix;
  }
  void expect_end() const {
    if (place_ != text_.size()) fail();
  }

 private:
  [[noreturn]] void fail() const {
    throw data::InputError(path_ + ": not a motion of flash-sysid, or cut off; remove it");
  }
  void take_bytes(void* to, std::size_t size) {
    if (text_.size() - place_ < size) fail();
    std::memcpy(to, text_.data() + place_, size);
    place_ += size;
  }
  std::string text_, path_;
  std::size_t place_ = 0;
};

std::string key_of(const Replay& replay, const sim::Environment& world, const std::vector<int>& kept) {
  Bytes bytes;
  bytes.add_text(FLASH_VERSION);
  bytes.add_matrix(replay.recording.mesh.vertices);
  bytes.add_matrix(replay.recording.mesh.triangles);
  bytes.add_matrix(world.state.positions);
  bytes.add_matrix(world.state.velocities);
  bytes.add_matrix(world.gravity);
  const data::SheetMaterial& m = world.material;
  for (const double value :
       {static_cast<double>(m.constitutive), static_cast<double>(m.bending_model), m.membrane_stiffness,
        m.poissons_ratio, m.areal_density, m.bending_rigidity, m.friction, m.air_drag, m.stiffness_damping,
        replay.start, replay.settings.solver.time_step, replay.settings.solver.tolerance,
        static_cast<double>(replay.settings.solver.max_iterations),
        static_cast<double>(replay.recording.has_table)})
    bytes.add(value);
  bytes.add_matrix(replay.recording.table_point);
  bytes.add_matrix(replay.recording.table_normal);
  for (const sim::Grasp& grasp : world.grasps) {
    for (const int vertex : grasp.vertices) bytes.add(vertex);
    for (const double value : {grasp.from, grasp.to, grasp.closing_time}) bytes.add(value);
    bytes.add_matrix(grasp.targets);
    for (std::size_t i = 0; i < grasp.gripper.times.size(); ++i) {
      bytes.add(grasp.gripper.times[i]);
      bytes.add_matrix(grasp.gripper.poses[i].matrix());
    }
  }
  for (const sim::RestTriangle& triangle : replay.sheet().triangles)
    if (triangle.stiff) bytes.add_matrix(triangle.vertices);
  for (const int step : kept) bytes.add(step);
  return data::sha256(bytes.text());
}

void save(const ReplayResult& result, const std::vector<int>& kept, const std::string& path) {
  Bytes bytes;
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
  data::write_atomically(path, kMagic + bytes.text());
}

ReplayResult load(const Replay& replay, const std::vector<int>& kept, const std::string& path) {
  BytesReader bytes(data::read_file(path), path);
  ReplayResult result;
  for (double* value : {&result.motion.start, &result.motion.step, &result.residual_max,
                        &result.penetration_max, &result.unconverged_share})
    *value = bytes.take<double>();
  result.converged = bytes.take<char>() != 0;
  result.finite = bytes.take<char>() != 0;
  result.motion.positions.assign(static_cast<std::size_t>(replay.steps) + 1, data::Points(0, 3));
  for (const int step : kept)
    result.motion.positions[static_cast<std::size_t>(step)] = bytes.take_matrix<data::Points>();
  const auto forces = bytes.take_matrix<data::Points>();
  for (Eigen::Index i = 0; i < forces.rows(); ++i)
    result.motion.forces.emplace_back(forces.row(i).transpose());
  bytes.expect_end();
  return result;
}

}  // namespace

MotionStore::MotionStore(const std::string& folder) : folder_(folder) {
  std::filesystem::create_directories(folder);
}

void MotionStore::run(const Replay& replay, const std::vector<ReplayCandidate>& candidates,
                      const std::function<void(std::size_t, ReplayResult)>& finished) const {
  const std::vector<int> kept = scored_steps(replay);
  const auto path_of = [&](const ReplayCandidate& candidate) {
    const std::string key = key_of(replay, make_environment(replay, candidate), kept);
    return (std::filesystem::path(folder_) / (key + ".rollout")).string();
  };
  std::vector<std::size_t> missing;
  std::vector<ReplayCandidate> simulated;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const std::string path = path_of(candidates[i]);
    if (std::filesystem::exists(path)) {
      finished(i, load(replay, kept, path));
    } else {
      missing.push_back(i);
      simulated.push_back(candidates[i]);
    }
  }
  sysid::run(replay, simulated, kept, [&](std::size_t k, ReplayResult result) {
    save(result, kept, path_of(simulated[k]));
    finished(missing[k], std::move(result));
  });
}

ReplayResult MotionStore::run(const Replay& replay, const ReplayCandidate& candidate) const {
  ReplayResult only;
  run(replay, {candidate}, [&](std::size_t, ReplayResult result) { only = std::move(result); });
  return only;
}

}  // namespace flash::sysid
