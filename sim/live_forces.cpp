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

void LiveForces::add(std::string name, std::vector<EndEffectorNumbers> numbers, int environments) {
  forces_.push_back(
      {std::move(name), std::move(numbers), std::vector<double>(3 * static_cast<std::size_t>(environments))});
}

void LiveForces::renew(const std::vector<Worlds>& worlds) {
  for (Force& force : forces_) {
    std::fill(force.sum.begin(), force.sum.end(), 0.0);
    for (std::size_t w = 0; w < worlds.size(); ++w)
      for (int e = 0; e < worlds[w].size(); ++e) {
        const StepReport& report = worlds[w].report(e);
        add_force(report.hold_forces, force.numbers[w].hold, e, force.sum);
        add_force(report.obstacle_forces, force.numbers[w].obstacle, e, force.sum);
      }
  }
}

const std::vector<double>& LiveForces::of(const std::string& name) const {
  return forces_[number_of("end effector or obstacle", name, names_of(forces_))].sum;
}

}  // namespace flash::sim
