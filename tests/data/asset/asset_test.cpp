#include "data/asset/asset.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "data/asset/asset_mesh.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

using nlohmann::json;

const char* const kPublished = R"({"mesh": "sheet:0.5x0.4:0.1", "element_type": "TRIANGLE",
  "transformation": {"trans": [0, 1, 0], "rotation": [90, 0, 0]},
  "mechanical_props": {"obj_mass": 1000, "young": 3E+4, "poisson": 0.4, "constitutive": "TRI_ARAP", "bending": 0.2}})";

const char* const kFlash = R"({"schema": "flash-asset/1", "mesh": "sheet:0.5x0.4:0.1",
  "mechanical_props": {"areal_density": 0.2, "young": 3e4, "poisson": 0.25, "constitutive": "TRI_COROTATED",
  "thickness": 1e-3, "friction": 0.4, "air_drag": 0.1, "stiffness_damping": 0.001},
  "identification": {"score_m": 0.005, "recordings": [{"name": "lift", "sha256": "00"}]}})";

TEST(Asset, PublishedUnitsAreMembraneStiffnessTotalMassAndAThirdOfD) {
  const TemporaryFolder folder;
  const Asset asset = load_asset(folder.write("cloth.json", kPublished));
  EXPECT_EQ(asset.format, AssetFormat::published);
  const ResolvedSheet sheet = resolve_sheet(asset, 0.2);
  EXPECT_DOUBLE_EQ(sheet.material.membrane_stiffness, 3e4);
  EXPECT_DOUBLE_EQ(sheet.material.poissons_ratio, 0.4);
  EXPECT_DOUBLE_EQ(sheet.material.bending_rigidity, 0.6);
  EXPECT_EQ(sheet.material.bending_model, BendingModel::isometric);
  EXPECT_EQ(sheet.material.constitutive, Constitutive::tri_arap);
  EXPECT_DOUBLE_EQ(sheet.material.areal_density, 5000);
  EXPECT_DOUBLE_EQ(sheet.total_mass, 1000);
  EXPECT_TRUE(sheet.uniform_vertex_mass);
  const std::string said = sheet.notices[0] + '\n' + sheet.notices[1] + '\n' + sheet.notices[2];
  EXPECT_NE(said.find("E t = 3e+04 N/m (young without a thickness)"), std::string::npos) << said;
  EXPECT_NE(said.find("D = 0.6 N m (3 x bending 0.2"), std::string::npos) << said;
  EXPECT_NE(said.find("mass = 1000 kg"), std::string::npos) << said;
}

TEST(Asset, TransformationTurnsAboutFixedAxesThenMoves) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = load_asset_mesh(load_asset(folder.write("cloth.json", kPublished)));
  // The far corner (0.5, 0.4, 0): turned by 90 degrees about x, y becomes z.
  EXPECT_TRUE(mesh.vertices.row(mesh.vertices.rows() - 1).isApprox(Eigen::RowVector3d(0.5, 1, 0.4), 1e-15));
  // x first, then y: (0, 1, 0) -> (0, 0, 1) -> (1, 0, 0).
  EXPECT_TRUE((rotation_from_degrees({90, 90, 0}) * Eigen::Vector3d::UnitY())
                  .isApprox(Eigen::Vector3d::UnitX(), 1e-15));
}

TEST(Asset, ThicknessGivesThePlateFormula) {
  const TemporaryFolder folder;
  const ResolvedSheet sheet = resolve_sheet(load_asset(folder.write("towel.json", kFlash)), 0.2);
  EXPECT_DOUBLE_EQ(sheet.material.membrane_stiffness, 30);
  EXPECT_NEAR(sheet.material.bending_rigidity, 3e4 * 1e-9 / (12 * (1 - 0.0625)), 1e-20);
  EXPECT_EQ(sheet.material.bending_model, BendingModel::plate);
  EXPECT_DOUBLE_EQ(sheet.material.areal_density, 0.2);
  EXPECT_FALSE(sheet.uniform_vertex_mass);
  EXPECT_DOUBLE_EQ(sheet.material.friction, 0.4);
  EXPECT_DOUBLE_EQ(sheet.material.air_drag, 0.1);
  EXPECT_DOUBLE_EQ(sheet.material.stiffness_damping, 0.001);
}

