#include "calib/report/xml_text.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "data/files/error.h"

namespace flash::calib {

void parse_xml(const std::string& text, const std::string& path, const std::string& root,
               tinyxml2::XMLDocument& document) {
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw data::InputError(path + ": is no XML: line " + std::to_string(document.ErrorLineNum()));
  const tinyxml2::XMLElement* const element = document.RootElement();
  if (element != nullptr && element->NextSiblingElement() != nullptr)
    throw data::InputError(path + ": found <" + element->NextSiblingElement()->Name() +
                           "> behind the end of <" + element->Name() + ">, expected one of them alone");
  if (element == nullptr || root != element->Name())
    throw data::InputError(path + ": found <" + (element == nullptr ? "" : element->Name()) +
                           ">, expected <" + root + ">");
}

std::string without_remarks(std::string text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kKinds = {
      {{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}}};
  for (std::size_t k = 0; k < text.size(); ++k)
    for (const auto& [begin, end] : kKinds) {
      if (text.compare(k, begin.size(), begin) != 0) continue;
      const std::size_t last = text.find(end, k + begin.size());
      const std::size_t after = last == std::string::npos ? text.size() : last + end.size();
      std::fill(text.begin() + static_cast<std::ptrdiff_t>(k),
                text.begin() + static_cast<std::ptrdiff_t>(after), ' ');
    }
  return text;
}

std::size_t end_of_tag(const std::string& text, std::size_t begin) {
  char quote = 0;
  for (std::size_t k = begin; k < text.size(); ++k) {
    if (quote != 0) {
      if (text[k] == quote) quote = 0;
    } else if (text[k] == '"' || text[k] == '\'') {
      quote = text[k];
    } else if (text[k] == '>') {
      return k;
    }
  }
  return std::string::npos;
}

std::size_t tag_of(const std::string& visible, const std::string& kind, std::size_t n) {
  const std::string tag = "<" + kind;
  for (std::size_t k = visible.find(tag); k != std::string::npos; k = visible.find(tag, k + 1)) {
    const char next = k + tag.size() < visible.size() ? visible[k + tag.size()] : '\0';
    if (std::string_view(">/ \t\n\r").find(next) == std::string_view::npos) continue;
    if (n-- == 0) return k;
  }
  return std::string::npos;
}

}  // namespace flash::calib
