#include "sim/cuda/batch_system.h"

#include <algorithm>
#include <stdexcept>

#include "sim/cuda/batch_kernels.h"
#include "sim/cuda/device_plan.h"
#include "sim/cuda/layout/sheet_layout.h"

namespace flash::sim::cuda {

struct BatchSystem::Memory {
  int count;
  FactorPrecision precision;
  FrontPlan front_plan;
  SheetLayout layout;
  DevicePlan plan;
  cudaStream_t stream = nullptr;

  DeviceArray<EnvironmentNumbers> environments;
  DeviceArray<Point> positions;
  DeviceArray<float> vectors, results, changes, block_rows, blocks;
  DeviceArray<__half> factors;
  DeviceArray<VertexRestriction> restrictions;
  DeviceArray<double> gradients, triangle_gradients;
  DeviceArray<ElasticEnergies> energies;
  DeviceArray<int> restriction_counts, restriction_of, positive, solves;
  DeviceArray<float> shares, updates, solved, residuals, images;
  DeviceArray<Four<float>> searches;
  int teams;
  BatchNumbers numbers{};

  Memory(const SheetPlan& sheet, const BendingOperator& bending,
         const std::vector<EnvironmentNumbers>& materials, FactorPrecision factor_precision,
         const FrontSettings& settings)
      : count(static_cast<int>(materials.size())),
        precision(factor_precision),
        front_plan(plan_fronts(sheet.pattern, sheet.sheet.rest.vertices, fitting_fronts(settings))),
        layout(lay_out(sheet, bending, front_plan)),
        plan(front_plan, layout),
        environments(materials) {
    plan.fronts = plan.shared_out(front_plan, 1);
    teams = std::min(count, most_teams());

    const size_t environment_count = materials.size(), team_count = static_cast<size_t>(teams);
    const size_t size = static_cast<size_t>(layout.size), triangles = layout.areas.size();
    const size_t row_size = static_cast<size_t>(layout.slice_starts.back()) * slice_numbers;
    const size_t parts = precision == FactorPrecision::half ? 1 : 2,
                 factor_size = parts * solve_tile_numbers * static_cast<size_t>(front_plan.factor_tiles);
    positions = DeviceArray<Point>(environment_count * size);
    vectors = DeviceArray<float>(environment_count * 3 * size);
    results = DeviceArray<float>(environment_count * 3 * size);
    changes = DeviceArray<float>(environment_count * 3 * size);
    gradients = DeviceArray<double>(environment_count * 3 * size);
    energies = DeviceArray<ElasticEnergies>(environment_count);
    block_rows = DeviceArray<float>(environment_count * row_size);
    blocks = DeviceArray<float>(environment_count * 9 * static_cast<size_t>(layout.block_count));
    factors = DeviceArray<__half>(environment_count * factor_size);
    restrictions = DeviceArray<VertexRestriction>(environment_count * size);
    restriction_counts = DeviceArray<int>(environment_count);
    restriction_of = DeviceArray<int>(environment_count * size);
    positive = DeviceArray<int>(environment_count);
    solves = DeviceArray<int>(environment_count);
    triangle_gradients = DeviceArray<double>(team_count * 9 * triangles);
    shares = DeviceArray<float>(team_count * 36 * triangles);
    updates = DeviceArray<float>(team_count * static_cast<size_t>(front_plan.update_size));
    solved = DeviceArray<float>(team_count * static_cast<size_t>(plan.fronts.vector_size));
    residuals = DeviceArray<float>(team_count * 3 * size);
    images = DeviceArray<float>(team_count * 3 * size);
    searches = DeviceArray<Four<float>>(team_count * size);
    numbers = {plan.fronts,           plan.sheet,          count,
               layout.size,           environments.data(), positions.data(),
               vectors.data(),        restrictions.data(), restriction_counts.data(),
               restriction_of.data(), results.data(),      changes.data(),
               gradients.data(),      energies.data(),     static_cast<long>(row_size),
               block_rows.data(),     blocks.data(),       factors.data(),
               positive.data(),       solves.data(),       triangle_gradients.data(),
               shares.data(),         updates.data(),      solved.data(),
               residuals.data(),      images.data(),       searches.data()};
    check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  }
  ~Memory() {
    if (stream != nullptr) cudaStreamDestroy(stream);
  }

  /// Of the kernel of which the most run at a time.
  int most_teams() const {
    int most = 0;
    for (const BatchKernel kernel : batch_kernels)
      most = std::max(most, resident_teams(kernel, precision, plan.fronts));
    return most;
  }

