#include "apps/command_line/command_line.h"

#include <fcntl.h>
#include <sys/time.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "apps/command_line/value_names.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/message_line.h"
#include "data/files/text.h"

namespace flash {
namespace {

// A signal handler reaches nothing but what stands here.
std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free);
constexpr std::string_view kStopping = "\nstopping after this step; Ctrl-C again ends the program now\n";
std::array<char, 64> ended_line{};

void ask_to_stop(int signal) {
  if (stop_asked.exchange(true)) _exit(128 + signal);
  const int before = errno;
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kStopping.data(), kStopping.size());
  errno = before;
}

std::atomic<bool> end_asked = false;

void ask_to_end(int signal) {
  if (end_asked.exchange(true)) _exit(128 + signal);
}

constexpr std::string_view kTimeOver = "\nthe time of --max-hours is over: stopping after this step\n";

void stop_as_time_is_over(int /*signal*/) {
  if (stop_asked.exchange(true)) return;
  const int before = errno;
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kTimeOver.data(), kTimeOver.size());
  errno = before;
}

/// Of verbs that have no steps to stop after, and of all before their first.
void end_now(int /*signal*/) {
  [[maybe_unused]] const ssize_t written =
      ::write(STDERR_FILENO, ended_line.data(), std::strlen(ended_line.data()));
  _exit(exit_failed);
}

void handle_signals(void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
}

// Messages of libraries may span lines; users and scripts read one.
int report(const std::string& name, std::string message, int code) {
  while (!message.empty() && (message.back() == '\n' || message.back() == ' ')) message.pop_back();
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << name << ": " << data::message_line(message) << std::endl;
  return code;
}

/// Whether a file system refused the path itself, which the user gave: otherwise it is full or broken.
bool refuses_path(const std::error_code& code) {
  const std::vector<std::errc> of_paths = {std::errc::too_many_symbolic_link_levels,
                                           std::errc::filename_too_long,
                                           std::errc::read_only_file_system,
                                           std::errc::permission_denied,
                                           std::errc::operation_not_permitted,
                                           std::errc::not_a_directory,
                                           std::errc::is_a_directory,
                                           std::errc::no_such_file_or_directory,
                                           std::errc::file_exists,
                                           std::errc::directory_not_empty};
  return std::any_of(of_paths.begin(), of_paths.end(), [&](std::errc known) { return code == known; });
}

/// "PATH: Too many levels of symbolic links".
std::string message_of(const std::system_error& error) {
  const auto* const of_files = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (of_files == nullptr || of_files->path1().empty()) return error.what();
  const std::string second = of_files->path2().empty() ? "" : " -> " + of_files->path2().string();
  return of_files->path1().string() + second + ": " + error.code().message();
}

/// A standard stream that is closed would be opened again as the first file of the program, and the result
/// written into it. Its place is taken by one that nothing can be written to, or read from.
void occupy_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(stream, F_GETFD) < 0 && errno == EBADF)
      static_cast<void>(::open("/dev/null", stream == STDOUT_FILENO ? O_RDONLY : O_WRONLY));
}

/// Whether a signal asked to stop. From here on one ends the program at once, as if none were caught.
bool asked_to_stop_till_now() {
  std::signal(SIGALRM, SIG_IGN);
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction now = {};
    sigaction(signal, nullptr, &now);
    if (now.sa_handler == ask_to_stop) std::signal(signal, SIG_DFL);
  }
  return stop_asked;
}

/// `code` where standard output has taken all of the result and no signal asked to stop.
int delivered(const std::string& name, int code) {
  if (code != exit_done && code != exit_unusable) return code;
  errno = 0;
  std::cout.flush();
  const bool taken = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
  if (taken && asked_to_stop_till_now())
    return report(name, "the signal came when the result was complete; it is written", exit_failed);
  if (taken) return code;
  return report(name,
                "the result cannot be written to standard output" +
                    (errno != 0 ? std::string(": ") + std::strerror(errno) : ""),
                exit_failed);
}

void collect_options(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  for (const CLI::App* group : app.get_subcommands(nullptr)) collect_options(*group, names);
}

/// Two names are near by their letters, not by the strokes before them.
std::string nearest_option(const std::string& word, const std::vector<std::string>& known) {
  std::vector<std::string> names;
  for (const std::string& name : known) names.push_back(name.substr(2));
  const std::string nearest = data::nearest_name(word.substr(2), names);
  return nearest.empty() ? "" : "--" + nearest;
}

std::string meant(const std::string& nearest) {
  return nearest.empty() ? " (see --help)" : " (did you mean \"" + nearest + "\"?)";
}

