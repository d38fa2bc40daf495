#include "apps/sim/hold_watch.h"

#include <algorithm>
#include <map>
#include <utility>

#include "data/files/text.h"

namespace flash::sim {
namespace {

std::string name_of(const Hold& hold) {
  return hold.frame == base_frame && (hold.name.empty() || hold.name == "fixed") ? "a support" : hold.name;
}

/// Names the first vertex that two closed holds carry in one axis; empty where there is none.
std::string contest(const Environment& environment) {
  std::map<std::pair<int, int>, std::size_t> owner;  // of a vertex and an axis
  for (std::size_t k = 0; k < environment.holds.size(); ++k)
    for (const int vertex : environment.state.held[k].vertices)
      for (int axis = 0; axis < 3; ++axis) {
        if (!environment.holds[k].axes[static_cast<std::size_t>(axis)]) continue;
        const auto [entry, fresh] = owner.try_emplace({vertex, axis}, k);
        if (fresh || entry->second == k) continue;
        return "vertex " + std::to_string(vertex) + " is held by " +
               name_of(environment.holds[entry->second]) + " and by " + name_of(environment.holds[k]) +
               " at " + data::format_short(environment.state.time) + " s; it obeys " +
               name_of(environment.holds[k]);
      }
  return {};
}

}  // namespace

void HoldWatch::see(const Environment& environment) {
  std::vector<bool> now;
  for (const HeldVertices& held : environment.state.held) now.push_back(!held.vertices.empty());
  if (now == closed) return;
  closed = now;
  ever_closed.resize(now.size());
  for (std::size_t k = 0; k < now.size(); ++k) ever_closed[k] = ever_closed[k] || now[k];
  if (contested.empty()) contested = contest(environment);
}

std::vector<std::string> hold_warnings(const HoldWatch& watch, const Environment& environment) {
  std::vector<std::string> warnings;
  for (std::size_t k = 0; k < environment.holds.size(); ++k) {
    const Hold& hold = environment.holds[k];
    if (k < watch.ever_closed.size() && watch.ever_closed[k]) continue;
    warnings.push_back(name_of(hold) + " never held anything: asked from " + data::format_short(hold.from) +
                       " to " + data::format_short(hold.to) +
                       " s, and a hold acts in the steps whose middle lies between");
  }
  if (!watch.contested.empty()) warnings.push_back(watch.contested);
  return warnings;
}

std::string holder_of(const Environment& environment, int vertex) {
  for (std::size_t k = environment.holds.size(); k-- > 0;) {
    const std::vector<int>& held = environment.state.held[k].vertices;
    if (std::count(held.begin(), held.end(), vertex) > 0) return name_of(environment.holds[k]);
  }
  return "a support";
}

}  // namespace flash::sim
