#include "apps/command_line/option_checks.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/scene/scene.h"

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

/// The words between commas.
std::vector<std::string> items_of(const std::vector<std::string>& texts) {
  std::vector<std::string> items;
  for (const std::string& text : texts)
    for (const std::string_view word : data::split(text, ",")) items.emplace_back(word);
  return items;
}

/// `check` of each word between commas, none of which is empty.
CLI::Validator of_each(const CLI::Validator& check) {
  return CLI::Validator(
      [check](std::string& text) {
        for (std::string& item : items_of({text})) {
          if (item.empty()) return refusal(text, "a value on either side of each comma");
          if (std::string why = check(item); !why.empty()) return why;
        }
        return std::string();
      },
      check.get_description());
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

CLI::Validator time_step() { return number_between(data::min_time_step, data::max_time_step); }

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

CLI::Option* add_list_option(CLI::App& verb, const std::string& name, std::vector<std::string>& values,
                             const std::string& meaning, const CLI::Validator& check, std::size_t count) {
  return verb
      .add_option_function<std::vector<std::string>>(
          name,
          [name, count, &values](const std::vector<std::string>& texts) {
            values = items_of(texts);
            if (count > 0 && values.size() != count)
              throw data::InputError(name + ": found " + std::to_string(values.size()) + ", expected " +
                                     std::to_string(count) + " with a comma between them");
            expect_each_once(name, values);
          },
          meaning)
      ->check(of_each(check));
}

CLI::Option* add_list_option(CLI::App& verb, const std::string& name, std::vector<int>& values,
                             const std::string& meaning, const CLI::Validator& check) {
  return verb
      .add_option_function<std::vector<std::string>>(
          name,
          [name, &values](const std::vector<std::string>& texts) {
            values.clear();
            for (const std::string& item : items_of(texts)) {
              values.push_back(static_cast<int>(data::parse_integer(item).value()));
              if (std::find(values.begin(), values.end() - 1, values.back()) != values.end() - 1)
                throw data::InputError(name + ": found " + item + " twice, expected each once");
            }
          },
          meaning)
      ->type_name("INT")
      ->check(of_each(check));
}

void expect_each_once(const std::string& name, const std::vector<std::string>& words) {
  namespace fs = std::filesystem;
  for (std::size_t i = 0; i < words.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      std::error_code error;
      if (words[i] == words[j])
        throw data::InputError(name + ": found " + words[i] + " twice, expected each once");
      if (fs::exists(words[i], error) && fs::exists(words[j], error) &&
          fs::equivalent(words[i], words[j], error))
        throw data::InputError(name + ": found " + words[j] + " and " + words[i] +
                               ", which are the same, expected each once");
    }
}

void expect_ending(const std::string& name, const std::string& file,
                   const std::vector<std::string>& endings) {
  const std::string ending = data::lower_extension(file);
  if (ending.empty() || std::find(endings.begin(), endings.end(), ending) != endings.end()) return;
  std::string expected;
  for (const std::string& each : endings) expected += (expected.empty() ? "" : " or ") + each;
  throw data::InputError(name + ": found \"" + file + "\", expected a name that ends in " + expected);
}

CLI::Validator thread_number() { return whole_number(0, 1024); }

CLI::Validator cpu_alone(const std::string& why) {
  return CLI::Validator(
      [why](std::string& text) {
        return text == "auto" || text == "cpu" ? "" : refusal(text, "auto or cpu: " + why);
      },
      "{auto,cpu}");
}

}  // namespace flash