TEST(Asset, EveryMassMeansTheSameSheet) {
  const TemporaryFolder folder;
  for (const auto& [key, value] :
       {std::pair{"areal_density", 0.2}, {"density", 200.0}, {"mass", 0.04}, {"obj_mass", 0.04}}) {
    json file = json::parse(kFlash);
    file["mechanical_props"].erase("areal_density");
    file["mechanical_props"][key] = value;
    const ResolvedSheet sheet = resolve_sheet(load_asset(folder.write("towel.json", file.dump())), 0.2);
    EXPECT_NEAR(sheet.material.areal_density, 0.2, 1e-15) << key;
    EXPECT_NEAR(sheet.total_mass, 0.04, 1e-15) << key;
  }
}

TEST(Asset, SurvivesSaveAndLoad) {
  const TemporaryFolder folder;
  const Asset written = load_asset(folder.write("towel.json", kFlash));
  save_asset(written, folder / "copy/towel.json");
  const Asset read = load_asset(folder / "copy/towel.json");
  EXPECT_EQ(read.mesh, written.mesh);
  EXPECT_EQ(read.young, written.young);
  EXPECT_EQ(read.poisson, written.poisson);
  EXPECT_EQ(read.thickness, written.thickness);
  EXPECT_EQ(read.areal_density, written.areal_density);
  EXPECT_EQ(read.friction, written.friction);
  EXPECT_EQ(json::parse(read.identification), json::parse(written.identification));
}

TEST(Asset, MeshFilesStayReachableFromElsewhere) {
  const TemporaryFolder folder;
  json file = json::parse(kFlash);
  file["mesh"] = "meshes/towel.obj";
  const Asset asset = load_asset(folder.write("a/towel.json", file.dump()));
  EXPECT_EQ(asset.mesh, folder / "a/meshes/towel.obj");
  save_asset(asset, folder / "b/c/towel.json");
  EXPECT_EQ(load_asset(folder / "b/c/towel.json").mesh, asset.mesh);
}

TEST(Asset, PublishedExportKeepsTheMotionAndSaysWhatIsLost) {
  const TemporaryFolder folder;
  const Asset asset = load_asset(folder.write("towel.json", kFlash));
  std::vector<std::string> notices;
  const Asset published = express_as(asset, AssetFormat::published, 0.2, notices);
  save_asset(published, folder / "published.json");
  const ResolvedSheet a = resolve_sheet(asset, 0.2),
                      b = resolve_sheet(load_asset(folder / "published.json"), 0.2);
  EXPECT_DOUBLE_EQ(b.material.membrane_stiffness, a.material.membrane_stiffness);
  EXPECT_DOUBLE_EQ(b.material.bending_rigidity, a.material.bending_rigidity);
  EXPECT_DOUBLE_EQ(b.total_mass, a.total_mass);
  std::string said;
  for (const std::string& notice : notices) said += notice + '\n';
  for (const char* lost : {"thickness 0.001 m", "friction 0.4", "air_drag", "stiffness_damping",
                           "identification", "bending_model plate"})
    EXPECT_NE(said.find(lost), std::string::npos) << lost << " in\n" << said;

  std::ifstream stream(folder / "published.json");
  const json file = json::parse(stream);
  EXPECT_FALSE(file.contains("schema"));
  EXPECT_DOUBLE_EQ(file["mechanical_props"]["young"], 30);
  EXPECT_DOUBLE_EQ(file["mechanical_props"]["obj_mass"], 0.04);
}

TEST(Asset, PublishedBecomesFlashWithItsRigidity) {
  const TemporaryFolder folder;
  std::vector<std::string> notices;
  const Asset flash =
      express_as(load_asset(folder.write("cloth.json", kPublished)), AssetFormat::flash_1, 0.2, notices);
  save_asset(flash, folder / "flash.json");
  const ResolvedSheet sheet = resolve_sheet(load_asset(folder / "flash.json"), 0.2);
  EXPECT_DOUBLE_EQ(sheet.material.bending_rigidity, 0.6);
  EXPECT_DOUBLE_EQ(sheet.material.membrane_stiffness, 3e4);
  EXPECT_EQ(sheet.material.bending_model, BendingModel::isometric);
  EXPECT_TRUE(notices.empty());
}

