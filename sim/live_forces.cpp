#include "sim/live_forces.h"

#include <Eigen/Core>
#include <algorithm>
#include <utility>

#include "sim/named.h"

namespace flash::sim {
namespace {

/// Adds a force to that of environment e. There is none before the first step, nor of what is no obstacle.
void add_force(const std::vector<Eigen::Vector3d>& forces, int number, int e, std::vector<double>& sum) {
  if (number < 0 || number >= std::ssize(forces)) return;
  Eigen::Map<Eigen::Vector3d>(sum.data() + 3 * e) += forces[static_cast<std::size_t>(number)];
}

}  // namespace

void LiveForces::add(const std::string& name, std::vector<EndEffectorNumbers> numbers, int environments) {
  auto force = std::find_if(forces_.begin(), forces_.end(), [&](const Force& f) { return f.name == name; });
  if (force == forces_.end())
    force = forces_.insert(force,
                           Force{name, {}, std::vector<double>(3 * static_cast<std::size_t>(environments))});
  force->parts.push_back(std::move(numbers));
}

std::vector<std::string> LiveForces::names() const { return names_of(forces_); }

void LiveForces::renew(const std::vector<Worlds>& worlds) {
  for (Force& force : forces_) {
    std::fill(force.sum.begin(), force.sum.end(), 0.0);
    for (std::size_t w = 0; w < worlds.size(); ++w)
      for (int e = 0; e < worlds[w].size(); ++e) {
        const StepReport& report = worlds[w].report(e);
        for (const std::vector<EndEffectorNumbers>& numbers : force.parts) {
          add_force(report.hold_forces, numbers[w].hold, e, force.sum);
          add_force(report.obstacle_forces, numbers[w].obstacle, e, force.sum);
        }
      }
  }
}

const LiveForces::Force& LiveForces::named(const std::string& name) const {
  return forces_[number_of("end effector, obstacle or hold", name, names_of(forces_))];
}

const std::vector<double>& LiveForces::of(const std::string& name) const { return named(name).sum; }

std::vector<int> LiveForces::held(const std::string& name, const Worlds& worlds, std::size_t w,
                                  int environment) const {
  const std::vector<HeldVertices>& held = worlds.given(environment).state.held;
  std::vector<int> vertices;
  for (const std::vector<EndEffectorNumbers>& numbers : named(name).parts)
    if (const int hold = numbers[w].hold; hold >= 0 && hold < std::ssize(held)) {
      const std::vector<int>& taken = held[static_cast<std::size_t>(hold)].vertices;
      vertices.insert(vertices.end(), taken.begin(), taken.end());
    }
  return vertices;
}

}  // namespace flash::sim
