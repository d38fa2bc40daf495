#include "apps/command_line.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>

#include "data/error.h"

namespace flash {
namespace {

// A signal handler reaches nothing but what stands here.
std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free);
constexpr std::string_view kStopping = "\nstopping after this step; Ctrl-C again ends the program now\n";

void ask_to_stop(int signal) {
  if (stop_asked.exchange(true)) _exit(128 + signal);
  const int before = errno;
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kStopping.data(), kStopping.size());
  errno = before;
}

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

const std::atomic<bool>& stop_on_signals() {
  struct sigaction action = {};
  action.sa_handler = ask_to_stop;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  return stop_asked;
}

}  // namespace flash
