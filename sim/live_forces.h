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
  LiveForces() = default;
  /// Of the obstacles, by these names, and of the holds that a scene's own file has.
  LiveForces(const std::vector<Worlds>& worlds, const std::vector<std::string>& obstacles);

  /// Of what has these numbers in each of the worlds; a hold or an obstacle of -1 is none. What has the name
  /// of one before acts with it.
  void add(const std::string& name, std::vector<EndEffectorNumbers> numbers, int environments);

  /// Takes them from the last step of the worlds.
  void renew(const std::vector<Worlds>& worlds);

  std::vector<std::string> names() const;  ///< in the order in which they were added

  /// environments x 3 [N].  Throws data::InputError.
  const std::vector<double>& of(const std::string& name) const;

  /// Where the vertices are that what has this name carries in an environment.  Throws data::InputError.
  data::Points held_places(const std::string& name, const std::vector<Worlds>& worlds, int environment) const;

 private:
  struct Force {
    std::string name;
    std::vector<std::vector<EndEffectorNumbers>> parts;  ///< numbers in each of the worlds
    std::vector<double> sum;
  };
  const Force& named(const std::string& name) const;

  std::deque<Force> forces_;
};

}  // namespace flash::sim
