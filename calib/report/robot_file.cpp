#include "calib/report/robot_file.h"

#include <tinyxml2.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <vector>

#include "calib/dataset/camera_marks.h"
#include "calib/report/xml_text.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::calib {
namespace {

using data::input_error;

std::string first_mark(const std::string& camera) { return "<!--" + kCameraMark + camera + " -->"; }
std::string last_mark(const std::string& camera) { return "<!--" + kCameraEndMark + camera + " -->"; }

/// Without the lines that an earlier call added. Throws where one of its two marks is missing.
std::string without_camera(std::string text, const std::string& path, const std::string& camera) {
  const std::string first = first_mark(camera), last = last_mark(camera);
  const std::size_t begin = text.find(first), end = text.find(last);
  if (begin == std::string::npos && end == std::string::npos) return text;
  if (begin == std::string::npos || end == std::string::npos || end < begin)
    throw input_error(path, camera,
                      "found one of the comments \"" + first + "\" and \"" + last + "\", expected both");
  std::size_t line = text.rfind('\n', begin);
  if (line == std::string::npos) line = 0;
  if (line > 0 && text[line - 1] == '\r') --line;
  return text.erase(line, end + last.size() - line);
}

std::string name_of(const tinyxml2::XMLElement& element) {
  const char* const name = element.Attribute("name");
  return name ? name : "";
}

/// The names of all elements of a kind, those inside of others too.
void add_names(const tinyxml2::XMLElement& element, const std::string& kind,
               std::vector<std::string>& names) {
  for (const auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement()) {
    if (kind == child->Name()) names.push_back(name_of(*child));
    add_names(*child, kind, names);
  }
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  for (const std::string& each : names)
    if (each == name) return true;
  return false;
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 12;
  std::string text = names.empty() ? "none" : "";
  for (std::size_t k = 0; k < names.size() && k < kMost; ++k) text += (k > 0 ? ", " : "") + names[k];
  return names.size() > kMost ? text + ", ..." : text;
}

/// Each line of `block` between the marks, moved in; lines end as those of the robot do.
std::string marked(const std::string& block, const std::string& camera, const std::string& indent,
                   const std::string& robot) {
  const std::string begin = (robot.find("\r\n") == std::string::npos ? "\n" : "\r\n") + indent;
  std::string text = begin + first_mark(camera);
  std::istringstream lines(block);
  for (std::string line; std::getline(lines, line);) text += begin + line;
  return text + begin + last_mark(camera);
}

/// Throws where several elements of the kind have a name.
void expect_one(const std::vector<std::string>& names, const std::string& path, const std::string& kind,
                const std::string& name) {
  const auto count = std::count(names.begin(), names.end(), name);
  if (count > 1)
    throw input_error(path, kind,
                      "found \"" + name + "\" " + std::to_string(count) + " times, expected it once");
}

/// Throws where another element of the kind has the camera's name.
void expect_free(const std::vector<std::string>& names, const std::string& path, const std::string& kind,
                 const std::string& camera) {
  if (contains(names, camera))
    throw input_error(
        path, kind,
        "found \"" + camera +
            "\", which flash-calib did not write, expected none: give it another with --child-frame");
}

/// Behind the opening tag of the n-th element of a kind, in the order of the document. npos: its tag closes
/// itself, or there is none.
std::size_t behind_tag(const std::string& document, const std::string& kind, std::size_t n) {
  const std::string text = without_remarks(document);
  const std::size_t begin = tag_of(text, kind, n);
  const std::size_t end = begin == std::string::npos ? begin : end_of_tag(text, begin);
  return end == std::string::npos || text[end - 1] == '/' ? std::string::npos : end + 1;
}

/// The link that carries each link of a robot.
std::map<std::string, std::string> parents_of(const tinyxml2::XMLElement& robot) {
  std::map<std::string, std::string> parents;
  for (const auto* joint = robot.FirstChildElement("joint"); joint;
       joint = joint->NextSiblingElement("joint")) {
    const auto* const parent = joint->FirstChildElement("parent");
    const auto* const child = joint->FirstChildElement("child");
    const char* const above = parent ? parent->Attribute("link") : nullptr;
    const char* const below = child ? child->Attribute("link") : nullptr;
    if (above && below) parents[below] = above;
  }
  return parents;
}

/// Throws where the camera would carry itself.
void expect_tree(const tinyxml2::XMLElement& robot, const std::string& path,
                 const data::NamedTransform& transform) {
  const std::map<std::string, std::string> parents = parents_of(robot);
  std::string link = transform.parent;
  for (std::size_t k = 0; k <= parents.size(); ++k) {
    if (link == transform.child)
      throw input_error(
          path, "link " + transform.parent,
          "hangs on \"" + transform.child + "\", expected a link that the camera does not carry");
    const auto above = parents.find(link);
    if (above == parents.end()) return;
    link = above->second;
  }
}

/// Throws unless a name can stand in a comment of XML.
void expect_name_in_comment(const std::string& name) {
  if (name.find("--") != std::string::npos)
    throw data::InputError("--child-frame: found \"" + name +
                           "\", expected no two hyphens in a row, which XML forbids in comments");
}

/// The text without what an earlier call added, which is parsed into the document.
std::string parsed_without_camera(const std::string& text, const std::string& path, const std::string& root,
                                  const std::string& camera, tinyxml2::XMLDocument& document) {
  expect_name_in_comment(camera);
  std::string robot = without_camera(text, path, camera);
  parse_xml(robot, path, root, document);
  return robot;
}

}  // namespace

