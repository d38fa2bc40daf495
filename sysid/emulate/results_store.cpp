#include "sysid/emulate/results_store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/folder_lock.h"
#include "data/files/text.h"
#include "sysid/emulate/candidate_lines.h"
#include "sysid/emulate/fingerprint.h"
#include "sysid/emulate/results_reader.h"

namespace flash::sysid {
namespace {

namespace fs = std::filesystem;

std::string path_of(const std::string& folder, const char* file) {
  return (fs::path(folder) / file).string();
}

std::string header_of(const std::vector<std::string>& columns) {
  std::string header;
  for (const std::string& column : columns) header += (header.empty() ? "" : ",") + column;
  return header + "\n";
}

/// At the end of the file, and on the disk when it returns.
void append_text(const std::string& path, std::string_view text) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  bool done = descriptor >= 0;
  while (done && !text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    done = written >= 0;
    if (done) text.remove_prefix(static_cast<std::size_t>(written));
  }
  done = done && ::fdatasync(descriptor) == 0;
  const int reason = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!done) throw std::runtime_error(path + ": cannot be written: " + std::strerror(reason));
}

struct NamedHeader {
  const char* table;
  std::string header;
};

/// In the order of result_tables.
std::vector<NamedHeader> headers(const std::vector<Axis>& axes) {
  return {{"results.csv", header_of(results_columns(axes))},
          {"registrations.csv", header_of(registrations_columns())},
          {"keyframes.csv", header_of(keyframes_columns())}};
}

/// Leaves of a file the header and the whole lines whose id is one of `ids`.
void keep_lines_of(const std::string& path, const std::string& header, const std::set<int>& ids) {
  const std::string text = data::read_file(path);
  std::string kept;
  data::LineReader lines(std::string_view(text).substr(0, text.rfind('\n') + 1));
  std::string_view line;
  while (lines.next(line)) {
    const std::optional<long> id = data::parse_integer(line.substr(0, line.find(',')));
    const bool is_header = lines.number() == 1;
    if (is_header || (id && ids.count(data::to_index(static_cast<double>(*id))) > 0))
      kept += std::string(line) + '\n';
  }
  if (kept.empty()) kept = header;
  if (kept != text) data::write_atomically(path, kept);
}

/// Beside grid.json and the tables.
constexpr const char* kAnswers[] = {"summary.json", "residuals.csv", "report.html", "best"};

/// Throws where the folder holds what a search would write over. A table without lines does not count: a
/// search that was killed before its grid.json was written leaves it.
void check_holds_nothing(const std::string& folder, const std::vector<Axis>& axes) {
  const auto expect_none = [&](const char* name, const std::string& without_lines) {
    const std::string path = path_of(folder, name);
    if (!fs::exists(path)) return;
    if (!without_lines.empty() && fs::is_regular_file(path)) {
      const std::string text = data::read_file(path);
      if (text.empty() || text == without_lines) return;
    }
    throw data::InputError(folder + ": found " + name +
                           " without the grid.json of its search, expected a folder without results; name "
                           "another folder, or --force to overwrite");
  };
  for (const auto& [table, header] : headers(axes)) expect_none(table, header);
  for (const char* name : kAnswers) expect_none(name, "");
}

/// Those that another program may be writing to: all but its own.
std::set<std::string> folders_of_others(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && entry.path().filename() != "best")
      names.insert(entry.path().filename().string());
  return names;
}

void expect_no_shares(const std::string& folder) {
  for (const std::string& share : share_folders(folder)) data::expect_not_held(share);
}

void remove_own_files(const std::string& folder) {
  fs::remove(fs::path(folder) / "grid.json");
  for (const char* table : result_tables) fs::remove(fs::path(folder) / table);
  for (const char* name : kAnswers) fs::remove_all(fs::path(folder) / name);
}