TEST(Asset, MaterialsSurviveTheAsset) {
  const TemporaryFolder folder;
  SheetMaterial material;
  material.membrane_stiffness = 55;
  material.bending_rigidity = 2e-5;
  material.friction = 0.7;
  for (const std::optional<double> thickness : {std::optional<double>(), std::optional<double>(2e-3)}) {
    save_asset(asset_from_sheet(material, thickness, "sheet:0.4x0.4:0.1"), folder / "a.json");
    const SheetMaterial read = resolve_sheet(load_asset(folder / "a.json"), 0.16).material;
    EXPECT_DOUBLE_EQ(read.membrane_stiffness, 55);
    EXPECT_DOUBLE_EQ(read.bending_rigidity, 2e-5);
    EXPECT_DOUBLE_EQ(read.areal_density, material.areal_density);
    EXPECT_DOUBLE_EQ(read.friction, 0.7);
    EXPECT_EQ(read.bending_model, BendingModel::plate);
  }
}

TEST(Asset, SolidsHaveADensity) {
  const TemporaryFolder folder;
  const std::string path = folder.write("part.json", R"({"mesh": "part.vtk", "element_type": "TETRAHEDRON",
    "mechanical_props": {"obj_mass": 2, "young": 2e5, "poisson": 0.45, "constitutive": "TET_NEOHOOKEAN"}})");
  EXPECT_DOUBLE_EQ(resolve_solid(load_asset(path), 0.002).material.density, 1000);
  EXPECT_NE(
      input_error_of([&] { resolve_sheet(load_asset(path), 1); }).find("element_type: found TETRAHEDRON"),
      std::string::npos);
}

TEST(Asset, SolidsLoadTheirTetrahedraMovedAsTheAssetSays) {
  const TemporaryFolder folder;
  const TetMesh mesh = tet_box({0.3, 0.2, 0.1}, {1, 1, 1});
  save_tet_mesh(mesh, folder / "part.tet");
  const auto asset = [&](const std::string& file) {
    return load_asset(folder.write("part.json", R"({"schema": "flash-asset/1", "mesh": ")" + file +
                                                    R"(", "element_type": "TETRAHEDRON",
    "transformation": {"trans": [1, 2, 3], "rotation": [0, 0, 90]},
    "mechanical_props": {"density": 900, "young": 2e5, "poisson": 0.45, "constitutive": "TET_NEOHOOKEAN_LOG",
                         "friction": 0.7, "stiffness_damping": 0.01}})"));
  };
  const TetMesh moved = load_asset_tet_mesh(asset("part.tet"));
  EXPECT_EQ(moved.tetrahedra, mesh.tetrahedra);
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    const Eigen::RowVector3d x = mesh.vertices.row(i);
    EXPECT_LT((moved.vertices.row(i) - Eigen::RowVector3d(1 - x.y(), 2 + x.x(), 3 + x.z())).norm(), 1e-15);
  }
  const SolidMaterial material = resolve_solid(asset("part.tet"), 0.006).material;
  EXPECT_EQ(material, (SolidMaterial{Constitutive::tet_neohookean_log, 2e5, 0.45, 900, 0.7, 0, 0.01}));
  EXPECT_NE(
      input_error_of([&] { load_rest_mesh(asset("part.tet")); }).find("found TETRAHEDRON, expected TRIANGLE"),
      std::string::npos);
  EXPECT_NE(input_error_of([&] { load_asset_tet_mesh(asset("sheet:0.1x0.1:0.01")); })
                .find("mesh: found \"sheet:0.1x0.1:0.01\", expected box:... or a .vtk, .tet or .msh file of "
                      "tetrahedra"),
            std::string::npos);
  EXPECT_NE(
      input_error_of([&] { load_asset_tet_mesh(asset("box:1x1:0.1")); }).find("expected box:WIDTHxDEPTH"),
      std::string::npos);
  const Asset box = asset("box:0.3x0.2x0.1:0.1");
  EXPECT_EQ(load_asset_tet_mesh(box).tetrahedra, tet_box({0.3, 0.2, 0.1}, {3, 2, 1}).tetrahedra);
  save_asset(box, folder / "copy.json");
  EXPECT_EQ(load_asset(folder / "copy.json").mesh, "box:0.3x0.2x0.1:0.1");
}

