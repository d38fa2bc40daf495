#pragma once
#include "sim/cuda/contact.cuh"
#include "sim/cuda/projective_work.cuh"

namespace flash::sim::cuda {

// Contacts of an iterate of the projective method, as sim/oracle/projective_contact.h has them.

/// The contacts of vertices with the obstacles of a step, in memory.
class VertexContacts {
 public:
  const int obstacles;           ///< of the environment
  Four<float>* const reactions;  ///< of all obstacles on a vertex [N]

  __device__ VertexContacts(const ProjectiveMemory& m, int vertices, int obstacle_count)
      : obstacles(obstacle_count),
        reactions(kept_whole(m.reactions)),
        size_(vertices),
        touching_(kept_whole(m.touching)),
        surfaces_(kept_whole(m.surfaces)),
        forces_(kept_whole(m.contact_forces)),
        slips_(kept_whole(m.slips)) {}
  __device__ int& touching(int obstacle, int i) const { return touching_[obstacle * size_ + i]; }
  /// The normal and the distance.
  __device__ Four<float>& surface(int obstacle, int i) const { return surfaces_[obstacle * size_ + i]; }
  /// How far the vertex has slipped along the tangents since the start of the step [m].
  __device__ float2& slip(int obstacle, int i) const { return slips_[obstacle * size_ + i]; }
  /// Of the contact on the vertex [N].
  __device__ Four<float>& force(int obstacle, int i) const { return forces_[obstacle * size_ + i]; }

 private:
  int size_;
  int* touching_;
  Four<float>*surfaces_, *forces_;
  float2* slips_;
};

/// Normal and tangents of a contact.
template <typename Real>
struct ContactDirections {
  Vector3<Real> rows[3];

  /// The tangents turned by an angle from those of Eigen's unitOrthogonal.
  __device__ ContactDirections(const Vector3<Real>& normal, double angle) {
    constexpr Real least = sizeof(Real) == sizeof(float) ? Real(1e-5) : Real(1e-12);
    Vector3<Real> first;
    if (std::fabs(normal.x) > least * std::fabs(normal.z) ||
        std::fabs(normal.y) > least * std::fabs(normal.z)) {
      const Real inverse = 1 / std::sqrt(normal.x * normal.x + normal.y * normal.y);
      first = {-normal.y * inverse, normal.x * inverse, 0};
    } else {
      const Real inverse = 1 / std::sqrt(normal.y * normal.y + normal.z * normal.z);
      first = {0, -normal.z * inverse, normal.y * inverse};
    }
    const Vector3<Real> second = cross(normal, first);
    rows[0] = normal;
    rows[1] = first;
    rows[2] = second;
    if (angle == 0) return;
    const Real c = static_cast<Real>(cos(angle)), s = static_cast<Real>(sin(angle));
    rows[1] = c * first + s * second;
    rows[2] = c * second - s * first;
  }
  __device__ Vector3<Real> along(const Vector3<Real>& v) const {
    return {dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)};
  }
  __device__ Vector3<Real> force(const Vector3<Real>& multiplier) const {
    return multiplier.x * rows[0] + multiplier.y * rows[1] + multiplier.z * rows[2];
  }
};

/// What find_contacts has seen.
struct FoundContacts {
  bool any, lost;  ///< contacts; contacts of the last iterate that had a force and are none any more
};

/// The contacts at the iterate that the free motion may reach, which a solve has given. Those that are none
/// any more lose their force.
template <Keeping keeping>
__device__ __noinline__ FoundContacts find_contacts(const ProjectiveWork<keeping>& w, const StepProblem& step,
                                                    float back) {
  constexpr float margin = 1e-6f;
  const VertexContacts contacts(w.memory, step.size, step.obstacles.count);
  const VertexPlaces<keeping> places = w.places;
  const SolvedWay<keeping> way(w, back);
  const double tangent_angle = w.numbers.multipliers.tangent_angle;
  FoundContacts found = {};
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const SolveVertex vertex = way.vertices[i];
    if (vertex.scale == 0) continue;
    const float reach = 2 * norm(way(vertex)) + margin;
    const Triple point = places.place(i);
    for (int k = 0; k < contacts.obstacles; ++k) {
      const SurfaceGap<double> gap = gap_to(step.obstacles.obstacles[k], point);
      const bool touches = gap.distance < reach;
      contacts.touching(k, i) = touches ? 1 : 0;
      if (!touches) {
        Four<float>& force = contacts.force(k, i);
        if (force.x == 0 && force.y == 0 && force.z == 0) continue;
        found.lost = true;
        force = {0, 0, 0, 0};
        continue;
      }
      found.any = true;
      const Vector3<float> normal = single(gap.normal);
      const Vector3<float> moved = ContactDirections<float>(normal, tangent_angle)
                                       .along(single(point - triple(step.start[i]) - gap.surface_moved));
      contacts.surface(k, i) = {normal.x, normal.y, normal.z, static_cast<float>(gap.distance)};
      contacts.slip(k, i) = {moved.y, moved.z};
    }
  }
  return found;
}

/// Sets the reaction on a vertex to the forces of its contacts.
__device__ inline void set_reaction(const VertexContacts& contacts, int i) {
  Vector3<float> sum = {0, 0, 0};
  for (int k = 0; k < contacts.obstacles; ++k)
    if (contacts.touching(k, i) != 0) sum = sum + vector_of(contacts.force(k, i));
  contacts.reactions[i] = {sum.x, sum.y, sum.z, 0};
}

/// The same of the thread's vertices, but for those that are held.
template <Keeping keeping>
__device__ void set_reactions(const ProjectiveWork<keeping>& w, const StepProblem& step) {
  const VertexContacts contacts(w.memory, step.size, step.obstacles.count);
  for (int i = team_rank(); i < step.size; i += team_size())
    if (w.vertices[i].scale != 0) set_reaction(contacts, i);
}

}  // namespace flash::sim::cuda
