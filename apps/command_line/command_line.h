#pragma once
#include <atomic>
#include <functional>

namespace CLI {
class App;
}

namespace flash {

/// How the tools end: 0 done, 1 failed, 2 bad usage or input, 3 finished but the answer as a whole cannot be
/// used.
enum ExitCode { exit_done = 0, exit_failed = 1, exit_bad_input = 2, exit_unusable = 3 };

/// Runs the body of a tool and returns its exit code. data::InputError and paths that the file system refuses
/// become 2 and any other exception, data::Stopped too, becomes 1, each as the one line "name: message" on
/// stderr. A result that standard output did not take, because it is full or closed, becomes 1 as well, and
/// so does a body that ended by itself after a signal of stop_on_signals.
int run_tool(const char* name, const std::function<int()>& body);

/// Parses the command line of `app`, then runs `body`. Help and version print and return 0; an unknown verb,
/// a parse error or an empty value returns 2 with one line on stderr, as does a file of --config that is no
/// regular file, is no text, or names an option or a section that the tool does not have.
int run_tool(CLI::App& app, int argc, char** argv, const std::function<int()>& body);

/// A signal before the body begins ends the tool as one between its steps would. In a body that never calls
/// this, Ctrl-C and SIGTERM end the program at once, with one line and exit code 1.
///
/// From now on Ctrl-C and SIGTERM set the flag that this returns, and say at once on stderr that the program
/// stops after the step in work. A second signal ends the program there, with the exit code 128 + signal.
const std::atomic<bool>& stop_on_signals();

/// For a body that goes on until it is told to end: from now on Ctrl-C and SIGTERM set the flag that this
/// returns, in silence, and the exit code is that of the body. A second signal ends the program there, with
/// the exit code 128 + signal.
const std::atomic<bool>& end_on_signals();

/// So many hours from now the flag of stop_on_signals is set, with a line on stderr, as after a signal.
void stop_after(double hours);

/// Between a computation and the writing of its result: throws data::Stopped after a signal.
void end_after_signal();

}  // namespace flash