/// CLI11 would only say that a verb is missing: of a verb that there is none of, and of an option before it.
void check_verb(const CLI::App& app, int argc, char** argv) {
  std::vector<std::string> verbs, known, of_verbs;
  for (const CLI::App* verb : app.get_subcommands(nullptr)) {
    verbs.push_back(verb->get_name());
    collect_options(*verb, of_verbs);
  }
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  for (int i = 1; i < argc; ++i) {
    const std::string word(argv[i], std::strcspn(argv[i], "="));
    if (word.starts_with("--") && word.size() > 2) {
      if (word == "--config" && argv[i] == word) ++i;  // its file
      if (std::find(known.begin(), known.end(), word) != known.end()) continue;
      if (std::find(of_verbs.begin(), of_verbs.end(), word) != of_verbs.end())
        throw data::InputError(word + ": found before the verb, expected after it, as " + app.get_name() +
                               " VERB " + word);
      throw data::InputError(word + ": unknown option" + meant(nearest_option(word, known)));
    }
    if (word.empty() || word.front() == '-' || std::find(verbs.begin(), verbs.end(), word) != verbs.end())
      return;
    throw data::InputError(word + ": unknown verb" + meant(data::nearest_name(word, verbs)));
  }
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// CLI11 passes over lines of one or two letters without a word.
void check_short_lines(const std::string& path, const std::string& text) {
  data::LineReader lines(text);
  std::string_view line;
  bool in_list = false;  // of several lines
  while (lines.next(line)) {
    const std::string_view word = trimmed(line);
    const std::size_t equals = word.find('=');
    if (!in_list && word.size() < 3 && !word.empty() && word.front() != '#' && word.front() != ';')
      throw data::InputError(path + ":" + std::to_string(lines.number()) + ": found \"" + std::string(word) +
                             "\", expected TOML, as [grid] and envs=8");
    if (equals != std::string_view::npos) in_list = trimmed(word.substr(equals + 1)).starts_with('[');
    if (word.ends_with(']')) in_list = false;
  }
}

/// CLI11 would wait for a pipe, read a device without end, and take bytes that are no text for flags.
std::string check_config(const std::string& path) {
  const std::string text = data::read_file(path);
  const auto odd = std::find_if(text.begin(), text.end(), [](unsigned char c) {
    return (c < ' ' && c != '\n' && c != '\r' && c != '\t') || c == 0x7f;
  });
  if (odd != text.end())
    throw data::InputError(path + ":" + std::to_string(1 + std::count(text.begin(), odd, '\n')) +
                           ": found a control character, expected TOML, as [grid] and envs=8");
  check_short_lines(path, text);
  return {};
}

/// "options.toml: grid.bendin: unknown option or section".
data::InputError wrong_config(const CLI::App& app, const CLI::ConfigError& error) {
  constexpr std::string_view kUnknown = "INI was not able to parse ";  // of CLI11, before section and key
  constexpr std::size_t kLongest = 80;
  const std::string file = app.get_config_ptr()->results().front();
  std::string text = error.what();
  if (!text.starts_with(kUnknown)) return data::InputError(file + ": " + text);
  text.erase(0, kUnknown.size());
  if (text.ends_with(".++") || text.ends_with(".--")) text.resize(text.size() - 3);  // a section begins, ends
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  return data::InputError(file + ": " + text + ": unknown option or section (see --help)");
}

/// What an option was called in earlier versions, or is called by other tools: the first name that the verb
/// has is what is meant.
std::string present_name(const std::string& word, const std::vector<std::string>& known) {
  static const std::map<std::string, std::vector<std::string>> kNames = {
      {"--fix", {"--hold"}},
      {"--set", {"--hold"}},
      {"--freeze", {"--hold"}},
      {"--within", {"--grasp-within"}},
      {"--shape", {"--grasp-shape"}},
      {"--offset", {"--offset-bound", "--offset-error"}},
      {"--yaw", {"--yaw-bound"}},
      {"--clock", {"--time-offset-bound", "--time-offset-error", "--time-offset"}},
      {"--time-offset", {"--time-offset-bound", "--time-offset-error"}},
      {"--start-yaw", {"--start-yaw-bound"}},
      {"--table-error", {"--table-height-bound"}},
      {"--table-height", {"--table-z"}},
      {"--sheet", {"--mesh"}},
      {"--cell", {"--mesh"}},
      {"--rate", {"--times"}},
      {"--crop-min", {"--crop-x"}},
      {"--crop-max", {"--crop-x"}}};
  const auto found = kNames.find(word);
  if (found == kNames.end()) return "";
  for (const std::string& name : found->second)
    if (std::find(known.begin(), known.end(), name) != known.end()) return name;
  return "";
}

/// The first word of the command line that nothing takes.
std::string word_too_many(const CLI::App& app) {
  const std::vector<std::string> words = app.remaining(true);
  return words.empty() ? "" : words.front();
}

/// An option of one value that has more.
std::string given_twice(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    if (option->get_items_expected_max() == 1 && option->results().size() > 1) return option->get_name();
  for (const CLI::App* part : app.get_subcommands(nullptr))
    if (const std::string name = given_twice(*part); !name.empty()) return name;
  return "";
}

/// What CLI11 found wrong with the command line; for a long option that the verb does not have, the nearest.
std::string wrong_words(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
  std::vector<std::string> known;
  for (const CLI::App* verb : app.get_subcommands()) collect_options(*verb, known);
  // What was misspelt may be what is missing; the value of an unknown option is a word too many.
  const bool of_names = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr ||
                        dynamic_cast<const CLI::RequiredError*>(&error) != nullptr ||
                        dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr;
  for (int i = 2; i < argc && of_names; ++i) {
    const std::string word(argv[i], std::strcspn(argv[i], "="));
    if (!word.starts_with("--") || std::find(known.begin(), known.end(), word) != known.end()) continue;
    if (word == "--config" && app.get_config_ptr() != nullptr)
      return "--config: found after the verb, expected before it, as " + app.get_name() + " --config FILE " +
             argv[1];
    const std::string present = present_name(word, known);
    const std::string nearest = present.empty() ? nearest_option(word, known) : present;
    return word + ": unknown option" + meant(nearest);
  }
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr)
    if (const std::string word = word_too_many(app); !word.empty())
      return word + ": found a word that no option takes (see --help)";
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr)
    for (const CLI::App* verb : app.get_subcommands())
      if (const std::string name = given_twice(*verb); !name.empty())
        return name + ": given twice, expected once (see --help)";
  return std::string(error.what()) + " (see --help)";
}

