#pragma once
#include <cstddef>
#include <string>

namespace tinyxml2 {
class XMLDocument;
}

namespace flash::calib {

/// Places in the text of XML, so that all else of a file can stay as it is.

/// Throws data::InputError unless the text is XML of one element alone, which has this name. `path` is for
/// messages.
void parse_xml(const std::string& text, const std::string& path, const std::string& root,
               tinyxml2::XMLDocument& document);

/// The same text with blanks in place of comments, of CDATA and of what stands between <? and ?>.
std::string without_remarks(std::string text);

/// Of the n-th element of a kind, in the order of the document, where its opening tag begins. npos: there is
/// none. visible: without remarks.
std::size_t tag_of(const std::string& visible, const std::string& kind, std::size_t n);

/// The '>' of the tag that begins there; npos where it does not end.
std::size_t end_of_tag(const std::string& visible, std::size_t begin);

}  // namespace flash::calib
