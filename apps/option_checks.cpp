#include "apps/option_checks.h"

#include <cmath>

#include "data/error.h"
#include "data/scene.h"
#include "data/text.h"

namespace flash {
namespace {

std::string refusal(const std::string& found, const std::string& expected) {
  return "found \"" + found + "\", expected " + expected;
}

template <class Accepts>
CLI::Validator number_check(const std::string& description, const std::string& expected,
                            const Accepts& accepts) {
  return CLI::Validator(
      [expected, accepts](std::string& text) {
        const std::optional<double> value = data::parse_number(text);
        return value && std::isfinite(*value) && accepts(*value) ? "" : refusal(text, expected);
      },
      description);
}

std::string grouped(long value) {
  return (value < 0 ? "-" : "") + data::format_count(static_cast<std::size_t>(std::abs(value)));
}

}  // namespace

CLI::Validator whole_number(long low, long high) {
  return CLI::Validator(
      [low, high](std::string& text) {
        const std::optional<long> value = data::parse_integer(text);
        return value && *value >= low && *value <= high
                   ? ""
                   : refusal(text, "a whole number from " + grouped(low) + " to " + grouped(high));
      },
      std::to_string(low) + " to " + std::to_string(high));
}

CLI::Validator any_number() {
  return number_check("", "a number", [](double) { return true; });
}

CLI::Validator positive_number() {
  return number_check("above 0", "a number above 0", [](double value) { return value > 0; });
}

CLI::Validator number_from(double low) {
  const std::string text = data::format_short(low);
  return number_check("from " + text, "a number from " + text, [low](double value) { return value >= low; });
}

CLI::Validator number_between(double low, double high) {
  const std::string range = data::format_short(low) + " to " + data::format_short(high);
  return number_check(range, "a number from " + range,
                      [low, high](double value) { return value >= low && value <= high; });
}

CLI::Validator time_step() {
  const std::string most = data::format_short(data::max_time_step);
  return number_check("above 0, to " + most, "a number above 0, at most " + most,
                      [](double value) { return value > 0 && value <= data::max_time_step; });
}

CLI::Option* add_vector_option(CLI::App& verb, const std::string& name, std::vector<double>& value,
                               const std::string& meaning) {
  return verb
      .add_option_function<std::string>(
          name,
          [name, &value](const std::string& text) {
            value.clear();
            for (const std::string_view word : data::split(text, ","))
              if (const auto number = data::parse_number(word); number && std::isfinite(*number))
                value.push_back(*number);
            if (value.size() != 3 || data::split(text, ",").size() != 3)
              throw data::InputError(name + ": found \"" + text + "\", expected x,y,z, as 0.2,-0.4,0.1");
          },
          meaning)
      ->type_name("X,Y,Z");
}

CLI::Validator thread_number() { return whole_number(0, 1024); }

}  // namespace flash
