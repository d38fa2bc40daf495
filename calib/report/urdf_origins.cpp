#include "calib/report/urdf_origins.h"

#include <tinyxml2.h>

#include <cstdio>

#include "calib/dataset/urdf_file.h"
#include "calib/geometry/pose.h"
#include "calib/report/xml_text.h"
#include "data/files/error.h"

namespace flash::calib {
namespace {

struct Place {
  const tinyxml2::XMLElement* joint = nullptr;
  std::size_t number = 0;  ///< among all elements `joint`, those of transmissions too
};

/// The joints of the robot itself of that name.
std::vector<Place> joints_named(const tinyxml2::XMLElement& element, const std::string& name, bool robot,
                                std::size_t& number) {
  std::vector<Place> found;
  for (const auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement()) {
    const bool joint = std::string("joint") == child->Name();
    if (joint && robot && child->Attribute("name", name.c_str())) found.push_back({child, number});
    number += joint ? 1 : 0;
    joints_named(*child, name, false, number);
  }
  return found;
}

bool same(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  constexpr double kSame = 1e-6;  // of what files round to [m, rad]
  return motion_between(a, b).cwiseAbs().maxCoeff() < kSame;
}

std::string three(const Eigen::Vector3d& v) {
  char text[80];
  std::snprintf(text, sizeof text, "%.9g %.9g %.9g", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
  return text;
}

/// A tag with that value of an attribute. begin: of the tag in the text.
void set_attribute(std::string& text, std::size_t begin, const std::string& name, const std::string& value) {
  const std::size_t end = end_of_tag(text, begin);
  for (std::size_t k = begin, quote = 0; k < end; ++k) {
    if (quote != 0) {
      if (static_cast<unsigned char>(text[k]) == quote) quote = 0;
      continue;
    }
    if (text[k] == '"' || text[k] == '\'') quote = static_cast<unsigned char>(text[k]);
    if (text.compare(k, name.size(), name) != 0 ||
        std::string(" \t\r\n").find(text[k - 1]) == std::string::npos)
      continue;
    const std::size_t equals = text.find_first_not_of(" \t\r\n", k + name.size());
    if (equals >= end || text[equals] != '=') continue;
    const std::size_t opening = text.find_first_of("\"'", equals),
                      closing = text.find(text[opening], opening + 1);
    text.replace(opening + 1, closing - opening - 1, value);
    return;
  }
  const std::size_t last = text.find_last_not_of(" \t\r\n", end - (text[end - 1] == '/' ? 2 : 1));
  text.insert(last + 1, " " + name + "=\"" + value + '"');
}

}  // namespace

std::string with_joint_origins(const std::string& text, const std::string& path,
                               const std::vector<JointOrigin>& origins) {
  tinyxml2::XMLDocument document;
  parse_xml(text, path, "robot", document);
  std::string result = text;
  for (const JointOrigin& origin : origins) {
    std::size_t number = 0;
    const std::vector<Place> places = joints_named(*document.RootElement(), origin.joint, true, number);
    const std::string field = "joint " + origin.joint;
    if (places.size() != 1)
      throw data::input_error(path, field,
                              "found it " + std::to_string(places.size()) +
                                  " times, expected once, as in the robot of the calibration");
    const Eigen::Isometry3d present = urdf_origin(*places.front().joint, path);
    if (!same(present, origin.corrected) && !same(present, origin.described)) {
      const Eigen::Isometry3d& T = origin.described;
      throw data::input_error(path, field,
                              "found origin " + three(present.translation()) + ", rpy " +
                                  three(roll_pitch_yaw(present.linear())) +
                                  ", expected that of the calibration, " + three(T.translation()) + ", rpy " +
                                  three(roll_pitch_yaw(T.linear())));
    }
    const std::string xyz = three(origin.corrected.translation()),
                      rpy = three(roll_pitch_yaw(origin.corrected.linear()));
    const std::string visible = without_remarks(result);
    const std::size_t joint = tag_of(visible, "joint", places.front().number);
    const std::size_t inside = visible.substr(joint, visible.find("</joint", joint) - joint).find("<origin");
    if (inside == std::string::npos) {
      result.insert(end_of_tag(visible, joint) + 1, "<origin xyz=\"" + xyz + "\" rpy=\"" + rpy + "\"/>");
      continue;
    }
    set_attribute(result, joint + inside, "xyz", xyz);
    set_attribute(result, joint + inside, "rpy", rpy);
  }
  return result;
}

}  // namespace flash::calib
