#include "calib/report/urdf_origins.h"

#include <tinyxml2.h>

#include <cstdio>

#include "calib/dataset/urdf_file.h"
#include "calib/geometry/pose.h"
#include "calib/report/xml_text.h"
#include "data/files/error.h"

namespace flash::calib {
namespace {

/// The joints of the robot itself of that name.
std::vector<const tinyxml2::XMLElement*> joints_named(const tinyxml2::XMLElement& robot,
                                                      const std::string& name) {
  std::vector<const tinyxml2::XMLElement*> found;
  for (const auto* joint = robot.FirstChildElement("joint"); joint;
       joint = joint->NextSiblingElement("joint"))
    if (joint->Attribute("name", name.c_str())) found.push_back(joint);
  return found;
}

/// Counts the elements of its kind before `wanted`, in the order of the document; true where it comes.
bool count_before(const tinyxml2::XMLElement& from, const tinyxml2::XMLElement& wanted, std::size_t& number) {
  for (const auto* child = from.FirstChildElement(); child; child = child->NextSiblingElement()) {
    if (child == &wanted) return true;
    number += std::string(child->Name()) == wanted.Name() ? 1 : 0;
    if (count_before(*child, wanted, number)) return true;
  }
  return false;
}

/// Where the tag of an element begins in the text without remarks.
std::size_t place_of(const tinyxml2::XMLDocument& document, const tinyxml2::XMLElement& element,
                     const std::string& visible) {
  std::size_t number = 0;
  count_before(*document.RootElement(), element, number);
  return tag_of(visible, element.Name(), number);
}

std::string link_of(const tinyxml2::XMLElement& joint, const char* which) {
  const auto* const link = joint.FirstChildElement(which);
  const char* const name = link ? link->Attribute("link") : nullptr;
  return name ? name : "";
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

/// Throws where a joint of the file is not that of the calibration. parent: the link before it; empty: any.
void expect_same(const tinyxml2::XMLElement& element, const JointOrigin& origin, const std::string& parent,
                 const std::string& path) {
  constexpr const char* kSameRobot = ", as the robot of the calibration has it";
  const Joint &joint = origin.joint, present = urdf_joint(element, path);
  const std::string field = "joint " + joint.name;
  const auto refuse = [&](const std::string& found, const std::string& expected) {
    throw data::input_error(path, field, "found " + found + ", expected " + expected + kSameRobot);
  };
  if (present.kind != joint.kind)
    refuse(std::string("a ") + to_string(present.kind) + " joint",
           std::string("a ") + to_string(joint.kind) + " one");
  if (joint.kind != Joint::Kind::fixed && (present.axis - joint.axis).norm() > 1e-6)
    refuse("axis " + three(present.axis), three(joint.axis));
  const std::string link = link_of(element, "parent");
  if (!parent.empty() && link != parent) refuse("parent " + link, parent);
  const auto text = [](const Eigen::Isometry3d& T) {
    return three(T.translation()) + ", rpy " + three(roll_pitch_yaw(T.linear()));
  };
  if (!same(present.origin, origin.corrected) && !same(present.origin, joint.origin))
    refuse("origin " + text(present.origin), text(joint.origin));
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
  std::string result = text, parent, base;
  for (const JointOrigin& origin : origins) {
    tinyxml2::XMLDocument document;
    parse_xml(result, path, "robot", document);
    const auto found = joints_named(*document.RootElement(), origin.joint.name);
    if (found.size() != 1)
      throw data::input_error(path, "joint " + origin.joint.name,
                              "found it " + std::to_string(found.size()) +
                                  " times, expected once, as in the robot of the calibration");
    const tinyxml2::XMLElement& joint = *found.front();
    expect_same(joint, origin, parent, path);
    if (parent.empty()) base = link_of(joint, "parent");
    if (link_of(joint, "child") == base)
      throw data::input_error(
          path, "joint " + origin.joint.name,
          "carries link " + base + ", on which it hangs itself, expected a tree of links");
    parent = link_of(joint, "child");
    if (origin.corrected.matrix() == origin.joint.origin.matrix()) continue;
    const std::string xyz = three(origin.corrected.translation()),
                      rpy = three(roll_pitch_yaw(origin.corrected.linear()));
    const std::string visible = without_remarks(result);
    const tinyxml2::XMLElement* const present = joint.FirstChildElement("origin");
    if (!present) {
      const std::size_t begin = place_of(document, joint, visible);
      result.insert(end_of_tag(visible, begin) + 1, "<origin xyz=\"" + xyz + "\" rpy=\"" + rpy + "\"/>");
      continue;
    }
    const std::size_t begin = place_of(document, *present, visible);
    set_attribute(result, begin, "xyz", xyz);
    set_attribute(result, begin, "rpy", rpy);
  }
  return result;
}

}  // namespace flash::calib