TEST(Asset, SheetsMayBeWoven) {
  const TemporaryFolder folder;
  const auto load = [&](const char* text, const json& changes) {
    json file = json::parse(text);
    file["mechanical_props"].update(changes);
    return load_asset(folder.write("towel.json", file.dump()));
  };
  const Asset woven = load(kFlash, {{"bending_ratio", 3}, {"twisting_ratio", 0.8}, {"warp_direction", 90}});
  const SheetMaterial material = resolve_sheet(woven, 0.1).material;
  EXPECT_EQ(material.weave.bending_ratio, 3);
  EXPECT_EQ(material.weave.twisting_ratio, 0.8);
  EXPECT_NEAR(material.weave.warp_direction, std::acos(0.0), 1e-15);
  save_asset(woven, folder / "copy.json");
  EXPECT_EQ(load_asset(folder / "copy.json").weave, woven.weave);
  EXPECT_EQ(asset_from_sheet(material, {}, "sheet:1x1:1").weave, material.weave);
  std::vector<std::string> notices;
  EXPECT_EQ(express_as(woven, AssetFormat::published, 0.1, notices).weave, Weave{});
  EXPECT_TRUE(std::any_of(notices.begin(), notices.end(), [](const std::string& notice) {
    return notice.find("bending_ratio, twisting_ratio, young_ratio, shear_ratio and warp_direction") !=
           std::string::npos;
  }));
  const auto error = [&](const char* text, const json& changes) {
    return input_error_of([&] { load(text, changes); });
  };
  EXPECT_NE(error(kFlash, {{"bending_ratio", 0}}).find("bending_ratio: found 0, expected a number above 0"),
            std::string::npos);
  EXPECT_NE(
      error(kFlash, {{"bending_ratio", 2}, {"bending_model", "hinge"}}).find("expected bending_model plate"),
      std::string::npos);
  for (const char* key : {"bending_ratio", "twisting_ratio"})
    for (const double ratio : {1e308, 1e-300, 101.0})
      EXPECT_NE(error(kFlash, {{key, ratio}}).find(", expected a number from 0.0"), std::string::npos)
          << ratio;
  EXPECT_NE(
      error(kFlash, {{"warp_direction", 1e308}})
          .find("towel.json: mechanical_props.warp_direction: found 1e+308, expected an angle from -360"),
      std::string::npos);
  EXPECT_EQ(error(kFlash, {{"warp_direction", -360}, {"bending_ratio", 100}, {"twisting_ratio", 0.001}}), "");
  EXPECT_NE(error(kPublished, {{"warp_direction", 10}}).find("flash-asset/1"), std::string::npos);
}

TEST(Asset, WhatNoMaterialHasIsRefused) {
  const TemporaryFolder folder;
  const auto error = [&](const json& changes) {
    json file = json::parse(kFlash);
    file["mechanical_props"].update(changes);
    return input_error_of([&] { load_asset(folder.write("towel.json", file.dump())); });
  };
  EXPECT_NE(error({{"young", 1e300}}).find("young: found 1e+300, expected at most 1e+13"), std::string::npos);
  EXPECT_NE(error({{"friction", 1e9}}).find("friction: found 1000000000.0, expected at most 1000"),
            std::string::npos);
  for (const auto& [key, most] : {std::pair{"thickness", "1"},
                                  {"bending_rigidity", "1e+06"},
                                  {"air_drag", "1e+04"},
                                  {"stiffness_damping", "1000"}})
    EXPECT_TRUE(
        error({{key, 1e300}}).ends_with(key + std::string(": found 1e+300, expected at most ") + most))
        << key;
  EXPECT_NE(error({{"constitutive", "TRI_STVK"}, {"young_ratio", 1e-9}}).find("a number from 0.01 to 100"),
            std::string::npos);
  const auto solid_error = [&](const char* key) {
    const json file = {
        {"schema", "flash-asset/1"},
        {"mesh", "box:1x1x1:1"},
        {"element_type", "TETRAHEDRON"},
        {"mechanical_props",
         {{"density", 1}, {"young", 1}, {"poisson", 0.3}, {"constitutive", "TET_ARAP"}, {key, 1}}}};
    return input_error_of([&] { load_asset(folder.write("cube.json", file.dump())); });
  };
  for (const char* key : {"thickness", "bending_rigidity", "bending_model"})
    EXPECT_NE(solid_error(key).find("no such field for element_type TETRAHEDRON"), std::string::npos) << key;
}

