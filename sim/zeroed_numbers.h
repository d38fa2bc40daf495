#pragma once
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

namespace flash::sim {

/// Many numbers, zero until they are written. Memory is taken where they are first touched, by the thread
/// that does so: a vector would write all of it before anything else begins.
class ZeroedNumbers {
 public:
  ZeroedNumbers() = default;
  explicit ZeroedNumbers(std::size_t count)
      : numbers_(static_cast<double*>(std::calloc(count, sizeof(double)))) {
    if (count > 0 && numbers_ == nullptr) throw std::bad_alloc();
  }
  double* data() { return numbers_.get(); }
  const double* data() const { return numbers_.get(); }

 private:
  struct Free {
    void operator()(double* numbers) const { std::free(numbers); }
  };
  std::unique_ptr<double[], Free> numbers_;
};

}  // namespace flash::sim
