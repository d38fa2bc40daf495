#include "sysid/infer/scrambled_halton.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "sysid/infer/random_numbers.h"

namespace flash::sysid {
namespace {

int next_prime(int after) {
  for (int candidate = after + 1;; ++candidate) {
    int divisor = 2;
    while (divisor * divisor <= candidate && candidate % divisor != 0) ++divisor;
    if (divisor * divisor > candidate) return candidate;
  }
}

std::vector<int> permutation(int count, RandomNumbers& random) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i-- > 1;)
    std::swap(order[i], order[static_cast<std::size_t>(random.uniform() * static_cast<double>(i + 1))]);
  return order;
}

}  // namespace

Eigen::MatrixXd scrambled_halton(Eigen::Index count, Eigen::Index dimensions, unsigned seed) {
  constexpr double kResolution = 0x1p-52;  // Of a coordinate. Work: rounding.
  RandomNumbers random(seed);
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(count, dimensions);
  int base = 1;
  for (Eigen::Index k = 0; k < dimensions; ++k) {
    base = next_prime(base);
    // Digits of 0 are permuted too, so that all places count.
    Eigen::Index before = 1;  // base^place, as far as a digit may differ from 0
    for (double size = 1.0 / base; size > kResolution; size /= base) {
      const std::vector<int> digits = permutation(base, random);
      for (Eigen::Index i = 0; i < count; ++i)
        points(i, k) += size * digits[static_cast<std::size_t>(i / before % base)];
      before = std::min(before * base, std::max<Eigen::Index>(count, 1));
    }
  }
  return points;
}

}  // namespace flash::sysid
