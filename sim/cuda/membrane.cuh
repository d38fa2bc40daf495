#pragma once
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/four.h"
#include "sim/cuda/sheet_tables.h"
#include "sim/law/membrane_response.h"

namespace flash::sim::cuda {

// The membrane in double precision, by the formulas of sim/law/membrane_response.h.

using Triple = Vector3<double>;

__device__ inline Triple triple(const Point& p) { return {p.x, p.y, p.z}; }

struct TriangleFrame {
  SingularFrame<double> frame;
  double w10, w11, w20, w21, area;
};

/// place(vertex): where it is.
template <typename Places>
__device__ TriangleFrame triangle_frame(const SheetTables& tables, int t, const Places& place) {
  const int count = tables.triangle_count;
  const Triple x0 = place(tables.triangle_vertices[t]);
  const Triple e1 = place(tables.triangle_vertices[count + t]) - x0,
               e2 = place(tables.triangle_vertices[2 * count + t]) - x0;
  TriangleFrame f;
  f.w10 = tables.gradients[t];
  f.w11 = tables.gradients[count + t];
  f.w20 = tables.gradients[2 * count + t];
  f.w21 = tables.gradients[3 * count + t];
  f.area = tables.areas[t];
  f.frame = singular_frame(f.w10 * e1 + f.w20 * e2, f.w11 * e1 + f.w21 * e2);
  return f;
}

__device__ inline PrincipalResponse<double> response_at(const EnvironmentNumbers& environment, double s1,
                                                        double s2) {
  switch (environment.law) {
    case MembraneLaw::saint_venant_kirchhoff:
      return SaintVenantKirchhoff::at(s1, s2, environment.lame.mu, environment.lame.lambda);
    case MembraneLaw::neo_hookean:
      return NeoHookean::at(s1, s2, environment.lame.mu, environment.lame.lambda);
    case MembraneLaw::corotated:
      break;
  }
  return Corotated::at(s1, s2, environment.lame.mu, environment.lame.lambda);
}

}  // namespace flash::sim::cuda