std::string camera_in_urdf(const std::string& text, const std::string& path,
                           const data::NamedTransform& transform, const Lens& lens) {
  tinyxml2::XMLDocument document;
  std::string robot = parsed_without_camera(text, path, "robot", transform.child, document);
  std::vector<std::string> links, joints;
  add_names(*document.RootElement(), "link", links);
  add_names(*document.RootElement(), "joint", joints);
  const std::string visible = without_remarks(robot);
  const bool has_macros = visible.find("<xacro:") != std::string::npos;
  if (!contains(links, transform.parent) && !has_macros)
    throw input_error(path, "link",
                      "found " + listed(links) + ", expected \"" + transform.parent +
                          "\", on which the camera is: name it as the robot does with --parent-frame");
  expect_one(links, path, "link", transform.parent);
  expect_free(links, path, "link", transform.child);
  expect_free(joints, path, "joint", transform.parent + "_to_" + transform.child);
  expect_tree(*document.RootElement(), path, transform);
  const std::size_t end = visible.rfind("</robot");
  if (end == std::string::npos)
    throw data::InputError(path + ": found a robot without links, expected </robot> at its end");
  const std::string block = "<link name=\"" + transform.child + "\"/>\n" + urdf_joint(transform, lens);
  const std::size_t last = robot.find_last_not_of(" \t\r\n", end - 1);
  return robot.insert(last + 1, marked(block, transform.child, "  ", robot));
}

std::string camera_in_mjcf(const std::string& text, const std::string& path,
                           const data::NamedTransform& transform, const Lens& lens) {
  tinyxml2::XMLDocument document;
  std::string robot = parsed_without_camera(text, path, "mujoco", transform.child, document);
  std::vector<std::string> bodies, cameras;
  add_names(*document.RootElement(), "body", bodies);
  add_names(*document.RootElement(), "camera", cameras);
  expect_free(cameras, path, "camera", transform.child);
  const bool of_world = transform.parent == "world";
  std::size_t n = 0;
  while (!of_world && n < bodies.size() && bodies[n] != transform.parent) ++n;
  if (!of_world && n == bodies.size())
    throw input_error(
        path, "body",
        "found " + listed(bodies) + ", expected \"" + transform.parent +
            "\", on which the camera is: name it as the robot does with --parent-frame; world is the "
            "worldbody");
  expect_one(bodies, path, "body", transform.parent);
  const std::size_t place = behind_tag(robot, of_world ? "worldbody" : "body", n);
  if (place == std::string::npos)
    throw input_error(path, of_world ? "worldbody" : "body " + transform.parent,
                      "found none with an end of its own, expected <body ...> ... </body>");
  const std::size_t line = robot.rfind('\n', place), first = robot.find_first_not_of(" \t", line + 1);
  const std::string indent(first - (line + 1) + 2, ' ');
  return robot.insert(place, marked(mjcf_camera(transform, lens), transform.child, indent, robot));
}

}  // namespace flash::calib
