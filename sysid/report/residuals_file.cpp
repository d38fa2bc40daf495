#include "sysid/report/residuals_file.h"

#include <algorithm>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/sha256.h"
#include "data/files/text.h"
#include "sysid/emulate/results_table.h"

namespace flash::sysid {
namespace {

const std::vector<std::string> kColumns = {"recording", "t", "channel", "x_m", "y_m", "weight", "left_m"};

}  // namespace

std::string residuals_text(const std::vector<LeftResiduals>& recordings) {
  std::string text;
  for (const std::string& column : kColumns) text += (text.empty() ? "" : ",") + column;
  text += '\n';
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const ObservedRows& rows = recordings[r].rows;
    for (Eigen::Index i = 0; i < rows.weights.size(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      text += std::to_string(r) + ',' +
              data::format_number(rows.times[static_cast<std::size_t>(rows.keyframe[at])]) + ',' +
              std::to_string(rows.channel[at]);
      for (const double value :
           {rows.places(i, 0), rows.places(i, 1), rows.weights[i], recordings[r].left[i]})
        text += ',' + data::format_number(value);
      text += '\n';
    }
  }
  return text;
}

std::string residuals_digest(const std::string& text) { return data::sha256(text).substr(0, 16); }

std::vector<LeftResiduals> load_residuals(const std::string& path, const std::string& digest,
                                          const std::vector<double>& error_costs) {
  if (const std::string found = residuals_digest(data::read_file(path)); found != digest)
    throw data::InputError(path + ": found the digest " + found + ", expected " + digest +
                           " of summary.json beside it; grid --resume writes it anew");
  std::vector<LeftResiduals> recordings(error_costs.size());
  std::vector<std::vector<double>> places(recordings.size()), weights(recordings.size()),
      left(recordings.size());
  for (Table table(path, kColumns, CutLine::refuse); table.row() != nullptr; table.next()) {
    const Row& row = *table.row();
    const auto r = static_cast<std::size_t>(row.index("recording"));
    if (r >= recordings.size()) throw row.error("recording", "below " + std::to_string(recordings.size()));
    ObservedRows& rows = recordings[r].rows;
    const double time = row.finite("t");
    if (rows.times.empty() || rows.times.back() < time) rows.times.push_back(time);
    if (rows.times.back() > time) throw row.error("t", "times that do not decrease");
    rows.keyframe.push_back(static_cast<int>(rows.times.size()) - 1);
    rows.channel.push_back(row.index("channel"));
    for (const char* column : {"x_m", "y_m"}) places[r].push_back(row.finite(column));
    weights[r].push_back(row.not_negative("weight"));
    left[r].push_back(row.finite("left_m"));
  }
  const auto vector = [](const std::vector<double>& values) {
    return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  };
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    if (left[r].empty())
      throw data::InputError(path + ": found no observation of recording " + std::to_string(r));
    recordings[r].rows.places = vector(places[r]).reshaped(2, vector(left[r]).size()).transpose();
    recordings[r].rows.weights = vector(weights[r]);
    recordings[r].left = vector(left[r]);
    recordings[r].error_cost = error_costs[r];
  }
  return recordings;
}

}  // namespace flash::sysid
