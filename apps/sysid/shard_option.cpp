#include "apps/sysid/shard_option.h"

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "apps/command_line/option_checks.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash {
namespace {

constexpr long kMost = 100000;

long slurm_number(const char* name, const std::function<const char*(const char*)>& variable) {
  const char* const text = variable(name);
  const std::optional<long> number = text == nullptr ? std::nullopt : data::parse_integer(text);
  if (!number)
    throw data::InputError("--shard slurm: found " + std::string(name) + " " +
                           (text == nullptr ? "unset" : "\"" + std::string(text) + "\"") +
                           ", expected a whole number, as the tasks of a job array have (sbatch --array)");
  return *number;
}

/// `index` from 1.
sysid::Shard checked(long index, long count, const std::string& found) {
  if (count < 1 || count > kMost || index < 1 || index > count)
    throw data::InputError("--shard: found " + found + ", expected I/N with 1 <= I <= N, or slurm");
  sysid::Shard shard;
  shard.index = static_cast<int>(index) - 1;
  shard.count = static_cast<int>(count);
  return shard;
}

}  // namespace

void add_shard_options(CLI::App& verb, ShardOptions& options) {
  CLI::App& group = *verb.add_option_group("Several programs or machines");
  group.add_option("--shard", options.shard,
                   "Take this share of the simulations, as 2/3, of a search that others take part in by the "
                   "same command and folder; slurm: that of the task of a job array");
  group
      .add_option("--patience", options.patience,
                  "Without a motion of the other shares, after which theirs are simulated here [s]")
      ->check(number_from(0))
      ->capture_default_str();
  group.add_flag("--own-share", options.own_share,
                 "Wait for no other share: end where one is needed, for flash-sysid merge");
}

sysid::Shard parse_shard(const std::string& text, const std::function<const char*(const char*)>& variable) {
  if (text == "slurm") {
    const long first = slurm_number("SLURM_ARRAY_TASK_MIN", variable);
    const long id = slurm_number("SLURM_ARRAY_TASK_ID", variable);
    const long count = slurm_number("SLURM_ARRAY_TASK_COUNT", variable);
    if (count == 1)
      throw data::InputError(
          "--shard slurm: found an array of one task, expected several; a task that is begun again by itself "
          "has --shard I/N");
    return checked(id - first + 1, count,
                   "slurm, task " + std::to_string(id) + " of " + std::to_string(count) + " from " +
                       std::to_string(first) + " on");
  }
  const std::vector<std::string_view> parts = data::split(text, "/");
  const std::optional<long> index = data::parse_integer(parts.front());
  const std::optional<long> count = parts.size() == 2 ? data::parse_integer(parts.back()) : std::nullopt;
  return checked(index.value_or(0), count.value_or(0), "\"" + text + "\"");
}

sysid::Shard shard_of(const ShardOptions& options) {
  if (options.shard.empty()) {
    if (options.own_share)
      throw data::InputError("--own-share: found no --shard, expected the share beside it, as --shard 2/3");
    return {};
  }
  sysid::Shard shard = parse_shard(options.shard);
  shard.patience = options.patience;
  shard.waits = !options.own_share;
  return shard;
}

std::string folder_of_shard(const std::string& out, const sysid::Shard& shard) {
  if (shard.index == 0) return out;
  return (std::filesystem::path(out) / "shards" / std::to_string(shard.index + 1)).string();
}

}  // namespace flash
