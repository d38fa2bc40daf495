#pragma once
#include <string>

namespace flash::data {

/// What may quote names and values of an input, as one line that fits on a screen: control characters
/// and bytes that are no UTF-8 become question marks, words of more than 400 bytes and lines of more than
/// 2,000 lose their middle ("abc...xyz").
std::string message_line(const std::string& text);

}  // namespace flash::data
