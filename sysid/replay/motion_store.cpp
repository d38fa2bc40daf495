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

constexpr const char* kMagic = "flash-rollout/1\n";

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

/// The first step and those around each keyframe, as far as its clock may be off.
std::vector<bool> wanted_steps(const Replay& replay) {
  std::vector<bool> wanted(static_cast<std::size_t>(replay.steps) + 1, false);
  wanted.front() = true;
  const double step = replay.settings.solver.time_step, room = replay.recording.nuisance.time;
  const auto index = [&](double t) { return (t - replay.start) / step; };
  for (const Observation& observation : replay.observations) {
    const auto first = static_cast<long>(std::floor(index(observation.t - room) - 1e-6));
    const auto last = static_cast<long>(std::ceil(index(observation.t + room) + 1e-6));
    for (long i = std::max(first, 0L); i <= std::min(last, static_cast<long>(replay.steps)); ++i)
      wanted[static_cast<std::size_t>(i)] = true;
    if (last >= replay.steps) wanted.back() = true;
  }
  return wanted;
}

std::string key_of(const Replay& replay, const sim::Environment& world, const std::vector<bool>& wanted) {
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
  for (const sim::RestTriangle& triangle : replay.sheet.triangles)
    if (triangle.stiff) bytes.add_matrix(triangle.vertices);
  for (const bool step : wanted) bytes.add(static_cast<char>(step));
  return data::sha256(bytes.text());
}

void save(const ReplayResult& result, const std::vector<bool>& wanted, const std::string& path) {
  Bytes bytes;
  for (const double value : {result.motion.start, result.motion.step, result.residual_max,
                             result.penetration_max, result.unconverged_share})
    bytes.add(value);
  bytes.add(static_cast<char>(result.converged));
  bytes.add(static_cast<char>(result.finite));
  bytes.add(static_cast<std::int64_t>(result.motion.positions.size()));
  for (std::size_t i = 0; i < result.motion.positions.size(); ++i)
    if (wanted[i]) bytes.add_matrix(result.motion.positions[i]);
  data::Points forces(static_cast<Eigen::Index>(result.motion.forces.size()), 3);
  for (Eigen::Index i = 0; i < forces.rows(); ++i)
    forces.row(i) = result.motion.forces[static_cast<std::size_t>(i)].transpose();
  bytes.add_matrix(forces);
  data::write_atomically(path, kMagic + bytes.text());
}

ReplayResult load(const std::vector<bool>& wanted, const std::string& path) {
  BytesReader bytes(data::read_file(path), path);
  ReplayResult result;
  for (double* value : {&result.motion.start, &result.motion.step, &result.residual_max,
                        &result.penetration_max, &result.unconverged_share})
    *value = bytes.take<double>();
  result.converged = bytes.take<char>() != 0;
  result.finite = bytes.take<char>() != 0;
  const auto count = static_cast<std::size_t>(bytes.take<std::int64_t>());
  result.motion.positions.resize(std::min(count, wanted.size()));
  for (std::size_t i = 0; i < result.motion.positions.size(); ++i)
    if (wanted[i]) result.motion.positions[i] = bytes.take_matrix<data::Points>();
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

ReplayResult MotionStore::run(const Replay& replay, const ReplayCandidate& candidate) const {
  const std::vector<bool> wanted = wanted_steps(replay);
  const std::string key = key_of(replay, make_environment(replay, candidate), wanted);
  const std::string path = (std::filesystem::path(folder_) / (key + ".rollout")).string();
  if (std::filesystem::exists(path)) return load(wanted, path);
  ReplayResult result = std::move(sysid::run(replay, {candidate}).front());
  save(result, wanted, path);
  for (std::size_t i = 0; i < result.motion.positions.size(); ++i)
    if (!wanted[i]) result.motion.positions[i].resize(0, 3);
  return result;
}

}  // namespace flash::sysid