// However it is stated: each extreme alone is a positive number.
TEST(Asset, AMassThatNothingHasIsRefused) {
  Asset sheet, solid;
  sheet.source = "towel.json";
  solid.source = "cube.json";
  solid.element_type = ElementType::tetrahedron;
  const auto of_sheet = [&] { return input_error_of([&] { resolve_sheet(sheet, 0.5); }); };
  sheet.areal_density = 1e-300;
  EXPECT_EQ(
      of_sheet(),
      "towel.json: mechanical_props: found a mass of 1e-300, expected 1e-09 to 1e+04 kg/m^2, as sheets have");
  sheet.areal_density.reset();
  sheet.density = 1e300;
  sheet.thickness = 1e300;
  EXPECT_NE(of_sheet().find("found a mass of inf"), std::string::npos) << of_sheet();
  sheet.density.reset();
  sheet.thickness.reset();
  sheet.mass = 1e5;
  EXPECT_NE(of_sheet().find("found a mass of 2e+05,"), std::string::npos) << of_sheet();
  sheet.mass = 0.5e-9 * (1 + 1e-15);  // over the area it is the least, but for rounding
  EXPECT_EQ(of_sheet(), "");
  sheet.mass = 0.1;
  EXPECT_EQ(of_sheet(), "");
  sheet.published_bending = 5e5;
  EXPECT_EQ(of_sheet(),
            "towel.json: mechanical_props: found a bending rigidity of 1500000, expected 0 to 1e+06 N m");
  const auto of_solid = [&] { return input_error_of([&] { resolve_solid(solid, 0.5); }); };
  solid.mass = 1e-9;
  EXPECT_EQ(
      of_solid(),
      "cube.json: mechanical_props: found a mass of 2e-09, expected 1e-06 to 1e+06 kg/m^3, as solids have");
  solid.mass = 500;
  EXPECT_EQ(of_solid(), "");
}

TEST(Asset, MembranesMayBeWoven) {
  const TemporaryFolder folder;
  const auto load = [&](const json& changes) {
    json file = json::parse(kFlash);
    file["mechanical_props"].update(changes);
    return load_asset(folder.write("towel.json", file.dump()));
  };
  const json weave = {
      {"constitutive", "TRI_STVK"}, {"young_ratio", 0.25}, {"shear_ratio", 0.1}, {"warp_direction", 30}};
  const Asset woven = load(weave);
  const ResolvedSheet sheet = resolve_sheet(woven, 0.1);
  const SheetMaterial& m = sheet.material;
  EXPECT_EQ(m.weave.young_ratio, 0.25);
  EXPECT_EQ(m.weave.shear_ratio, 0.1);
  save_asset(woven, folder / "copy.json");
  EXPECT_EQ(load_asset(folder / "copy.json").weave, woven.weave);
  // nu_12 / E_1 = nu_21 / E_2, and nu^2 = nu_12 nu_21.
  const std::string said = "E_2 t = " + format_short(0.25 * m.membrane_stiffness) + " N/m, G t = " +
                           format_short(0.1 * 0.5 * m.membrane_stiffness / (2 * (1 + m.poissons_ratio))) +
                           " N/m, nu_12 = " + format_short(2 * m.poissons_ratio);
  EXPECT_TRUE(std::any_of(sheet.notices.begin(), sheet.notices.end(), [&](const std::string& notice) {
    return notice.find(said) != std::string::npos;
  })) << said;
  const auto error = [&](const json& changes) { return input_error_of([&] { load(changes); }); };
  for (const char* key : {"young_ratio", "shear_ratio"}) {
    EXPECT_NE(error({{"constitutive", "TRI_COROTATED"}, {key, 0.5}})
                  .find("expected constitutive TRI_STVK, the only"),
              std::string::npos);
    for (const double ratio : {1e308, 1e-300})
      EXPECT_NE(error({{"constitutive", "TRI_STVK"}, {key, ratio}}).find(", expected a number from 0.0"),
                std::string::npos);
    EXPECT_NE(error({{"constitutive", "TRI_STVK"}, {key, -1}}).find("found -1, expected a number above 0"),
              std::string::npos);
  }
  EXPECT_NE(
      error({{"bending_model", "hinge"}, {"warp_direction", 5}}).find("constitutive TRI_STVK, which may"),
      std::string::npos);
  EXPECT_EQ(error({{"bending_model", "hinge"}, {"constitutive", "TRI_STVK"}, {"warp_direction", 5}}), "");
}

