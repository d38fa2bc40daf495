#include "data/files/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <list>
#include <random>
#include <regex>
#include <system_error>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

/// No cloud, mesh or picture comes near it: 80 million points of a PLY file, uncompressed.
constexpr std::uintmax_t kLargestFile = 1'000'000'000;  // [bytes]

[[noreturn]] void throw_errno(const std::string& path) {
  throw std::system_error(errno, std::generic_category(), path);
}

/// Beside the file that it becomes by take_place(); else it is removed.
class TemporaryFile {
 public:
  TemporaryFile(const std::string& path, std::string_view contents, Sync sync) : path_(path) {
    const std::filesystem::file_status there = std::filesystem::status(path);
    if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there) &&
        !std::filesystem::is_directory(there))
      throw InputError(path + ": is a device, a pipe or a socket, and is not written over");
    const std::filesystem::path parent = std::filesystem::path(path).parent_path();
    if (!parent.empty()) std::filesystem::create_directories(parent);
    // Programs of two machines, or of two containers, may have one number.
    static std::atomic<unsigned> serial{std::random_device()()};
    const std::string name =
        path + "." + std::to_string(::getpid()) + "-" + std::to_string(serial++) + ".tmp";
    const Descriptor file{::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)};
    if (file.number < 0) throw_errno(path);
    name_ = name;
    if (const int error = write(file.number, contents, sync); error != 0) {
      remove();
      errno = error;
      throw_errno(path);
    }
  }
  ~TemporaryFile() { remove(); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void take_place() {
    if (::rename(name_.c_str(), path_.c_str()) != 0) throw_errno(path_);
    name_.clear();
  }

 private:
  struct Descriptor {
    int number;
    ~Descriptor() {
      if (number >= 0) ::close(number);
    }
  };

  /// 0, or errno of what went wrong.
  static int write(int descriptor, std::string_view contents, Sync sync) {
    while (!contents.empty()) {
      const ssize_t written = ::write(descriptor, contents.data(), contents.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return errno;
      contents.remove_prefix(static_cast<std::size_t>(written));
    }
    return sync == Sync::later || ::fsync(descriptor) == 0 ? 0 : errno;
  }

  void remove() {
    if (!name_.empty()) ::unlink(name_.c_str());
    name_.clear();
  }

  std::string path_, name_;
};

/// Whether a file has the name of a TemporaryFile: path.PID-SERIAL.tmp.
bool is_temporary(const std::filesystem::path& path) {
  static const std::regex name(R"(.+\.\d+-\d+\.tmp)");
  return std::regex_match(path.filename().string(), name);
}

}  // namespace

void write_atomically(const std::string& path, std::string_view contents, Sync sync) {
  TemporaryFile(path, contents, sync).take_place();
}

void write_together(const std::vector<FileText>& files) {
  std::list<TemporaryFile> temporary;
  for (const FileText& file : files)
    if (!file.path.empty()) temporary.emplace_back(file.path, file.text, Sync::now);
  for (TemporaryFile& file : temporary) file.take_place();
}

void remove_leftovers(const std::string& folder, const std::set<std::string>& spared) {
  std::vector<std::filesystem::path> left;
  using Iterator = std::filesystem::recursive_directory_iterator;
  for (Iterator entry(folder); entry != Iterator(); ++entry) {
    if (entry.depth() == 0 && spared.contains(entry->path().filename().string()))
      entry.disable_recursion_pending();
    if (is_temporary(entry->path()) && std::filesystem::is_regular_file(entry->symlink_status()))
      left.push_back(entry->path());
  }
  for (const std::filesystem::path& path : left) std::filesystem::remove(path);
}

void remove_old_leftovers(const std::string& folder, const std::string& extension) {
  const auto day_ago = std::filesystem::file_time_type::clock::now() - std::chrono::hours(24);
  std::vector<std::filesystem::path> left;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (is_temporary(entry.path()) && entry.path().stem().stem().extension() == extension &&
        std::filesystem::is_regular_file(entry.symlink_status()))
      left.push_back(entry.path());
  for (const std::filesystem::path& path : left) {
    std::error_code gone;  // another program may have been quicker
    const auto written = std::filesystem::last_write_time(path, gone);
    if (!gone && written < day_ago) std::filesystem::remove(path, gone);
  }
}

std::string read_file(const std::string& path) {
  std::error_code code;
  const std::filesystem::file_status status = std::filesystem::status(path, code);
  if (std::filesystem::is_directory(status)) throw InputError(path + ": is a folder, expected a file");
  if (!std::filesystem::is_regular_file(status) && std::filesystem::exists(status))
    throw InputError(path + ": is a device, a pipe or a socket, expected a file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError(path + ": cannot be read: " + std::strerror(errno));
  const std::uintmax_t size = std::filesystem::file_size(path);
  if (size > kLargestFile)
    throw InputError(path + ": found " + format_count(size) + " bytes, expected at most " +
                     format_count(kLargestFile));
  std::string contents(size, '\0');
  stream.read(contents.data(), static_cast<std::streamsize>(size));
  contents.resize(static_cast<std::size_t>(stream.gcount()));
  return contents;
}

std::string resolve_path(const std::string& path, const std::string& referring_file) {
  const std::filesystem::path given(path);
  if (given.is_absolute()) return path;
  return (std::filesystem::path(referring_file).parent_path() / given).lexically_normal().string();
}

std::string relative_path(const std::string& path, const std::string& referring_file) {
  const std::filesystem::path folder =
      std::filesystem::absolute(referring_file).parent_path().lexically_normal();
  return std::filesystem::absolute(path).lexically_normal().lexically_relative(folder).string();
}

}  // namespace flash::data
