#include "sysid/report/recording_names.h"

#include <set>

namespace flash::sysid {
namespace {

std::string lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

/// `key` says which names count as the same.
template <class Key>
std::vector<std::string> numbered_where_alike(const std::vector<std::string>& names, const Key& key) {
  std::set<std::string> wanted, taken;
  for (const std::string& name : names) wanted.insert(key(name));
  std::vector<std::string> result;
  for (const std::string& name : names) {
    std::string own = name;
    for (int k = 2; taken.count(key(own)) > 0 || (own != name && wanted.count(key(own)) > 0); ++k)
      own = name + "_" + std::to_string(k);
    taken.insert(key(own));
    result.push_back(own);
  }
  return result;
}

bool is_safe(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
         c == '.' || c == ' ' || static_cast<unsigned char>(c) >= 0x80;
}

std::string file_name(std::string name) {
  constexpr std::size_t kLongest = 80;
  if (name.size() > kLongest) {
    std::size_t end = kLongest;
    while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80) --end;  // not within a letter
    name.resize(end);
  }
  for (char& c : name) c = is_safe(c) ? c : '_';
  if (name.empty()) return "_";
  for (char* end : {&name.front(), &name.back()}) *end = *end == ' ' || *end == '.' ? '_' : *end;
  return name;
}

}  // namespace

std::vector<std::string> told_apart(const std::vector<std::string>& names) {
  return numbered_where_alike(names, [](const std::string& name) { return name; });
}

std::vector<std::string> file_names(const std::vector<std::string>& names) {
  std::vector<std::string> files;
  for (const std::string& name : names) files.push_back(file_name(name));
  return numbered_where_alike(files, lower);
}

}  // namespace flash::sysid