TEST(Asset, BendingOfHingesMayYield) {
  const TemporaryFolder folder;
  const auto load = [&](const char* text, const json& changes) {
    json file = json::parse(text);
    file["mechanical_props"].update(changes);
    return load_asset(folder.write("towel.json", file.dump()));
  };
  const Asset paper = load(kFlash, {{"bending_model", "hinge"}, {"yield_curvature", 40}});
  const SheetMaterial material = resolve_sheet(paper, 0.1).material;
  EXPECT_EQ(material.yield_curvature, 40);
  EXPECT_TRUE(std::isinf(resolve_sheet(load(kFlash, json::object()), 0.1).material.yield_curvature));
  save_asset(paper, folder / "copy.json");
  EXPECT_EQ(load_asset(folder / "copy.json").yield_curvature, 40);
  EXPECT_EQ(asset_from_sheet(material, {}, "sheet:1x1:1").yield_curvature, 40);
  std::vector<std::string> notices;
  EXPECT_FALSE(express_as(paper, AssetFormat::published, 0.1, notices).yield_curvature);
  const auto error = [&](const char* text, const json& changes) {
    return input_error_of([&] { load(text, changes); });
  };
  EXPECT_NE(error(kFlash, {{"yield_curvature", 40}}).find("yield_curvature: found 40, expected"),
            std::string::npos);
  EXPECT_NE(error(kFlash, {{"bending_model", "hinge"}, {"yield_curvature", 0}}).find("a number above 0"),
            std::string::npos);
  EXPECT_NE(error(kPublished, {{"yield_curvature", 40}}).find("flash-asset/1"), std::string::npos);
}

TEST(Asset, ElementsMayBeQuadratic) {
  const TemporaryFolder folder;
  const auto load = [&](const std::string& fields, const std::string& law = "TET_COROTATED") {
    return load_asset(folder.write("part.json", "{" + fields + R"(, "mesh": "box:1x1x1:1",
      "mechanical_props": {"mass": 1, "young": 1, "poisson": 0.3, )" +
                                                    (law.starts_with("TRI") ? "\"thickness\": 1, " : "") +
                                                    "\"constitutive\": \"" + law + "\"}}"));
  };
  const auto error = [&](const std::string& fields, const std::string& law = "TET_COROTATED") {
    return input_error_of([&] { load(fields, law); });
  };
  const std::string solid = R"("schema": "flash-asset/1", "element_type": "TETRAHEDRON")";
  EXPECT_EQ(load(solid).element_order, ElementOrder::linear);
  EXPECT_EQ(load(solid + R"(, "element_order": 1)").element_order, ElementOrder::linear);
  const Asset quadratic = load(solid + R"(, "element_order": 2)");
  EXPECT_EQ(quadratic.element_order, ElementOrder::quadratic);
  save_asset(quadratic, folder / "copy.json");
  EXPECT_EQ(load_asset(folder / "copy.json").element_order, ElementOrder::quadratic);
  std::vector<std::string> notices;
  EXPECT_EQ(express_as(quadratic, AssetFormat::published, 0, notices).element_order, ElementOrder::linear);
  EXPECT_EQ(notices.front(),
            "the published format cannot express element_order 2: its tetrahedra are linear");
  EXPECT_NE(error(solid + R"(, "element_order": 3)").find("element_order: found 3, expected 1 or 2"),
            std::string::npos);
  EXPECT_NE(error(R"("schema": "flash-asset/1", "element_order": 2)", "TRI_ARAP")
                .find("expected 1, as 2 is for element_type TETRAHEDRON alone"),
            std::string::npos);
  EXPECT_NE(
      error(R"("element_type": "TETRAHEDRON", "element_order": 2)").find("\"schema\": \"flash-asset/1\""),
      std::string::npos);
}

