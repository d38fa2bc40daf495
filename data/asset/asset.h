#pragma once
#include <optional>
#include <string>
#include <vector>

#include "data/asset/material.h"
#include "data/mesh/mesh.h"

namespace flash::data {

/// `published` carries no schema: young = E t [N/m] unless a thickness stands beside it, bending = w with D =
/// 3 w. `flash_1` is "flash-asset/1": young in Pa beside a thickness, bending_rigidity = D.
enum class AssetFormat { published, flash_1 };

enum class ElementType { triangle, tetrahedron };

/// A deformable object as its file says it, before the units are understood. Absent values are empty.
struct Asset {
  AssetFormat format = AssetFormat::flash_1;
  std::string source;  ///< file it came from, for messages
  std::string
      mesh;  ///< path already resolved against the asset file, or a mesh spec such as "sheet:0.4x0.4:0.01"
  ElementType element_type = ElementType::triangle;
  ElementOrder element_order = ElementOrder::linear;           ///< of tetrahedra
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();       ///< [m]
  Eigen::Vector3d rotation_degrees = Eigen::Vector3d::Zero();  ///< about fixed x, then y, then z [deg]

  Constitutive constitutive = Constitutive::tri_corotated;
  double young = 1e5;  ///< E [Pa] with a thickness, E t [N/m] without one
  double poisson = 0.3;
  std::optional<double> thickness;          ///< [m]
  std::optional<double> bending_rigidity;   ///< D [N m]; empty: the plate formula, or w
  Weave weave;                              ///< flash-asset/1 alone
  std::optional<double> yield_curvature;    ///< flash-asset/1 alone; absent: it does not yield [1/m]
  std::optional<double> published_bending;  ///< w of the published format [N m]
  std::optional<BendingModel> bending_model;
  std::optional<double> density;        ///< [kg/m^3]
  std::optional<double> areal_density;  ///< [kg/m^2]
  std::optional<double> mass;           ///< total, spread by area [kg]
  std::optional<double> object_mass;    ///< total, `obj_mass`, the published name [kg]
  double friction = 0.3;
  double air_drag = 0.0;           ///< [1/s]
  double stiffness_damping = 0.0;  ///< [s]
  std::string identification;      ///< raw JSON text of `identification` without `units`, empty when absent
};

/// Throws InputError on unknown fields (naming the nearest known one), on values out of range and on anything
/// missing.
Asset load_asset(const std::string& path);

/// Writes the asset in its own format; a mesh file is named relative to `path`.
void save_asset(const Asset& asset, const std::string& path);

/// The asset in the terms of another format, E t, total mass and w = D / 3 for the published one. What that
/// format cannot say is appended to `notices`. rest_area: of the sheet [m^2]; solids are taken over as they
/// are.
Asset express_as(const Asset& asset, AssetFormat format, double rest_area, std::vector<std::string>& notices);

/// What was understood, and the sentences that say so ("E t = 30 N/m (young without thickness)", ...).
struct ResolvedSheet {
  SheetMaterial material;
  double total_mass = 0.0;           ///< [kg]
  bool uniform_vertex_mass = false;  ///< obj_mass is spread evenly over vertices, not by area
  std::vector<std::string> notices;
};

/// rest_area: of the sheet [m^2]. D = E t^3 / (12 (1 - nu^2)) where a thickness is given and no bending.
/// Throws InputError for tetrahedra.
ResolvedSheet resolve_sheet(const Asset& asset, double rest_area);

/// A sheet asset in "flash-asset/1" carrying exactly `material` (thickness given: young = E t / t).
Asset asset_from_sheet(const SheetMaterial& material, std::optional<double> thickness,
                       const std::string& mesh);

/// What was understood of a solid, and the sentences that say so.
struct ResolvedSolid {
  SolidMaterial material;
  bool uniform_vertex_mass = false;  ///< obj_mass is spread evenly over vertices, not by volume
  std::vector<std::string> notices;
};

/// rest_volume: of the solid [m^3]. Throws InputError for triangles.
ResolvedSolid resolve_solid(const Asset& asset, double rest_volume);

const char* to_string(Constitutive constitutive);  ///< "TRI_COROTATED", ...
const char* to_string(BendingModel model);         ///< "plate", "isometric", "hinge"
Constitutive parse_constitutive(const std::string& name, const std::string& source, const std::string& field);
BendingModel parse_bending_model(const std::string& name, const std::string& source,
                                 const std::string& field);

}  // namespace flash::data
