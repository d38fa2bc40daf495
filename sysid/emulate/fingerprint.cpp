#include "sysid/emulate/fingerprint.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <set>
#include <string_view>
#include <utility>

#include "data/asset/asset.h"
#include "data/files/text.h"

namespace flash::source_digest {

std::string_view motions();
std::string_view scores();

}  // namespace flash::source_digest

namespace flash::sysid {
namespace {

/// FNV-1a, 64 bits: tells inputs apart, promises nothing against intent.
class Hash {
 public:
  void add(const void* bytes, std::size_t size) {
    const auto* byte = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < size; ++i) state_ = (state_ ^ byte[i]) * 0x100000001b3ULL;
  }
  void add(double value) { add(&value, sizeof value); }
  void add(const std::string& text) {
    add(static_cast<double>(text.size()));
    add(text.data(), text.size());
  }
  template <class Derived>
  void add_matrix(const Eigen::DenseBase<Derived>& matrix) {
    add(static_cast<double>(matrix.rows()));
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
      for (Eigen::Index j = 0; j < matrix.cols(); ++j) add(static_cast<double>(matrix(i, j)));
    }
  }
  std::string text() const {
    char buffer[17];
    std::snprintf(buffer, sizeof buffer, "%016llx", static_cast<unsigned long long>(state_));
    return buffer;
  }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325ULL;
};

std::string sheet_hash(const data::Recording& recording) {
  Hash hash;
  hash.add_matrix(recording.mesh.vertices);
  hash.add_matrix(recording.mesh.triangles);
  hash.add_matrix(recording.start);
  if (recording.is_solid()) hash.add_matrix(recording.tetrahedra);
  return hash.text();
}

std::string surroundings_hash(const data::Recording& recording) {
  Hash hash;
  hash.add_matrix(recording.gravity);
  hash.add(recording.has_table);
  hash.add_matrix(recording.table_point);
  hash.add_matrix(recording.table_normal);
  hash.add_matrix(recording.crop.min);
  hash.add_matrix(recording.crop.max);
  return hash.text();
}

std::string nuisance_hash(const data::NuisanceBounds& bounds) {
  Hash hash;
  hash.add_matrix(bounds.offset);
  hash.add(bounds.yaw);
  hash.add(bounds.time);
  return hash.text();
}

std::string trajectories_hash(const data::Recording& recording) {
  Hash hash;
  for (const auto& [name, trajectory] : recording.trajectories) {
    hash.add(name);
    for (std::size_t i = 0; i < trajectory.times.size(); ++i) {
      hash.add(trajectory.times[i]);
      hash.add_matrix(trajectory.poses[i].matrix());
    }
  }
  return hash.text();
}

std::string grasps_hash(const Replay& replay) {
  Hash hash;
  for (const data::RecordedGrasp& grasp : replay.recording.grasps) {
    const data::GraspShape shape = replay.settings.grasp_shape.value_or(grasp.shape);
    hash.add(grasp.gripper);
    for (const int vertex : grasp.select.vertices) hash.add(vertex);
    if (grasp.select.corner) hash.add(2 * (*grasp.select.corner)[0] + (*grasp.select.corner)[1]);
    if (grasp.select.position) hash.add_matrix(*grasp.select.position);
    for (const double value :
         {grasp.from, grasp.to, replay.settings.grasp_within.value_or(grasp.select.within), grasp.depth,
          grasp.pitch, static_cast<double>(shape)}) {
      hash.add(value);
    }
    hash.add_matrix(grasp.direction);
    if (replay.settings.clamp_slopes) hash.add("slopes");
  }
  return hash.text();
}

std::string supports_hash(const data::Recording& recording) {
  Hash hash;
  const auto add = [&](const data::Selection& select) {
    for (const int vertex : data::select_vertices(recording, select, "supports")) hash.add(vertex);
  };
  for (const data::RecordedSupport& support : recording.supports) {
    add(support.select);
    hash.add(support.from);
    hash.add(support.to);
  }
  for (const data::RecordedLoad& load : recording.loads) {
    add(load.select);
    hash.add(load.attached_mass);
  }
  return hash.text();
}

std::string keyframes_hash(const std::vector<Observation>& observations) {
  Hash hash;
  for (const Observation& observation : observations) {
    hash.add(observation.t);
    hash.add(observation.weight);
    hash.add_matrix(observation.points);
    hash.add_matrix(observation.contour);
    hash.add_matrix(observation.markers);
    for (const Mark& mark : observation.marks)
      if (!mark.offset.isZero(0)) hash.add_matrix(mark.offset);
    if (observation.force) hash.add_matrix(*observation.force);
  }
  return hash.text();
}

std::string values_text(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + data::format_number(value);
  return text;
}

void add_replay(const Replay& replay, Fingerprint& print) {
  const std::string name = "recording " + replay.recording.name;
  print[name + " mesh and start"] = sheet_hash(replay.recording);
  print[name + " gravity, table and crop"] = surroundings_hash(replay.recording);
  print[name + " nuisance bounds"] = nuisance_hash(replay.recording.nuisance);
  print[name + " trajectories"] = trajectories_hash(replay.recording);
  print[name + " grasps"] = grasps_hash(replay);
  if (!replay.recording.supports.empty() || !replay.recording.loads.empty())
    print[name + " supports and loads"] = supports_hash(replay.recording);
  print[name + " keyframes"] = keyframes_hash(replay.observations);
  print[name + " begins, steps, closing time"] =
      values_text({replay.start, static_cast<double>(replay.steps), replay.settings.closing_time});
  if (replay.recording.is_solid())
    print["element_order"] = replay.settings.element_order == data::ElementOrder::quadratic ? "2" : "1";
  const sim::SolverSettings& solver = replay.settings.solver;
  print["time_step_s"] = data::format_number(solver.time_step);
  print["tolerance"] = data::format_number(solver.tolerance);
  print["iterations"] = std::to_string(solver.max_iterations);
  if (const auto& layers = replay.settings.self_contact) {
    print["self_contact_m"] = data::format_number(layers->thickness);
    print["layer_friction"] = layers->friction < 0 ? "friction" : data::format_number(layers->friction);
  }
}

