#include "calib/dataset/urdf_file.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "calib/dataset/camera_marks.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::calib {
namespace {

using data::input_error;
using data::InputError;

struct Link {
  const tinyxml2::XMLElement* joint;  ///< that carries it
  std::string parent;                 ///< link before it
  bool camera = false;                ///< an earlier export put it there: no part of the robot
};

std::string attribute(const tinyxml2::XMLElement* element, const char* name) {
  const char* const text = element ? element->Attribute(name) : nullptr;
  return text ? text : "";
}

Eigen::Vector3d three_numbers(const std::string& text, const Eigen::Vector3d& otherwise,
                              const std::string& path, const std::string& field) {
  if (text.empty()) return otherwise;
  std::vector<double> values;
  for (const std::string_view word : data::split(text, " \t\r\n"))
    if (!word.empty()) {
      const std::optional<double> value = data::parse_number(std::string(word));
      if (!value || !std::isfinite(*value))
        throw input_error(path, field, "found \"" + text + "\", expected numbers");
      values.push_back(*value);
    }
  if (values.size() != 3) throw input_error(path, field, "found \"" + text + "\", expected three numbers");
  return Eigen::Vector3d(values[0], values[1], values[2]);
}

/// Where a joint stands in the frame of the one before.
Eigen::Isometry3d origin_of(const tinyxml2::XMLElement& joint, const std::string& path) {
  const tinyxml2::XMLElement* const origin = joint.FirstChildElement("origin");
  const std::string field = "joint " + attribute(&joint, "name");
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = rotation_of_rpy(three_numbers(attribute(origin, "rpy"), none, path, field + ", rpy"));
  T.translation() = three_numbers(attribute(origin, "xyz"), none, path, field + ", xyz");
  return T;
}

/// Whether a remark begins with this.
bool begins_with(const tinyxml2::XMLNode& node, const std::string& mark) {
  return node.ToComment() && std::string(node.Value()).compare(0, mark.size(), mark) == 0;
}

/// The joints of a robot by the link that each carries.
std::map<std::string, Link> joints_of(const tinyxml2::XMLElement& robot, const std::string& path) {
  std::map<std::string, Link> carried;
  bool camera = false;
  for (const auto* node = robot.FirstChild(); node; node = node->NextSibling()) {
    if (!camera && begins_with(*node, kCameraEndMark))
      throw input_error(
          path, "line " + std::to_string(node->GetLineNum()),
          "found <!--" + std::string(node->Value()) +
              "--> without the comment that begins it, expected both, or neither and no camera");
    camera = begins_with(*node, kCameraMark) || (camera && !begins_with(*node, kCameraEndMark));
    const tinyxml2::XMLElement* const element = node->ToElement();
    if (!element || element->Name() != std::string("joint")) continue;
    const std::string parent = attribute(element->FirstChildElement("parent"), "link"),
                      child = attribute(element->FirstChildElement("child"), "link");
    if (parent.empty() || child.empty())
      throw input_error(path, "joint " + attribute(element, "name"), "expected a parent and a child link");
    if (!carried.emplace(child, Link{element, parent, camera}).second)
      throw input_error(path, "link " + child, "hangs on two joints");
  }
  return carried;
}

/// The only one of the links that qualifies.
std::string only(const std::set<std::string>& links, const std::string& path, const char* what) {
  if (links.size() == 1) return *links.begin();
  std::string list;
  for (const std::string& link : links) list += (list.empty() ? "" : ", ") + link;
  throw InputError(path + ": found " + std::to_string(links.size()) + " links that can be " + what +
                   (list.empty() ? "" : " (" + list + ")") + ", expected one (name it)");
}

}  // namespace

Joint urdf_joint(const tinyxml2::XMLElement& element, const std::string& path) {
  Joint joint{.name = attribute(&element, "name")};
  const std::string field = "joint " + joint.name, kind = attribute(&element, "type");
  if (kind == "revolute" || kind == "continuous")
    joint.kind = Joint::Kind::revolute;
  else if (kind == "prismatic")
    joint.kind = Joint::Kind::prismatic;
  else if (kind != "fixed")
    throw input_error(path, field,
                      "found type \"" + kind + "\", expected revolute, continuous, prismatic or fixed");
  joint.origin = origin_of(element, path);
  joint.axis = three_numbers(attribute(element.FirstChildElement("axis"), "xyz"), Eigen::Vector3d::UnitX(),
                             path, field + ", axis");
  if (joint.kind == Joint::Kind::fixed) return joint;
  if (!(joint.axis.norm() > 1e-6)) throw input_error(path, field, "found an axis of no length");
  joint.axis.normalize();
  if (element.FirstChildElement("mimic"))
    throw input_error(path, field, "follows another joint (mimic), expected one that moves by itself");
  return joint;
}

SerialChain load_urdf(const std::string& path, const std::string& base, const std::string& tip) {
  const std::string text = data::read_file(path);
  if (text.empty()) throw InputError(path + ": is empty, expected a URDF");
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw InputError(path + ": line " + std::to_string(document.ErrorLineNum()) + ": expected XML");
  const tinyxml2::XMLElement* const robot = document.FirstChildElement("robot");
  if (!robot) throw InputError(path + ": found no element robot, expected a URDF (expand xacro first)");
  const std::map<std::string, Link> carried = joints_of(*robot, path);
  std::set<std::string> parents, roots, leaves;
  for (const auto& [child, link] : carried)
    if (!link.camera) parents.insert(link.parent);
  for (const std::string& parent : parents)
    if (carried.count(parent) == 0) roots.insert(parent);
  for (const auto& [child, link] : carried)
    if (!link.camera && parents.count(child) == 0) leaves.insert(child);
  const std::string first = base.empty() ? only(roots, path, "the base (--base-link)") : base;
  const std::string last = tip.empty() ? only(leaves, path, "the gripper (--tip-link)") : tip;
  SerialChain chain;
  for (std::string link = last; link != first;) {
    const auto found = carried.find(link);
    if (found == carried.end() || chain.joints.size() > carried.size())
      throw InputError(path + ": found no chain of joints from link " + first + " to link " + last);
    // Other joints, such as those of fingers, may be of any kind.
    chain.joints.push_back(urdf_joint(*found->second.joint, path));
    link = found->second.parent;
  }
  std::reverse(chain.joints.begin(), chain.joints.end());
  if (moving_joints(chain).empty())
    throw InputError(path + ": no joint moves from link " + first + " to link " + last);
  return chain;
}

}  // namespace flash::calib
