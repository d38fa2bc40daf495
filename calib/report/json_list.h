#pragma once
#include <Eigen/Core>
#include <nlohmann/json.hpp>

namespace flash::calib {

/// The numbers of a vector.
template <class Vector>
nlohmann::ordered_json list(const Vector& v) {
  nlohmann::ordered_json values = nlohmann::ordered_json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) values.push_back(v[i]);
  return values;
}

}  // namespace flash::calib
