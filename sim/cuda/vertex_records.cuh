#pragma once
#include <cstring>

#include "sim/cuda/vertex_records.h"

namespace flash::sim::cuda {

/// The record of vertex i in a layer.
template <typename Record>
__device__ Record read(const VertexRecords<Record>& records, int i, int layer = 0) {
  constexpr int count = VertexRecords<Record>::numbers_each;
  const double* from = records.numbers + static_cast<long>(layer) * count * records.size + i;
  double numbers[count];
#pragma unroll
  for (int k = 0; k < count; ++k) numbers[k] = from[static_cast<long>(k) * records.size];
  Record record;
  memcpy(&record, numbers, sizeof(Record));
  return record;
}

template <typename Record>
__device__ void write(const Record& record, const VertexRecords<Record>& records, int i, int layer = 0) {
  constexpr int count = VertexRecords<Record>::numbers_each;
  double* to = records.numbers + static_cast<long>(layer) * count * records.size + i;
  double numbers[count];
  memcpy(numbers, &record, sizeof(Record));
#pragma unroll
  for (int k = 0; k < count; ++k) to[static_cast<long>(k) * records.size] = numbers[k];
}

}  // namespace flash::sim::cuda
