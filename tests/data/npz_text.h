#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace flash::data {

struct NamedArray {
  std::string name;
  std::vector<std::size_t> shape;
  std::vector<double> values;  ///< row by row
  std::string type = "<f8";    ///< that is claimed
  bool columns_first = false;  ///< likewise
};

/// CRC-32 (ISO 3309), bit by bit.
inline std::uint32_t crc32_of(const std::string& text) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0xEDB88320 : 0);
  }
  return ~crc;
}

/// An .npz with these arrays of doubles, not compressed.
inline std::string npz_text(const std::vector<NamedArray>& arrays) {
  std::string file, contents;
  const auto number = [](std::string& text, auto value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const auto& [name, shape, values, type, columns_first] : arrays) {
    std::string sizes;
    for (const std::size_t size : shape) sizes += std::to_string(size) + ",";
    std::string header = "{'descr': '" + type + "', 'fortran_order': " + (columns_first ? "True" : "False") +
                         ", 'shape': (" + sizes + "), }\n";
    std::string npy = "\x93NUMPY";
    npy += std::string("\x01\x00", 2);
    number(npy, static_cast<std::uint16_t>(header.size()));
    npy += header;
    for (const double value : values) number(npy, value);
    const auto place = static_cast<std::uint32_t>(file.size()), size = static_cast<std::uint32_t>(npy.size());
    const std::string entry = name + ".npy";
    const auto length = static_cast<std::uint16_t>(entry.size());
    file += std::string("PK\x03\x04", 4) + std::string(14, '\0');
    number(file, size);
    number(file, size);
    number(file, length);
    file += std::string(2, '\0') + entry + npy;
    contents += std::string("PK\x01\x02", 4) + std::string(12, '\0');
    number(contents, crc32_of(npy));
    number(contents, size);
    number(contents, size);
    number(contents, length);
    contents += std::string(12, '\0');
    number(contents, place);
    contents += entry;
  }
  const auto begin = static_cast<std::uint32_t>(file.size()),
             size = static_cast<std::uint32_t>(contents.size());
  const auto count = static_cast<std::uint16_t>(arrays.size());
  file += contents + std::string("PK\x05\x06", 4) + std::string(4, '\0');
  number(file, count);
  number(file, count);
  number(file, size);
  number(file, begin);
  return file + std::string(2, '\0');
}

}  // namespace flash::data
