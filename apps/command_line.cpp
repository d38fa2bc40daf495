#include "apps/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <string>

#include "data/error.h"

namespace flash {
namespace {

// Messages of libraries may span lines; users and scripts read one.
int report(const std::string& name, std::string message, int code) {
  while (!message.empty() && (message.back() == '\n' || message.back() == ' ')) message.pop_back();
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << name << ": " << message << std::endl;
  return code;
}

}  // namespace

int run_tool(const char* name, const std::function<int()>& body) {
  try {
    return body();
  } catch (const data::InputError& error) {
    return report(name, error.what(), exit_bad_input);
  } catch (const std::exception& error) {
    return report(name, error.what(), exit_failed);
  }
}

int run_tool(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return report(app.get_name(), std::string(error.what()) + " (see --help)", exit_bad_input);
  }
  return run_tool(app.get_name().c_str(), body);
}

}  // namespace flash