/// An empty text is never meant: "-o ''" would write into the working folder.
void check_no_empty_value(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::vector<std::string>& values = option->results();
    if (std::find(values.begin(), values.end(), "") != values.end())
      throw data::InputError(option->get_name() + ": found \"\", expected a value");
  }
  for (const CLI::App* part : app.get_subcommands(nullptr)) check_no_empty_value(*part);
}

}  // namespace

int run_tool(const char* name, const std::function<int()>& body) {
  try {
    return delivered(name, body());
  } catch (const data::InputError& error) {
    return report(name, error.what(), exit_bad_input);
  } catch (const std::system_error& error) {
    return report(name, message_of(error), refuses_path(error.code()) ? exit_bad_input : exit_failed);
  } catch (const std::bad_alloc&) {
    return report(name, "there is not enough memory for a job of this size", exit_failed);
  } catch (const std::length_error&) {
    return report(name, "there is not enough memory for a job of this size", exit_failed);
  } catch (const std::exception& error) {
    return report(name, error.what(), exit_failed);
  }
}

int run_tool(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  occupy_closed_streams();
  std::snprintf(ended_line.data(), ended_line.size(), "\n%s: stopped before the end\n",
                app.get_name().c_str());
  handle_signals(ask_to_stop);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is told by write, as a full disk is
  return run_tool(app.get_name().c_str(), [&] {
    check_verb(app, argc, argv);
    if (CLI::Option* const config = app.get_config_ptr()) config->check(check_config);
    app.allow_config_extras(CLI::config_extras_mode::error);
    name_values(app);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ConfigError& error) {
      throw wrong_config(app, error);
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() == 0) return app.exit(error);
      return report(app.get_name(), wrong_words(app, error, argc, argv), exit_bad_input);
    }
    check_no_empty_value(app);
    handle_signals(end_now);
    end_after_signal();
    return body();
  });
}

const std::atomic<bool>& stop_on_signals() {
  handle_signals(ask_to_stop);
  return stop_asked;
}

const std::atomic<bool>& end_on_signals() {
  handle_signals(ask_to_end);
  return end_asked;
}

void stop_after(double hours) {
  struct sigaction action = {};
  action.sa_handler = stop_as_time_is_over;
  action.sa_flags = SA_RESTART;
  sigaction(SIGALRM, &action, nullptr);
  constexpr double kLongest = 1e8;  // that timers take [s]
  const double seconds = std::min(3600 * hours, kLongest), whole = std::floor(seconds);
  itimerval timer = {};
  timer.it_value.tv_sec = static_cast<time_t>(whole);
  timer.it_value.tv_usec = std::max<suseconds_t>(1, static_cast<suseconds_t>(1e6 * (seconds - whole)));
  setitimer(ITIMER_REAL, &timer, nullptr);
}

void end_after_signal() {
  if (stop_asked) throw data::Stopped();
}

}  // namespace flash