  void queue(BatchKernel kernel, float tolerance = 0) {
    run(kernel, precision, numbers, teams, tolerance, stream);
  }

  template <typename Number>
  data::Points points(const DeviceArray<Number>& array, int environment) const {
    check(cudaStreamSynchronize(stream));
    const size_t size = 3 * static_cast<size_t>(layout.size);
    const std::vector<Number> flat = array.read(static_cast<size_t>(environment) * size, size);
    data::Points points(layout.size, 3);
    for (int i = 0; i < layout.size; ++i)
      for (int c = 0; c < 3; ++c) points(layout.order[i], c) = flat[3 * i + c];
    return points;
  }
};

BatchSystem::BatchSystem(const SheetPlan& plan, const BendingOperator& bending,
                         const std::vector<EnvironmentNumbers>& environments, FactorPrecision precision,
                         const FrontSettings& fronts)
    : memory_(std::make_unique<Memory>(plan, bending, environments, precision, fronts)) {}
BatchSystem::~BatchSystem() = default;
BatchSystem::BatchSystem(BatchSystem&&) noexcept = default;

int BatchSystem::size() const { return memory_->count; }
const FrontPlan& BatchSystem::fronts() const { return memory_->front_plan; }

void BatchSystem::set_positions(int environment, const data::Points& positions) {
  std::vector<Point> points;
  for (const int vertex : memory_->layout.order)
    points.push_back({positions(vertex, 0), positions(vertex, 1), positions(vertex, 2), 0});
  synchronize();
  memory_->positions.write(static_cast<size_t>(environment) * points.size(), points.data(), points.size());
}

void BatchSystem::set_vector(int environment, const data::Points& vector) {
  std::vector<float> numbers;
  for (const int vertex : memory_->layout.order)
    for (int c = 0; c < 3; ++c) numbers.push_back(static_cast<float>(vector(vertex, c)));
  synchronize();
  memory_->vectors.write(static_cast<size_t>(environment) * numbers.size(), numbers.data(), numbers.size());
}

void BatchSystem::set_restrictions(int environment, const std::vector<VertexRestriction>& restrictions) {
  if (restrictions.size() > memory_->layout.order.size())
    throw std::invalid_argument("set_restrictions: more than vertices");
  const size_t size = memory_->layout.order.size(), first = static_cast<size_t>(environment) * size;
  const int count = static_cast<int>(restrictions.size());
  std::vector<int> restriction_of(size, -1);
  for (int k = 0; k < count; ++k) restriction_of[static_cast<size_t>(restrictions[k].place)] = k;
  synchronize();
  memory_->restrictions.write(first, restrictions.data(), restrictions.size());
  memory_->restriction_of.write(first, restriction_of.data(), size);
  memory_->restriction_counts.write(static_cast<size_t>(environment), &count, 1);
}

void BatchSystem::evaluate() { memory_->queue(BatchKernel::evaluate); }
void BatchSystem::assemble_matrix() { memory_->queue(BatchKernel::assemble_matrix); }
void BatchSystem::assemble_preconditioner() { memory_->queue(BatchKernel::assemble_preconditioner); }
void BatchSystem::factorize() { memory_->queue(BatchKernel::factorize); }
void BatchSystem::multiply() { memory_->queue(BatchKernel::multiply); }
void BatchSystem::solve() { memory_->queue(BatchKernel::solve); }
void BatchSystem::find_directions(double tolerance) {
  memory_->queue(BatchKernel::find_directions, static_cast<float>(tolerance));
}
void BatchSystem::synchronize() { check(cudaStreamSynchronize(memory_->stream)); }

data::Points BatchSystem::result(int environment) const {
  return memory_->points(memory_->results, environment);
}
data::Points BatchSystem::change(int environment) const {
  return memory_->points(memory_->changes, environment);
}
data::Points BatchSystem::gradient(int environment) const {
  return memory_->points(memory_->gradients, environment);
}

std::vector<ElasticEnergies> BatchSystem::energies() const {
  check(cudaStreamSynchronize(memory_->stream));
  return memory_->energies.read(0, memory_->energies.size());
}

std::vector<bool> BatchSystem::factorized() const {
  check(cudaStreamSynchronize(memory_->stream));
  std::vector<bool> positive;
  for (const int flag : memory_->positive.read(0, memory_->positive.size())) positive.push_back(flag == 1);
  return positive;
}

std::vector<int> BatchSystem::solves() const {
  check(cudaStreamSynchronize(memory_->stream));
  return memory_->solves.read(0, memory_->solves.size());
}

}  // namespace flash::sim::cuda
