#include "data/error.h"

namespace flash::data {
namespace {

/// Names and values of a damaged file may hold line breaks and bytes that are no text.
std::string in_one_line(std::string message) {
  for (char& c : message)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = '?';
  return message;
}

}  // namespace

InputError::InputError(const std::string& message) : std::runtime_error(in_one_line(message)) {}

}  // namespace flash::data
