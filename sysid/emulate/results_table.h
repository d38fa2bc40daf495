#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sysid {

/// A field of a line of comma-separated values: quoted where it holds a comma or a quote.
std::string quoted_field(const std::string& text);

/// One line, by the names of its columns; `line` must outlive it. What it refuses throws data::InputError
/// with file, line and column.
class Row {
 public:
  Row(const std::vector<std::string>& names, std::string_view line, std::string place);

  std::string_view line() const { return line_; }
  const std::string& text(const std::string& name) const;
  double finite(const std::string& name) const;
  double not_negative(const std::string& name) const;  ///< infinite where there is none
  double score(const std::string& name) const;  ///< a distance of points [m]; infinite where there is none
  bool boolean(const std::string& name) const;
  int index(const std::string& name) const;  ///< a whole number from 0

  /// "results.csv:3: score_m: found "x", expected ...".
  data::InputError error(const std::string& name, const std::string& expected) const;
  /// Throws it unless the column holds the number, or the text.
  void expect(const std::string& name, double value, const std::string& why) const;
  void expect(const std::string& name, const std::string& value, const std::string& why) const;

 private:
  double number(const std::string& name) const;

  const std::vector<std::string>* names_;
  std::string_view line_;
  std::vector<std::string> fields_;
  std::string place_;
};

/// What becomes of a last line without its end, which a search that was killed leaves, and of a file without
/// a header, which a disk that lost its power can leave: it counts as one without lines.
enum class CutLine { refuse, leave_out };

/// The lines of a file of comma-separated values one by one, after a header with the names of the columns.
class Table {
 public:
  /// Stands at the first line. Throws data::InputError naming the file: a header of other columns, or a cut
  /// line to refuse.
  Table(std::string path, std::vector<std::string> columns, CutLine cut);
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  const Row* row() const { return row_ ? &*row_ : nullptr; }  ///< none: the end
  void next();
  const std::string& path() const { return path_; }

 private:
  std::string path_, text_;
  data::LineReader lines_;
  std::vector<std::string> names_;
  std::optional<Row> row_;
};

}  // namespace flash::sysid