void add_solid(const data::SolidMaterial& m, Fingerprint& print) {
  print["asset constitutive"] = data::to_string(m.constitutive);
  print["asset young"] = data::format_number(m.youngs_modulus);
  print["asset poisson"] = data::format_number(m.poissons_ratio);
  print["asset density"] = data::format_number(m.density);
  print["asset friction"] = data::format_number(m.friction);
  print["asset air_drag"] = data::format_number(m.air_drag);
  print["asset stiffness_damping"] = data::format_number(m.stiffness_damping);
}

void add_material(const MaterialBase& base, Fingerprint& print) {
  if (base.solid) return add_solid(*base.solid, print);
  const data::SheetMaterial& m = base.material;
  print["asset constitutive"] = data::to_string(m.constitutive);
  print["asset bending_model"] = data::to_string(m.bending_model);
  print["asset E t"] = data::format_number(m.membrane_stiffness);
  print["asset poisson"] = data::format_number(m.poissons_ratio);
  print["asset areal_density"] = data::format_number(m.areal_density);
  print["asset bending_rigidity"] =
      base.bending_from_thickness ? "from thickness" : data::format_number(m.bending_rigidity);
  print["asset friction"] = data::format_number(m.friction);
  print["asset air_drag"] = data::format_number(m.air_drag);
  print["asset stiffness_damping"] = data::format_number(m.stiffness_damping);
  if (m.weave != data::Weave{})
    print["asset weave"] =
        values_text({m.weave.bending_ratio, m.weave.twisting_ratio, m.weave.warp_direction});
  if (m.weave.is_of_membrane())
    print["asset weave of the membrane"] = values_text({m.weave.young_ratio, m.weave.shear_ratio});
  if (std::isfinite(m.yield_curvature))
    print["asset yield_curvature"] = data::format_number(m.yield_curvature);
  print["asset thickness"] = base.thickness ? data::format_number(*base.thickness) : "none";
}

void add_score(const ScoreSettings& score, Fingerprint& print) {
  const Objective& objective = score.objective;
  print["distance"] = values_text({static_cast<double>(objective.robust.kind), objective.robust.trim_fraction,
                                   objective.robust.huber_delta});
  print["sigmas of cloud, contour, marks, force"] = values_text(
      {objective.cloud_sigma, objective.contour_sigma, objective.marker_sigma, objective.force_sigma});
  print["two_sided"] = objective.two_sided ? "yes" : "no";
  const RegistrationSettings& fit = score.registration;
  print["registration"] =
      values_text({static_cast<double>(fit.iterations), static_cast<double>(fit.points_per_keyframe),
                   fit.tolerance, fit.softening}) +
      " from " + values_text(fit.time_starts);
  print["shared offset, yaw, time"] =
      values_text({static_cast<double>(score.shared.offset), static_cast<double>(score.shared.yaw),
                   static_cast<double>(score.shared.time)});
}

}  // namespace

Fingerprint fingerprint(const std::vector<Replay>& replays, const GridSettings& settings) {
  Fingerprint print;
  constexpr std::size_t kShort = 12;  // Digits, for people. Work.
  print["program"] = std::string(FLASH_VERSION) + ", sources " +
                     std::string(source_digest::motions().substr(0, kShort)) + " " +
                     std::string(source_digest::scores().substr(0, kShort));
  for (const Replay& replay : replays) add_replay(replay, print);
  add_material(settings.base, print);
  std::string order;
  for (const Axis& axis : settings.axes) {
    print["axis " + axis.name] = values_text(axis.values);
    order += (order.empty() ? "" : " ") + axis.name;
  }
  print["axes"] = order;
  for (const Axis& axis : settings.fixed) print["fixed " + axis.name] = values_text(axis.values);
  add_score(settings.score, print);
  return print;
}

std::string difference(const Fingerprint& was, const Fingerprint& is) {
  // Settings first: how a recording is cut into steps follows from them.
  std::set<std::pair<bool, std::string>> names;
  for (const auto* print : {&was, &is})
    for (const auto& [name, value] : *print) names.emplace(name.starts_with("recording "), name);
  const auto value_of = [](const Fingerprint& print, const std::string& name) {
    const auto found = print.find(name);
    return found == print.end() ? std::string("absent") : found->second;
  };
  std::string first;
  int more = 0;
  for (const auto& [of_recording, name] : names) {
    const std::string old_value = value_of(was, name), new_value = value_of(is, name);
    if (old_value == new_value) continue;
    if (first.empty())
      first = name + " was " + old_value + " and is " + new_value;
    else
      ++more;
  }
  return more == 0 ? first : first + ", and " + std::to_string(more) + " more";
}

std::optional<OtherSearch> other_search(const Fingerprint& search, const std::vector<std::string>& files) {
  for (const std::string& file : files) {
    const GridFile grid = load_grid_file(file);
    std::string changed = grid.fingerprint ? difference(*grid.fingerprint, search)
                                           : "it comes from another version of the program";
    if (!changed.empty()) return OtherSearch{file, std::move(changed)};
  }
  return std::nullopt;
}

}  // namespace flash::sysid