TEST(Asset, WrongFieldsAreNamed) {
  const TemporaryFolder folder;
  const auto changed = [&](const char* text, const char* pointer, const json& value) {
    json file = json::parse(text);
    if (value.is_null())
      file = file.patch({{{"op", "remove"}, {"path", pointer}}});
    else
      file[json::json_pointer(pointer)] = value;
    const std::string path = folder.write("towel.json", file.dump());
    std::string message = input_error_of([&] { load_asset(path); });
    return message.starts_with(path) ? message.substr(path.size() + 2) : message;
  };
  json misspelt = json::parse(kPublished);
  misspelt["mechanical_props"].erase("poisson");
  misspelt["mechanical_props"]["poison"] = 0.4;
  EXPECT_EQ(input_error_of([&] { load_asset(folder.write("towel.json", misspelt.dump())); }),
            folder / "towel.json" + ": mechanical_props.poison: unknown field (did you mean \"poisson\"?)");
  EXPECT_EQ(
      changed(kFlash, "/schema", "flash-asset/9"),
      "schema: found \"flash-asset/9\", expected \"flash-asset/1\", or no schema for the published format");
  EXPECT_EQ(changed(kFlash, "/mechanical_props/young", "soft"),
            "mechanical_props.young: found \"soft\", expected a number");
  EXPECT_EQ(changed(kFlash, "/mechanical_props/young", -1),
            "mechanical_props.young: found -1, expected a number above 0");
  EXPECT_EQ(changed(kFlash, "/mechanical_props/young", nullptr),
            "mechanical_props.young: missing, expected a number");
  EXPECT_EQ(changed(kFlash, "/mechanical_props/poisson", 0.6),
            "mechanical_props.poisson: found 0.6, expected above -1 and at most 0.5");
  EXPECT_EQ(changed(kFlash, "/mechanical_props/mass", 1),
            "mechanical_props: found areal_density, mass, expected exactly one of density, areal_density, "
            "mass, obj_mass");
  EXPECT_EQ(
      changed(kFlash, "/mechanical_props/areal_density", nullptr),
      "mechanical_props: found no mass, expected exactly one of density, areal_density, mass, obj_mass");
  EXPECT_EQ(
      changed(kFlash, "/mechanical_props/thickness", nullptr),
      "mechanical_props.bending_rigidity: missing, expected D [N m], or a thickness for the plate formula");
  EXPECT_EQ(changed(kFlash, "/mechanical_props/bending", 0.1),
            "mechanical_props.bending: found 0.1, expected bending_rigidity [N m] in flash-asset/1 (D = 3 "
            "bending)");
  EXPECT_EQ(changed(kFlash, "/mechanical_props/constitutive", "TRI_HOOKE"),
            "mechanical_props.constitutive: found \"TRI_HOOKE\", expected one of TRI_ARAP, TRI_COROTATED, "
            "TRI_STVK, "
            "TRI_NEOHOOKEAN, TET_ARAP, TET_COROTATED, TET_NEOHOOKEAN, TET_NEOHOOKEAN_LOG");
  EXPECT_EQ(
      changed(kPublished, "/element_type", "TETRAHEDRON"),
      "mechanical_props.constitutive: found \"TRI_ARAP\", expected TET_... for element_type TETRAHEDRON");
  EXPECT_EQ(changed(kPublished, "/element_type", "QUAD"),
            "element_type: found \"QUAD\", expected TRIANGLE or TETRAHEDRON");
  EXPECT_EQ(changed(kPublished, "/transformation/trans", {1, 2}),
            "transformation.trans: found [1,2], expected a list of 3 numbers");
  EXPECT_NE(input_error_of([&] {
              load_asset(folder.write("towel.json", "{\n\"mesh\": ,\n}"));
            }).find("not valid JSON: line 2, column 9"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::data
