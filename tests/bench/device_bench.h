#pragma once
#include <sstream>
#include <string>
#include <vector>

namespace flash::sim::cuda {

// Of an H200: copies between places of its memory, and multiply-adds in single precision, measured.
inline constexpr double bandwidth = 4.26e12, single_rate = 60.8e12;

/// Numbers with commas between them.
inline std::vector<int> numbers_of(const std::string& list) {
  std::vector<int> numbers;
  std::stringstream stream(list);
  for (std::string item; std::getline(stream, item, ',');) numbers.push_back(std::stoi(item));
  return numbers;
}

}  // namespace flash::sim::cuda
