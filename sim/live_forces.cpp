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

LiveForces::LiveForces(const std::vector<Worlds>& worlds, const std::vector<std::string>& obstacles) {
  constexpr EndEffectorNumbers none{.frame = -1, .hold = -1, .obstacle = -1};
  const int environments = worlds.front().size();
  for (int k = 0; k < std::ssize(obstacles); ++k) {
    std::vector<EndEffectorNumbers> numbers(worlds.size(), none);
    for (EndEffectorNumbers& each : numbers) each.obstacle = k;
    add(obstacles[static_cast<std::size_t>(k)], std::move(numbers), environments);
  }
  for (std::size_t w = 0; w < worlds.size(); ++w) {
    const std::vector<Hold>& holds = worlds[w].given(0).holds;
    for (int k = 0; k < std::ssize(holds); ++k) {
      std::vector<EndEffectorNumbers> numbers(worlds.size(), none);
      numbers[w].hold = k;
      add(holds[static_cast<std::size_t>(k)].name, std::move(numbers), environments);
    }
  }
}

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

data::Points LiveForces::held_places(const std::string& name, const std::vector<Worlds>& worlds,
                                     int environment) const {
  const Force& force = named(name);
  data::Points places(0, 3);
  for (std::size_t w = 0; w < worlds.size(); ++w) {
    const std::vector<HeldVertices>& held = worlds[w].given(environment).state.held;
    const data::Points& positions = worlds[w].environment(environment).state.positions;
    for (const std::vector<EndEffectorNumbers>& numbers : force.parts) {
      const int hold = numbers[w].hold;
      if (hold < 0 || hold >= std::ssize(held)) continue;
      const std::vector<int>& taken = held[static_cast<std::size_t>(hold)].vertices;
      const Eigen::Index before = places.rows();
      places.conservativeResize(before + std::ssize(taken), Eigen::NoChange);
      places.bottomRows(std::ssize(taken)) = positions(taken, Eigen::all);
    }
  }
  return places;
}

}  // namespace flash::sim
