#pragma once
#include <deque>
#include <string>
#include <vector>

#include "sim/scene/end_effector.h"
#include "sim/worlds.h"

namespace flash::sim {

/// Forces of end effectors and obstacles on all objects of a live scene together. They stay where they are.
class LiveForces {
 public:
  /// Of what has these numbers in each of the worlds; a hold of -1 is none.
  void add(std::string name, std::vector<EndEffectorNumbers> numbers, int environments);

  /// Takes them from the last step of the worlds.
  void renew(const std::vector<Worlds>& worlds);

  /// environments x 3 [N].  Throws data::InputError.
  const std::vector<double>& of(const std::string& name) const;

 private:
  struct Force {
    std::string name;
    std::vector<EndEffectorNumbers> numbers;
    std::vector<double> sum;
  };
  std::deque<Force> forces_;
};

}  // namespace flash::sim