/// Of the search and of its shares; what else lies there stays.
void remove_results(const std::string& folder) {
  remove_own_files(folder);
  std::error_code holds_more;
  for (const std::string& share : share_folders(folder)) {
    remove_own_files(share);
    fs::remove(path_of(share, data::search_lock));
    fs::remove(share, holds_more);
  }
  if (const fs::path shares = fs::path(folder) / "shards"; fs::is_directory(fs::symlink_status(shares)))
    if (fs::is_empty(shares)) fs::remove(shares, holds_more);
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

ResultsStore::ResultsStore(const std::string& folder, const std::vector<Axis>& axes,
                           const std::vector<std::string>& recordings, const Fingerprint& fingerprint,
                           Existing existing, Writers writers)
    : folder_(folder) {
  const bool holds_search = fs::exists(path_of(folder, "grid.json"));
  if (!holds_search && existing != Existing::replace) check_holds_nothing(folder, axes);
  data::expect_not_held(folder);
  if (writers == Writers::one) expect_no_shares(folder);
  fs::create_directories(folder);
  lock_ = ::open(path_of(folder, data::search_lock).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0) throw std::system_error(errno, std::generic_category(), folder);
  try {
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0)
      throw data::InputError(folder + ": another run is writing to it; wait for it, or name another folder");
    if (writers == Writers::one) expect_no_shares(folder);  // one may have begun since
    data::remove_leftovers(folder,
                           writers == Writers::several ? folders_of_others(folder) : std::set<std::string>());
    if (existing == Existing::replace) remove_results(folder);
    if (!fs::exists(path_of(folder, "grid.json")))
      begin(axes, recordings, fingerprint);
    else if (existing == Existing::resume)
      go_on(axes, recordings, fingerprint);
    else
      throw data::InputError(folder + ": holds results already; go on with --resume, or name another folder");
  } catch (...) {
    ::close(lock_);
    throw;
  }
}

ResultsStore::~ResultsStore() { ::close(lock_); }

void ResultsStore::begin(const std::vector<Axis>& axes, const std::vector<std::string>& recordings,
                         const Fingerprint& fingerprint) {
  results_.axes = axes;
  results_.recordings = recordings;
  for (const auto& [table, header] : headers(axes)) data::write_atomically(path_of(folder_, table), header);
  const GridFile grid{axes, recordings, fingerprint};
  search_ = search_digest(grid);
  save_grid_file(grid, path_of(folder_, "grid.json"));  // last: all is there
}

void ResultsStore::go_on(const std::vector<Axis>& axes, const std::vector<std::string>& recordings,
                         const Fingerprint& fingerprint) {
  const GridFile grid = load_grid_file(path_of(folder_, "grid.json"));
  const std::string changed = grid.fingerprint ? difference(*grid.fingerprint, fingerprint)
                                               : "they come from another version of the program";
  if (!changed.empty()) {
    throw data::InputError(folder_ + ": --resume: these are not the inputs and settings of its results: " +
                           changed + "; name another folder, or repeat the first command");
  }
  if (recordings != grid.recordings)
    throw data::InputError(folder_ + ": --resume: found the recordings " + listed(recordings) +
                           ", expected " + listed(grid.recordings) + ", in the order of its results");
  search_ = search_digest(grid);
  results_ = load_grid_results(folder_, Incomplete::leave_out);
  std::set<int> ids;
  for (const CandidateResult& result : results_.candidates) ids.insert(result.id);
  for (const auto& [table, header] : headers(axes)) keep_lines_of(path_of(folder_, table), header, ids);
}

void ResultsStore::append(const std::vector<CandidateResult>& batch) {
  std::string registrations, keyframes, lines;
  std::vector<CandidateResult> written = batch;
  for (CandidateResult& result : written) {
    const CandidateLines text = lines_of(result, results_.recordings);
    result.digest = digest_of(text, search_);
    lines += text.result + ',' + result.digest + '\n';
    registrations += text.registrations;
    keyframes += text.keyframes;
  }
  append_text(path_of(folder_, "keyframes.csv"), keyframes);
  append_text(path_of(folder_, "registrations.csv"), registrations);
  append_text(path_of(folder_, "results.csv"), lines);
  for (CandidateResult& result : written) {
    const auto place = std::lower_bound(results_.candidates.begin(), results_.candidates.end(), result,
                                        [](const auto& a, const auto& b) { return a.id < b.id; });
    results_.candidates.insert(place, std::move(result));
  }
}

bool ResultsStore::contains(int id) const {
  return std::any_of(results_.candidates.begin(), results_.candidates.end(),
                     [&](const CandidateResult& result) { return result.id == id; });
}

}  // namespace flash::sysid
