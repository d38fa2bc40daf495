#include "data/recording/marker_tracks.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

constexpr std::string_view kTracks = "t,marker,x,y,z", kPlaces = "marker,x,y,z";

/// Lines of a table of texts and numbers; `named`: the column of the marker's name.
class TableReader {
 public:
  TableReader(const std::string& path, std::string_view header, std::size_t named)
      : path_(path), header_(header), named_(named), text_(read_file(path)), lines_(text_) {
    std::string_view line;
    if (!lines_.next(line) || line != header)
      throw input_error(path, "line 1", "expected the header " + std::string(header));
  }

  /// Takes the next line that is not empty; false at the end.
  bool next() {
    std::string_view line;
    do
      if (!lines_.next(line)) return false;
    while (line.empty());
    const std::vector<std::string_view> cells = split(line, ",");
    if (cells.size() != split(header_, ",").size() || cells[named_].empty())
      throw error("found \"" + std::string(line) + "\", expected " + std::string(header_));
    name = std::string(cells[named_]);
    numbers.clear();
    for (std::size_t k = 0; k < cells.size(); ++k) {
      if (k == named_) continue;
      const std::optional<double> value = parse_number(cells[k]);
      if (!value || !std::isfinite(*value))
        throw error("found \"" + std::string(cells[k]) +
                    "\", expected a finite number; leave the line out where a marker was not seen");
      numbers.push_back(*value);
    }
    return true;
  }

  InputError error(const std::string& what) const {
    return input_error(path_, "line " + std::to_string(lines_.number()), what);
  }

  std::string name;             ///< of the line's marker
  std::vector<double> numbers;  ///< its other columns

 private:
  const std::string& path_;
  std::string_view header_;
  std::size_t named_;
  std::string text_;
  LineReader lines_;
};

}  // namespace

MarkerTracks load_marker_tracks(const std::string& path) {
  std::vector<std::vector<std::pair<std::string, Eigen::Vector3d>>> seen;
  std::vector<double> times;
  std::set<std::string> names;
  TableReader table(path, kTracks, 1);
  while (table.next()) {
    const double time = table.numbers[0];
    if (times.empty() || time > times.back()) {
      times.push_back(time);
      seen.emplace_back();
    } else if (time < times.back()) {
      throw table.error("found t = " + format_number(time) + " after " + format_number(times.back()) +
                        ", expected times that do not fall");
    }
    for (const auto& [name, position] : seen.back())
      if (name == table.name)
        throw table.error("found marker " + name + " twice at t = " + format_number(time) +
                          ", expected once");
    seen.back().emplace_back(table.name,
                             Eigen::Vector3d(table.numbers[1], table.numbers[2], table.numbers[3]));
    names.insert(table.name);
  }
  if (times.empty()) throw input_error(path, "line 2", "missing, expected at least one marker");
  MarkerTracks tracks{{names.begin(), names.end()}, {}};
  for (std::size_t k = 0; k < times.size(); ++k) {
    std::sort(seen[k].begin(), seen[k].end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    MarkerSample& sample = tracks.samples.emplace_back();
    sample.time = times[k];
    sample.positions.resize(static_cast<Eigen::Index>(seen[k].size()), 3);
    for (std::size_t i = 0; i < seen[k].size(); ++i) {
      const auto at = std::lower_bound(tracks.names.begin(), tracks.names.end(), seen[k][i].first);
      sample.markers.push_back(static_cast<int>(at - tracks.names.begin()));
      sample.positions.row(static_cast<Eigen::Index>(i)) = seen[k][i].second.transpose();
    }
  }
  return tracks;
}

void save_marker_tracks(const MarkerTracks& tracks, const std::string& path) {
  std::string text = std::string(kTracks) + "\n";
  for (const MarkerSample& sample : tracks.samples)
    for (std::size_t i = 0; i < sample.markers.size(); ++i) {
      text += format_number(sample.time) + "," + tracks.names[static_cast<std::size_t>(sample.markers[i])];
      for (int k = 0; k < 3; ++k)
        text += "," + format_number(sample.positions(static_cast<Eigen::Index>(i), k));
      text += "\n";
    }
  write_atomically(path, text);
}

std::map<std::string, Eigen::Vector3d> load_marker_places(const std::string& path) {
  std::map<std::string, Eigen::Vector3d> places;
  TableReader table(path, kPlaces, 0);
  while (table.next()) {
    const Eigen::Vector3d place(table.numbers[0], table.numbers[1], table.numbers[2]);
    if (!places.emplace(table.name, place).second)
      throw table.error("found marker " + table.name + " twice, expected once");
  }
  return places;
}

}  // namespace flash::data
