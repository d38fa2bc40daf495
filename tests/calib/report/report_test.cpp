#include "calib/report/report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/report/extrinsics_json.h"
#include "data/picture/picture.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

// What stands between the tags of the data element, as a browser would cut it.
nlohmann::json data_of(const std::string& html) {
  const std::string open = "<script type=\"application/json\" id=\"data\">";
  const std::size_t begin = html.find(open) + open.size();
  return nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

struct Rendered {
  HandEyeScene scene;
  Calibration calibration;
  std::string html;
};

// Fifteen views; the last one's robot pose is far off, and a name tries to end the script.
Rendered rendered(const std::string& image = "") {
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  Rendered result{.scene = make_scene(settings, board_points(), 1), .calibration = {}, .html = {}};
  std::vector<Observation>& views = result.scene.observations;
  views.front().image = "</script>.png";
  views.back().T_base_gripper.translation().x() += 0.2;
  result.calibration = calibrate(settings.setup, result.scene.camera, result.scene.points,
                                 grid_symmetries(result.scene.points), views);
  const ExtrinsicsInputs inputs{"recording", "chessboard:9x6:0.025", "poses.tum", "camera_info.yaml",
                                "image_model"};
  std::vector<std::string> images(views.size());
  images[3] = image;
  result.html = render_report(result.calibration, extrinsics_of(result.calibration, inputs),
                              to_json(result.calibration, inputs, 0), {result.scene.points, images});
  return result;
}

double rms(const nlohmann::json& a, const nlohmann::json& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += (a[i].get<double>() - b[i].get<double>()) * (a[i].get<double>() - b[i].get<double>());
  return std::sqrt(2 * sum / static_cast<double>(a.size()));
}

TEST(CalibrationReport, ResidualsOfEveryViewAreThoseOfTheResult) {
  const Rendered report = rendered();
  const nlohmann::json data = data_of(report.html);
  ASSERT_EQ(data["views"].size(), 15u);
  for (std::size_t i = 0; i < 15; ++i) {
    const nlohmann::json& view = data["views"][i];
    ASSERT_EQ(view["detected"].size(), 108u) << i;
    const ViewResult& expected = report.calibration.views[i];
    EXPECT_EQ(view["used"], expected.used) << i;
    if (!expected.used) continue;
    // Places are written in thousandths of a pixel.
    EXPECT_NEAR(rms(view["detected"], view["corrected"]), expected.px, 1e-3) << i;
    EXPECT_NEAR(rms(view["detected"], view["projected"]), expected.chain_px, 1e-3) << i;
  }
  EXPECT_EQ(data["views"][0]["image"], "</script>.png");
}

TEST(CalibrationReport, ShowsWhyAViewWasLeftOutAndWhereItShouldHaveBeen) {
  const nlohmann::json view = data_of(rendered().html)["views"][14];
  EXPECT_FALSE(view["used"].get<bool>());
  EXPECT_FALSE(view["reason"].get<std::string>().empty());
  // 0.2 m seen from at most 0.52 m at f = 615 px, if hardly any of it lies along the ray.
  EXPECT_GT(view["chain_px"].get<double>(), 50);
  EXPECT_TRUE(view["corrected"].empty());
}

TEST(CalibrationReport, StandardDeviationsAreInTheParentFrame) {
  const Rendered report = rendered();
  const nlohmann::json data = data_of(report.html);
  // Oracle: the spread of T [Exp(dtheta), dt] in the parent, one column of a square root at a time.
  const Calibration& c = report.calibration;
  const Matrix6d root = c.covariance.llt().matrixL();
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  for (int k = 0; k < 6; ++k)
    variance += (moved(c.poses.X, root.col(k)).translation() - c.poses.X.translation()).cwiseAbs2();
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(data["sd_parent"]["mm"][static_cast<std::size_t>(k)].get<double>(),
                1e3 * std::sqrt(variance[k]), 1e-9);
}

TEST(CalibrationReport, CarriesPicturesInside) {
  const data::TemporaryFolder folder;
  const std::string path = folder / "view.png";
  data::save_png(data::Picture(640, 480, {90, 90, 90}), path);
  const std::string html = rendered(path).html;
  const nlohmann::json data = data_of(html);
  ASSERT_EQ(data["pictures"].size(), 1u);
  EXPECT_EQ(data["pictures"][0]["view"], 3);
  EXPECT_EQ(data["pictures"][0]["jpeg"].get<std::string>().substr(0, 4), "/9j/");  // the mark of a JPEG
  // What precedes the data, and what follows.
  const std::string head = html.substr(0, html.find("id=\"data\"")),
                    script = html.substr(html.rfind("<script>"));
  for (const std::string& part : {head, script})
    for (const char* loads : {"http://", "https://", "@import", "fetch(", "<link"})
      EXPECT_EQ(part.find(loads), std::string::npos) << loads;
}

}  // namespace
}  // namespace flash::calib
