#pragma once
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// Sums over a team, to the same bits whatever the number of its blocks. There are as many seats as the
// largest team has warps. A seat adds up the items 32 seat + lane, and those `seats` times 32 further on; a
// team of fewer warps takes one seat after the other. Then each warp adds up what stands at the seats.

inline constexpr int seats = most_team_blocks * block_warps;

template <typename Number>
__device__ Number sum_over_warp(Number value) {
  for (int offset = warp_lanes / 2; offset > 0; offset /= 2) value += across_warp(value, offset);
  return value;
}

/// Sums that stand on chip at the same time at most, a number a seat each.
inline constexpr int most_sums = 12;

/// The seats' sums of `count` values over the items below n, to `partial` of all blocks, one value behind the
/// other: use(i, load(i), values) adds what item i has; a few items are loaded at a time.
template <int count, int together = 1, typename Number, typename Load, typename Use>
__device__ void add_up(int n, Number* partial, const Load& load, const Use& use) {
  static_assert(count <= most_sums);
  const int warps = team_warps();
  for (int first = team_warp(); first < seats && warp_lanes * first < n; first += together * warps) {
    Number values[together][count] = {};
    for (int base = warp_lanes * first + lane(); base < n; base += warp_lanes * seats) {
      decltype(load(0)) loaded[together];
      bool there[together];
#pragma unroll
      for (int k = 0; k < together; ++k) {
        const int i = base + warp_lanes * k * warps;
        there[k] = i < n && first + k * warps < seats;
        loaded[k] = load(there[k] ? i : base);
      }
#pragma unroll
      for (int k = 0; k < together; ++k)
        if (there[k]) use(base + warp_lanes * k * warps, loaded[k], values[k]);
    }
#pragma unroll
    for (int k = 0; k < together; ++k)
#pragma unroll
      for (int v = 0; v < count; ++v) values[k][v] = sum_over_warp(values[k][v]);
    if (lane() >= team_blocks()) continue;
    Number* to = team_blocks() == 1 ? partial : in_block(partial, lane());
#pragma unroll
    for (int k = 0; k < together; ++k)
      if (const int seat = first + k * warps; seat < seats)
#pragma unroll
        for (int v = 0; v < count; ++v) to[seats * v + seat] = values[k][v];
  }
}

/// The same with own(i, values).
template <int count, typename Number, typename Own>
__device__ void add_up(int n, Number* partial, const Own& own) {
  add_up<count>(
      n, partial, [](int) { return 0; }, [&](int i, int, Number(&values)[count]) { own(i, values); });
}

/// A sum over n items that add_up has left at `partial`, behind a barrier.
template <typename Number>
__device__ Number total(int n, const Number* partial) {
  const int used = min(seats, (n + warp_lanes - 1) / warp_lanes);
  Number sum = 0;
  for (int seat = lane(); seat < used; seat += warp_lanes) sum += partial[seat];
  return sum_over_warp(sum);
}

/// Sums over n items of what own(i, values) adds to them, for all threads. `partial`: on chip, a number a
/// seat for each value, which is free behind a barrier.
template <int count, typename Number, typename Own>
__device__ void sum_over_team(int n, Number (&sums)[count], Number* partial, const Own& own) {
  synchronize_team();
  add_up<count>(n, partial, own);
  synchronize_team();
#pragma unroll
  for (int v = 0; v < count; ++v) sums[v] = total(n, partial + seats * v);
}

/// The larger of two numbers, of which what is not a number counts as the largest.
template <typename Number>
__device__ Number worse_of(Number worst, Number other) {
  return other <= worst || worst != worst ? worst : other;
}

__device__ inline double worst_over_warp(double value) {
  for (int offset = warp_lanes / 2; offset > 0; offset /= 2)
    value = worse_of(value, across_warp(value, offset));
  return value;
}

/// The largest of one value a thread, not negative, for all threads; what is not a number counts as the
/// largest. `partial`: on chip, a number a seat, which is free behind a barrier.
__device__ inline double worst_over_team(double value, double* partial) {
  value = worst_over_warp(value);
  synchronize_team();
  if (lane() == 0) put_in_all(partial + team_warp(), value);
  synchronize_team();
  double worst = 0;
  for (int w = lane(); w < team_warps(); w += warp_lanes) worst = worse_of(worst, partial[w]);
  return worst_over_warp(worst);
}

}  // namespace flash::sim::cuda
