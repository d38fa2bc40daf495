#include "sim/cuda/step_tables.h"

#include <algorithm>

#include "sim/cuda/device_arena.h"

namespace flash::sim::cuda {
namespace {

constexpr float usual_work = 27;  // of a step, in solves, where nothing is known

}  // namespace

int StepPlan::most_steps() const {
  int most = 0;
  for (std::size_t e = 0; e < begins.size(); ++e) most = std::max(most, ends[e] - begins[e]);
  return most;
}

StepTables::StepTables(int environments, int vertices, int holds, int obstacles)
    : environments_(static_cast<std::size_t>(environments)),
      vertices_(static_cast<std::size_t>(vertices)),
      holds_(static_cast<std::size_t>(holds)),
      obstacles_(static_cast<std::size_t>(obstacles)),
      expected_(environments_, usual_work) {}

StepTables::Places StepTables::lay_out(char* begin) const {
  DeviceArena arena(begin);
  Places places{};
  for (int** each : {&places.begins, &places.ends, &places.steps, &places.work})
    *each = arena.take<int>(environments_);
  places.expected = arena.take<float>(environments_);
  places.unfinished = arena.take<int>(1);
  places.queue_bytes = arena.used();
  places.motions = arena.take<int>(environments_);
  places.hold_starts = arena.take<int>(motions_ * (steps_ + 1));
  places.spring_starts = arena.take<int>(motions_ * (steps_ + 1));
  places.kept_index = arena.take<int>(kept_index_);
  places.holds = arena.take<HeldPlace>(held_);
  places.springs = arena.take<SpringPlace>(springs_);
  places.poses = arena.take<FramePose>(motions_ * (steps_ + 1) * static_cast<std::size_t>(frames_));
  places.bytes = arena.used();
  return places;
}

StepTables::Results StepTables::lay_out_results(char* begin) const {
  DeviceArena arena(begin);
  Results results{};
  const std::size_t rows = environments_ * steps_;
  results.stats = arena.take<ReplayStats>(rows);
  results.hold_forces = arena.take<double>(3 * rows * holds_);
  results.obstacle_forces = arena.take<double>(3 * rows * obstacles_);
  results.bytes = arena.used();
  return results;
}

void StepTables::reserve(int steps, int kept_steps) {
  StepTables largest(static_cast<int>(environments_), 0, static_cast<int>(holds_),
                     static_cast<int>(obstacles_));
  largest.steps_ = static_cast<std::size_t>(steps);
  const std::size_t bytes = largest.lay_out_results(nullptr).bytes;
  device_results_.hold(bytes);
  results_.hold(bytes);
  kept_positions_.hold(environments_ * static_cast<std::size_t>(kept_steps) * 3 * vertices_);
}

void StepTables::copy_to_device(std::size_t bytes, cudaStream_t stream) {
  check(cudaMemcpyAsync(device_tables_.data(), tables_.data(), bytes, cudaMemcpyHostToDevice, stream));
}

void StepTables::open(const StepPlan& plan, cudaStream_t stream) {
  const auto [first, last] = std::pair{*std::min_element(plan.begins.begin(), plan.begins.end()),
                                       *std::max_element(plan.ends.begin(), plan.ends.end())};
  steps_ = static_cast<std::size_t>(plan.most_steps());
  motions_ = static_cast<std::size_t>(plan.flat.count());
  held_ = plan.flat.holds.size();
  springs_ = plan.flat.springs.size();
  frames_ = plan.flat.frames;
  kept_ = plan.kept_steps.size();
  kept_index_ = kept_ > 0 ? static_cast<std::size_t>(last - first) : 0;
  kept_begin_ = first;
  reserve(static_cast<int>(steps_), static_cast<int>(kept_));
  const std::size_t bytes = lay_out(nullptr).bytes;
  if (bytes > device_tables_.size()) {  // with room to grow: what is held changes from step to step
    tables_.hold(bytes + bytes / 2);
    device_tables_.hold(bytes + bytes / 2);
  }
  const Places to = lay_out(tables_.data());
  std::copy(plan.begins.begin(), plan.begins.end(), to.begins);
  std::copy(plan.ends.begin(), plan.ends.end(), to.ends);
  std::copy(expected_.begin(), expected_.end(), to.expected);
  *to.unfinished = 0;
  for (std::size_t e = 0; e < environments_; ++e) {
    const bool steps = plan.begins[e] < plan.ends[e];
    to.steps[e] = steps ? plan.begins[e] : -1;
    to.work[e] = 0;
    *to.unfinished += steps ? 1 : 0;
  }
  std::copy(plan.motions.begin(), plan.motions.end(), to.motions);
  std::copy(plan.flat.starts.begin(), plan.flat.starts.end(), to.hold_starts);
  std::copy(plan.flat.spring_starts.begin(), plan.flat.spring_starts.end(), to.spring_starts);
  std::copy(plan.flat.holds.begin(), plan.flat.holds.end(), to.holds);
  std::copy(plan.flat.springs.begin(), plan.flat.springs.end(), to.springs);
  std::copy(plan.flat.poses.begin(), plan.flat.poses.end(), to.poses);
  std::fill(to.kept_index, to.kept_index + kept_index_, -1);
  for (std::size_t k = 0; k < kept_; ++k)
    if (const int step = plan.kept_steps[k]; step > first && step <= last)
      to.kept_index[step - first - 1] = static_cast<int>(k);
  copy_to_device(bytes, stream);
  if (steps_ > 0) check(cudaMemsetAsync(device_results_.data(), 0, lay_out_results(nullptr).bytes, stream));
}

void StepTables::queue(int begin, int end, cudaStream_t stream) {
  const Places to = lay_out(tables_.data());
  std::fill(to.ends, to.ends + environments_, end);
  std::fill(to.steps, to.steps + environments_, begin);
  std::fill(to.work, to.work + environments_, 0);
  *to.unfinished = static_cast<int>(environments_);
  copy_to_device(to.queue_bytes, stream);
}

void StepTables::note_work(int environment, int work) {
  constexpr float newest = 0.3F;  // the last three steps have two thirds of the weight
  float& expected = expected_[static_cast<std::size_t>(environment)];
  expected += newest * (static_cast<float>(work) - expected);
}

void StepTables::put(ReplayNumbers& numbers) const {
  const Places at = lay_out(device_tables_.data());
  const Results results = lay_out_results(device_results_.data());
  numbers.waiting.steps = at.steps;
  numbers.waiting.work = at.work;
  numbers.waiting.expected = at.expected;
  numbers.waiting.unfinished = at.unfinished;
  numbers.waiting.begins = at.begins;
  numbers.waiting.ends = at.ends;
  numbers.waiting.count = static_cast<int>(environments_);
  numbers.motions = at.motions;
  numbers.hold_starts = at.hold_starts;
  numbers.motion_steps = static_cast<int>(steps_) + 1;
  numbers.holds = at.holds;
  numbers.spring_starts = at.spring_starts;
  numbers.springs = at.springs;
  numbers.poses = at.poses;
  numbers.frames = frames_;
  numbers.stats = results.stats;
  numbers.stats_each = static_cast<int>(steps_);
  numbers.hold_forces = results.hold_forces;
  numbers.obstacle_forces = results.obstacle_forces;
  numbers.kept_index = at.kept_index;
  numbers.kept_begin = kept_begin_;
  numbers.kept_count = static_cast<int>(kept_);
  numbers.kept = kept_positions_.data();
}

void StepTables::fetch(cudaStream_t stream) {
  if (steps_ == 0) return;
  check(cudaMemcpyAsync(results_.data(), device_results_.data(), lay_out_results(nullptr).bytes,
                        cudaMemcpyDeviceToHost, stream));
}

std::size_t StepTables::row(int environment) const { return static_cast<std::size_t>(environment) * steps_; }

const ReplayStats* StepTables::stats(int environment) const {
  return lay_out_results(results_.data()).stats + row(environment);
}

const double* StepTables::hold_forces(int environment) const {
  return lay_out_results(results_.data()).hold_forces + 3 * row(environment) * holds_;
}

const double* StepTables::obstacle_forces(int environment) const {
  return lay_out_results(results_.data()).obstacle_forces + 3 * row(environment) * obstacles_;
}

const double* StepTables::kept(int environment, int index) const {
  return kept_positions_.data() +
         (static_cast<std::size_t>(environment) * kept_ + static_cast<std::size_t>(index)) * 3 * vertices_;
}

}  // namespace flash::sim::cuda
