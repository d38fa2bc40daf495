#include "data/asset/asset.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "data/asset/asset_units.h"
#include "data/asset/plate_rigidity.h"
#include "data/asset/questioned_numbers.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/mesh/procedural_mesh.h"

namespace flash::data {
namespace {

constexpr std::array kConstitutiveNames = {std::pair{Constitutive::tri_arap, "TRI_ARAP"},
                                           std::pair{Constitutive::tri_corotated, "TRI_COROTATED"},
                                           std::pair{Constitutive::tri_stvk, "TRI_STVK"},
                                           std::pair{Constitutive::tri_neohookean, "TRI_NEOHOOKEAN"},
                                           std::pair{Constitutive::tet_arap, "TET_ARAP"},
                                           std::pair{Constitutive::tet_corotated, "TET_COROTATED"},
                                           std::pair{Constitutive::tet_neohookean, "TET_NEOHOOKEAN"},
                                           std::pair{Constitutive::tet_neohookean_log, "TET_NEOHOOKEAN_LOG"}};

constexpr std::array kBendingModelNames = {std::pair{BendingModel::plate, "plate"},
                                           std::pair{BendingModel::isometric, "isometric"},
                                           std::pair{BendingModel::hinge, "hinge"}};

template <class Names, class Value>
const char* name_in(const Names& names, Value value) {
  for (const auto& [candidate, name] : names)
    if (candidate == value) return name;
  return "";
}

template <class Names>
auto value_in(const Names& names, const std::string& name, const std::string& source,
              const std::string& field) {
  std::string expected;
  for (const auto& [value, known] : names) {
    if (name == known) return value;
    expected += (expected.empty() ? "" : ", ") + std::string(known);
  }
  throw input_error(source, field, "found \"" + name + "\", expected one of " + expected);
}

bool is_solid(Constitutive constitutive) {
  return constitutive == Constitutive::tet_arap || constitutive == Constitutive::tet_corotated ||
         constitutive == Constitutive::tet_neohookean || constitutive == Constitutive::tet_neohookean_log;
}

void read_mass(const JsonObject& props, Asset& asset) {
  const std::array<std::pair<const char*, std::optional<double>*>, 4> masses = {
      {{"density", &asset.density},
       {"areal_density", &asset.areal_density},
       {"mass", &asset.mass},
       {"obj_mass", &asset.object_mass}}};
  std::string found;
  int count = 0;
  for (const auto& [key, value] : masses) {
    if (!props.has(key)) continue;
    *value = props.positive(key);
    found += (count++ == 0 ? "" : ", ") + std::string(key);
  }
  if (count != 1)
    throw input_error(asset.source, "mechanical_props",
                      "found " + (count == 0 ? "no mass" : found) +
                          ", expected exactly one of density, areal_density, mass, obj_mass");
}

void read_weave(const JsonObject& props, Asset& asset) {
  const bool bends = !asset.bending_model || *asset.bending_model == BendingModel::plate,
             stretches = asset.constitutive == Constitutive::tri_stvk;
  for (const char* key : {"bending_ratio", "twisting_ratio", "young_ratio", "shear_ratio", "warp_direction"})
    if (props.has(key) &&
        (asset.format == AssetFormat::published || asset.element_type != ElementType::triangle))
      throw props.error(key, "no such field but for sheets in \"schema\": \"flash-asset/1\"");
  for (const char* key : {"bending_ratio", "twisting_ratio"})
    if (props.has(key) && !bends) throw props.error(key, "bending_model plate, the only one that is woven");
  for (const char* key : {"young_ratio", "shear_ratio"})
    if (props.has(key) && !stretches)
      throw props.error(key, "constitutive TRI_STVK, the only one that is woven");
  if (props.has("warp_direction") && !bends && !stretches)
    throw props.error("warp_direction", "bending_model plate or constitutive TRI_STVK, which may be woven");
  const auto within = [&](const char* key, double low, double high) {
    const double ratio = props.positive(key, 1);
    if (ratio < low || ratio > high)
      throw props.error(key, "a number from " + format_short(low) + " to " + format_short(high));
    return ratio;
  };
  asset.weave.bending_ratio = within("bending_ratio", 0.01, 100);
  asset.weave.twisting_ratio = within("twisting_ratio", 1e-3, 100);
  asset.weave.young_ratio = within("young_ratio", 0.01, 100);
  asset.weave.shear_ratio = within("shear_ratio", 1e-3, 100);
  const double warp = props.number("warp_direction", 0);
  if (!(std::abs(warp) <= 360)) throw props.error("warp_direction", "an angle from -360 to 360 degrees");
  asset.weave.warp_direction = warp * std::numbers::pi / 180;
}

void read_yield(const JsonObject& props, Asset& asset) {
  if (!props.has("yield_curvature")) return;
  if (asset.format == AssetFormat::published || asset.element_type != ElementType::triangle)
    throw props.error("yield_curvature", "no such field but for sheets in \"schema\": \"flash-asset/1\"");
  if (asset.bending_model != BendingModel::hinge)
    throw props.error("yield_curvature", "\"bending_model\": \"hinge\", the only one that yields");
  asset.yield_curvature = props.positive("yield_curvature");
}

void read_properties(const JsonObject& props, Asset& asset) {
  const bool published = asset.format == AssetFormat::published;
  // The published coefficient is not D: under the wrong schema it would be off by a factor of 3 unnoticed.
  if (!published && props.has("bending"))
    throw props.error("bending", "bending_rigidity [N m] in flash-asset/1 (D = 3 bending)");
  if (published && props.has("bending_rigidity"))
    throw props.error("bending_rigidity", "bending, or \"schema\": \"flash-asset/1\"");
  props.expect_fields({"obj_mass", "mass", "density", "areal_density", "young", "poisson", "constitutive",
                       "thickness", published ? "bending" : "bending_rigidity", "bending_model",
                       "bending_ratio", "twisting_ratio", "young_ratio", "shear_ratio", "warp_direction",
                       "yield_curvature", "friction", "air_drag", "stiffness_damping"});
  asset.constitutive =
      parse_constitutive(props.string("constitutive"), asset.source, props.name_of("constitutive"));
  const bool solid = asset.element_type == ElementType::tetrahedron;
  if (solid != is_solid(asset.constitutive))
    throw props.error("constitutive",
                      solid ? "TET_... for element_type TETRAHEDRON" : "TRI_... for element_type TRIANGLE");
  const auto at_most = [&](const char* key, double value, double most) {
    if (value > most) throw props.error(key, "at most " + format_short(most));
    return value;
  };
  asset.young = at_most("young", props.positive("young"), 1e13);
  asset.poisson = props.number("poisson");
  if (!(asset.poisson > -1 && (asset.poisson < 0.5 || (!solid && asset.poisson == 0.5))))
    throw props.error("poisson", solid ? "above -1 and below 0.5" : "above -1 and at most 0.5");
  for (const char* key : {"thickness", "bending", "bending_rigidity", "bending_model"})
    if (solid && !published && props.has(key))
      throw props.error(key, "no such field for element_type TETRAHEDRON");
  // A published solid may have it, and does not use it.
  if (props.has("thickness"))
    asset.thickness = at_most("thickness", props.positive("thickness"), solid ? HUGE_VAL : 1);
  if (props.has("bending")) asset.published_bending = props.not_negative("bending");
  if (props.has("bending_rigidity"))
    asset.bending_rigidity = at_most("bending_rigidity", props.not_negative("bending_rigidity"), 1e6);
  if (props.has("bending_model"))
    asset.bending_model =
        parse_bending_model(props.string("bending_model"), asset.source, props.name_of("bending_model"));
  read_weave(props, asset);
  read_yield(props, asset);
  read_mass(props, asset);
  if (asset.density && !asset.thickness && !solid)
    throw props.error("thickness", "a thickness beside density, or areal_density");
  if (asset.areal_density && solid)
    throw props.error("areal_density", "density, mass or obj_mass for a solid");
  if (!published && !solid && !asset.thickness && !asset.bending_rigidity)
    throw props.error("bending_rigidity", "D [N m], or a thickness for the plate formula");
  asset.friction = at_most("friction", props.not_negative("friction", asset.friction), 1e3);
  asset.air_drag = at_most("air_drag", props.not_negative("air_drag", 0), 1e4);
  asset.stiffness_damping = at_most("stiffness_damping", props.not_negative("stiffness_damping", 0), 1e3);
}

ElementOrder read_element_order(const JsonObject& file, ElementType type) {
  const double order = file.number("element_order");
  if (type == ElementType::triangle && order != 1)
    throw file.error("element_order", "1, as 2 is for element_type TETRAHEDRON alone");
  if (order != 1 && order != 2) throw file.error("element_order", "1 or 2");
  return order == 2 ? ElementOrder::quadratic : ElementOrder::linear;
}

/// What a search says of the asset, as text; the units beside that are checked and belong to the file.
std::string read_identification(const JsonObject& identification, const Asset& asset) {
  nlohmann::json text = identification.value();
  if (asset.format == AssetFormat::published || !text.contains("units")) return text.dump();
  check_units(identification.object("units"), asset);
  text.erase("units");
  return text.empty() ? "" : text.dump();
}

nlohmann::ordered_json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

double areal_density_of(const Asset& asset, double rest_area) {
  if (asset.areal_density) return *asset.areal_density;
  if (asset.density) return *asset.density * asset.thickness.value_or(1);
  return (asset.mass ? *asset.mass : asset.object_mass.value_or(0)) / rest_area;
}

/// A number that follows from several fields, however the asset states it. Far from those of things, weight
/// and forces are beyond the digits of each other, or beyond all numbers.
double checked(const Asset& asset, const std::string& name, double value, double low, double high,
               const std::string& unit) {
  constexpr double rounding = 1e-12;
  if (value >= low * (1 - rounding) && value <= high * (1 + rounding)) return value;
  throw input_error(asset.source, "mechanical_props",
                    "found a " + name + " of " + format_number(value) + ", expected " + format_short(low) +
                        " to " + format_short(high) + ' ' + unit);
}

/// A woven sheet's numbers across its warp and between.
std::string weave_text(const SheetMaterial& m) {
  std::string text;
  if (m.weave.is_of_membrane()) {
    const double mean = std::sqrt(m.weave.young_ratio);
    text = "E_2 t = " + format_short(m.weave.young_ratio * m.membrane_stiffness) + " N/m, G t = " +
           format_short(m.weave.shear_ratio * mean * m.membrane_stiffness / (2 * (1 + m.poissons_ratio))) +
           " N/m, nu_12 = " + format_short(m.poissons_ratio / mean) + ", ";
  }
  return text + "D_2 = " + format_short(m.weave.bending_ratio * m.bending_rigidity) + " N m, warp at " +
         format_short(m.weave.warp_direction * 180 / std::numbers::pi) + " deg from the mesh's x axis";
}

}  // namespace

const char* to_string(Constitutive constitutive) { return name_in(kConstitutiveNames, constitutive); }
const char* to_string(BendingModel model) { return name_in(kBendingModelNames, model); }

Constitutive parse_constitutive(const std::string& name, const std::string& source,
                                const std::string& field) {
  return value_in(kConstitutiveNames, name, source, field);
}

BendingModel parse_bending_model(const std::string& name, const std::string& source,
                                 const std::string& field) {
  return value_in(kBendingModelNames, name, source, field);
}

Asset load_asset(const std::string& path) {
  const nlohmann::json json = load_json(path);
  const JsonObject file(json, path);
  Asset asset;
  asset.source = path;
  asset.format = file.has("schema") ? AssetFormat::flash_1 : AssetFormat::published;
  if (file.has("schema") && file.string("schema") != "flash-asset/1")
    throw file.error("schema", "\"flash-asset/1\", or no schema for the published format");
  if (asset.format == AssetFormat::published && file.has("element_order"))
    throw file.error("element_order", "no such field, or \"schema\": \"flash-asset/1\"");
  file.expect_fields({"schema", "name", "mesh", "element_type", "element_order", "transformation",
                      "mechanical_props", "identification"});

  const std::string mesh = file.string("mesh");
  asset.mesh = is_made_on_the_spot(mesh) ? mesh : resolve_path(mesh, path);
  const std::string element_type = file.string("element_type", "TRIANGLE");
  if (element_type != "TRIANGLE" && element_type != "TETRAHEDRON")
    throw file.error("element_type", "TRIANGLE or TETRAHEDRON");
  if (element_type == "TETRAHEDRON") asset.element_type = ElementType::tetrahedron;
  if (file.has("element_order")) asset.element_order = read_element_order(file, asset.element_type);
  if (file.has("transformation")) {
    const JsonObject transformation = file.object("transformation");
    transformation.expect_fields({"trans", "rotation"});
    asset.translation = transformation.vector3("trans", asset.translation);
    asset.rotation_degrees = transformation.vector3("rotation", asset.rotation_degrees);
  }
  read_properties(file.object("mechanical_props"), asset);
  if (file.has("identification"))
    asset.identification = read_identification(file.object("identification"), asset);
  return asset;
}

void save_asset(const Asset& asset, const std::string& path) {
  nlohmann::ordered_json file, props;
  const bool published = asset.format == AssetFormat::published;
  if (!published) file["schema"] = "flash-asset/1";
  file["mesh"] = is_made_on_the_spot(asset.mesh) ? asset.mesh : relative_path(asset.mesh, path);
  file["element_type"] = asset.element_type == ElementType::triangle ? "TRIANGLE" : "TETRAHEDRON";
  if (asset.element_order == ElementOrder::quadratic) file["element_order"] = 2;
  file["transformation"] = {{"trans", vector_json(asset.translation)},
                            {"rotation", vector_json(asset.rotation_degrees)}};
  const auto put = [&](const char* key, const std::optional<double>& value) {
    if (value) props[key] = *value;
  };
  put("obj_mass", asset.object_mass);
  put("mass", asset.mass);
  put("density", asset.density);
  put("areal_density", asset.areal_density);
  props["young"] = asset.young;
  props["poisson"] = asset.poisson;
  props["constitutive"] = to_string(asset.constitutive);
  put("thickness", asset.thickness);
  put(published ? "bending" : "bending_rigidity",
      published ? asset.published_bending : asset.bending_rigidity);
  if (!published) {
    if (asset.bending_model) props["bending_model"] = to_string(*asset.bending_model);
    const Weave& weave = asset.weave;
    if (weave.bending_ratio != 1) props["bending_ratio"] = weave.bending_ratio;
    if (weave.twisting_ratio != 1) props["twisting_ratio"] = weave.twisting_ratio;
    if (weave.young_ratio != 1) props["young_ratio"] = weave.young_ratio;
    if (weave.shear_ratio != 1) props["shear_ratio"] = weave.shear_ratio;
    if (weave.warp_direction != 0) props["warp_direction"] = weave.warp_direction * 180 / std::numbers::pi;
    if (asset.yield_curvature) props["yield_curvature"] = *asset.yield_curvature;
    props["friction"] = asset.friction;
    if (asset.air_drag != 0) props["air_drag"] = asset.air_drag;
    if (asset.stiffness_damping != 0) props["stiffness_damping"] = asset.stiffness_damping;
  }
  file["mechanical_props"] = props;
  if (!published) {
    nlohmann::ordered_json& identification = file["identification"];
    if (!asset.identification.empty()) identification = nlohmann::ordered_json::parse(asset.identification);
    nlohmann::ordered_json numbers = props;
    numbers.update(file["transformation"]);
    if (identification.contains("estimate") && identification["estimate"].is_object())
      numbers.update(identification["estimate"]);
    identification["units"] = units_of(numbers, asset);
  }
  write_atomically(path, format_json(file));
}

ResolvedSheet resolve_sheet(const Asset& asset, double rest_area) {
  if (asset.element_type != ElementType::triangle)
    throw input_error(asset.source, "element_type", "found TETRAHEDRON, expected TRIANGLE: a sheet");
  ResolvedSheet sheet;
  SheetMaterial& m = sheet.material;
  m.constitutive = asset.constitutive;
  m.poissons_ratio = asset.poisson;
  m.membrane_stiffness = asset.young * asset.thickness.value_or(1);
  m.areal_density =
      checked(asset, "mass", areal_density_of(asset, rest_area), 1e-9, 1e4, "kg/m^2, as sheets have");
  m.friction = asset.friction;
  m.air_drag = asset.air_drag;
  m.stiffness_damping = asset.stiffness_damping;
  m.weave = asset.weave;
  if (asset.yield_curvature) m.yield_curvature = *asset.yield_curvature;
  sheet.total_mass = m.areal_density * rest_area;
  sheet.uniform_vertex_mass = asset.object_mass.has_value();

  std::string origin_of_bending = "bending_rigidity";
  if (asset.bending_rigidity) {
    m.bending_rigidity = *asset.bending_rigidity;
  } else if (asset.published_bending) {
    m.bending_rigidity = 3 * *asset.published_bending;
    m.bending_model = BendingModel::isometric;
    origin_of_bending =
        "3 x bending " + format_short(*asset.published_bending) + ", as the published coefficient means it";
  } else if (asset.thickness) {
    m.bending_rigidity = plate_rigidity(asset.young, asset.poisson, *asset.thickness);
    origin_of_bending = "plate formula E t^3 / (12 (1 - nu^2))";
  } else {
    m.bending_rigidity = 0;
    origin_of_bending = "no bending in the file";
  }
  checked(asset, "bending rigidity", m.bending_rigidity, 0, 1e6, "N m");
  if (asset.bending_model) m.bending_model = *asset.bending_model;

  const std::string source = asset.source.empty() ? "asset" : asset.source;
  sheet.notices.push_back(source + ": E t = " + format_short(m.membrane_stiffness) + " N/m (" +
                          (asset.thickness ? "young " + format_short(asset.young) + " Pa x thickness " +
                                                 format_short(*asset.thickness) + " m"
                                           : "young without a thickness") +
                          "), nu = " + format_short(m.poissons_ratio));
  sheet.notices.push_back(source + ": D = " + format_short(m.bending_rigidity) + " N m (" +
                          origin_of_bending + "), bending_model " + to_string(m.bending_model));
  if (m.weave != Weave{}) sheet.notices.push_back(source + ": woven: " + weave_text(m));
  if (asset.yield_curvature)
    sheet.notices.push_back(source + ": bending yields at " + format_short(m.yield_curvature) +
                            " 1/m, at a moment of " + format_short(m.bending_rigidity * m.yield_curvature) +
                            " N");
  sheet.notices.push_back(source + ": mass = " + format_short(sheet.total_mass) + " kg, " +
                          format_short(m.areal_density) + " kg/m^2" +
                          (asset.object_mass ? " (obj_mass, the total, spread evenly over vertices)" : ""));
  if (const std::string text = questioned(asset, m); !text.empty()) sheet.notices.push_back(text);
  return sheet;
}

ResolvedSolid resolve_solid(const Asset& asset, double rest_volume) {
  if (asset.element_type != ElementType::tetrahedron)
    throw input_error(asset.source, "element_type", "found TRIANGLE, expected TETRAHEDRON: a solid");
  ResolvedSolid solid;
  SolidMaterial& m = solid.material;
  m.constitutive = asset.constitutive;
  m.youngs_modulus = asset.young;
  m.poissons_ratio = asset.poisson;
  const double density = asset.density
                             ? *asset.density
                             : (asset.mass ? *asset.mass : asset.object_mass.value_or(0)) / rest_volume;
  m.density = checked(asset, "mass", density, 1e-6, 1e6, "kg/m^3, as solids have");
  m.friction = asset.friction;
  m.air_drag = asset.air_drag;
  m.stiffness_damping = asset.stiffness_damping;
  solid.uniform_vertex_mass = asset.object_mass.has_value();
  solid.notices.push_back(asset.source + ": E = " + format_short(m.youngs_modulus) + " Pa, nu = " +
                          format_short(m.poissons_ratio) + ", density = " + format_short(m.density) +
                          " kg/m^3, mass = " + format_short(m.density * rest_volume) + " kg" +
                          (asset.object_mass ? " (obj_mass, the total, spread evenly over vertices)" : ""));
  std::string unused;
  const auto name_unused = [&](bool given, const char* name) {
    if (given) unused += (unused.empty() ? "" : ", ") + std::string(name);
  };
  name_unused(asset.thickness.has_value(), "thickness");
  name_unused(asset.bending_rigidity.has_value(), "bending_rigidity");
  name_unused(asset.published_bending.has_value(), "bending");
  name_unused(asset.bending_model.has_value(), "bending_model");
  if (!unused.empty())
    solid.notices.push_back(asset.source + ": " + unused + ": of sheets alone, not used for a solid");
  if (const std::string text = questioned(asset, m); !text.empty()) solid.notices.push_back(text);
  return solid;
}

Asset express_as(const Asset& asset, AssetFormat format, double rest_area,
                 std::vector<std::string>& notices) {
  Asset result = asset;
  result.format = format;
  if (asset.format == format) return result;
  if (format == AssetFormat::flash_1) {
    if (asset.element_type == ElementType::triangle) {
      const SheetMaterial material = resolve_sheet(asset, rest_area).material;
      result.bending_rigidity = material.bending_rigidity;
      result.bending_model = material.bending_model;
    }
    result.published_bending.reset();
    return result;
  }
  const auto lose = [&](const std::string& what) {
    notices.push_back("the published format cannot express " + what);
  };
  if (asset.element_type == ElementType::triangle) {
    const ResolvedSheet sheet = resolve_sheet(asset, rest_area);
    result.young = sheet.material.membrane_stiffness;
    result.published_bending = sheet.material.bending_rigidity / 3;
    result.object_mass = sheet.total_mass;
    if (asset.thickness) lose("thickness " + format_short(*asset.thickness) + " m: young is E t [N/m]");
    if (sheet.material.bending_model != BendingModel::isometric)
      lose(std::string("bending_model ") + to_string(sheet.material.bending_model) +
           ": bending is D / 3, which its isometric model bends as D only on suitable meshes");
    result.thickness.reset();
    result.mass.reset();
    result.density.reset();
    result.areal_density.reset();
    result.bending_rigidity.reset();
    result.bending_model.reset();
    if (asset.weave != Weave{})
      lose(
          "bending_ratio, twisting_ratio, young_ratio, shear_ratio and warp_direction: its sheets are "
          "isotropic");
    result.weave = {};
    if (asset.yield_curvature) lose("yield_curvature: bending does not yield");
    result.yield_curvature.reset();
    if (!sheet.uniform_vertex_mass) lose("mass by area: obj_mass is spread evenly over vertices");
  }
  if (asset.element_order == ElementOrder::quadratic) lose("element_order 2: its tetrahedra are linear");
  result.element_order = ElementOrder::linear;
  lose("friction " + format_short(asset.friction));
  if (asset.air_drag != 0) lose("air_drag " + format_short(asset.air_drag));
  if (asset.stiffness_damping != 0) lose("stiffness_damping " + format_short(asset.stiffness_damping));
  if (!asset.identification.empty()) lose("identification: intervals and randomization ranges");
  return result;
}

Asset asset_from_sheet(const SheetMaterial& material, std::optional<double> thickness,
                       const std::string& mesh) {
  Asset asset;
  asset.mesh = mesh;
  asset.constitutive = material.constitutive;
  asset.young = material.membrane_stiffness / thickness.value_or(1);
  asset.poisson = material.poissons_ratio;
  asset.thickness = thickness;
  asset.bending_rigidity = material.bending_rigidity;
  asset.bending_model = material.bending_model;
  asset.weave = material.weave;
  if (std::isfinite(material.yield_curvature)) asset.yield_curvature = material.yield_curvature;
  asset.areal_density = material.areal_density;
  asset.friction = material.friction;
  asset.air_drag = material.air_drag;
  asset.stiffness_damping = material.stiffness_damping;
  return asset;
}

}  // namespace flash::data
