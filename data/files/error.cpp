#include "data/files/error.h"

#include "data/files/message_line.h"

namespace flash::data {

InputError::InputError(const std::string& message) : std::runtime_error(message_line(message)) {}

}  // namespace flash::data
