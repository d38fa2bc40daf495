#include "sysid/emulate/material_base.h"

#include <optional>

#include "data/asset/material.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "sim/scene/sheet.h"

namespace flash::sysid {
namespace {

/// As though the asset itself held the constants.
data::Asset with_fixed(data::Asset asset, const std::vector<Axis>& fixed) {
  for (const Axis& axis : fixed) {
    const double value = axis.values.front();
    if (axis.name == "young") asset.young = value;
    if (axis.name == "poisson") asset.poisson = value;
    if (axis.name == "bending") {
      asset.bending_rigidity = value;
      if (asset.published_bending.has_value() && !asset.bending_model)
        asset.bending_model = data::BendingModel::isometric;
      asset.published_bending.reset();
    }
    if (axis.name == "areal_density" && asset.element_type == data::ElementType::triangle) {
      asset.areal_density = value;
      for (std::optional<double>* other : {&asset.density, &asset.mass, &asset.object_mass}) other->reset();
    }
    if (axis.name == "density" && asset.element_type == data::ElementType::tetrahedron) {
      asset.density = value;
      for (std::optional<double>* other : {&asset.mass, &asset.object_mass}) other->reset();
    }
    for (const char* name : {"young", "poisson", "bending", "areal_density", "density"})
      if (axis.name == name) asset.source += " --hold " + axis.name + "=" + data::format_short(value);
  }
  return asset;
}

}  // namespace

void check_kind(const data::Asset& asset, const data::Recording& recording) {
  const bool solid = asset.element_type == data::ElementType::tetrahedron;
  if (solid == recording.is_solid()) return;
  throw data::input_error(asset.source, "element_type",
                          std::string("found ") + (solid ? "TETRAHEDRON" : "TRIANGLE") + ", expected " +
                              (solid ? "TRIANGLE" : "TETRAHEDRON") + ", as object.mesh of " +
                              recording.source + " is a " + (solid ? "sheet" : "solid"));
}

MaterialBase material_base(const data::Asset& asset, const sim::Sheet& sheet,
                           std::vector<std::string>& notices, const std::vector<Axis>& fixed) {
  MaterialBase base;
  std::vector<std::string> said;
  if (asset.element_type == data::ElementType::tetrahedron) {
    const double volume = sheet.vertex_volume.sum();
    base.solid = data::resolve_solid(asset, volume).material;
    said = data::resolve_solid(with_fixed(asset, fixed), volume).notices;
  } else {
    const double area = sheet.vertex_area.sum();
    base.material = data::resolve_sheet(asset, area).material;
    base.thickness = asset.thickness;
    base.bending_from_thickness = asset.thickness && !asset.bending_rigidity && !asset.published_bending;
    said = data::resolve_sheet(with_fixed(asset, fixed), area).notices;
  }
  notices.insert(notices.end(), said.begin(), said.end());
  return base;
}

}  // namespace flash::sysid
