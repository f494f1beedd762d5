// SPDX-License-Identifier: Apache-2.0
// The tables of both formats as points. What is not taken from a file is counted in Cloud::left_out.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "nodes/cloud/cloud_file.hpp"
#include "nodes/cloud/cloud_input.hpp"
#include "nodes/cloud/point_rows.hpp"

namespace takt::cloud {
namespace {

/// Values of a table in text. A row is a line; `streamed`: lines mean nothing, as the PLY format allows.
class TextRows {
 public:
  TextRows(Input& input, bool streamed) : input_(input), streamed_(streamed) {}
  static constexpr size_t kLeastBytes = 2;  ///< a digit and what parts it from the next

  void begin() {
    if (streamed_) return;
    take_line("another row of values");
  }
  double value(Kind kind) {
    if (next_ == words_.size() && !streamed_) input_.bad_line(fmt::format("{} values, expected more", words_.size()));
    if (next_ == words_.size()) take_line("another value");
    const std::string_view word = words_[next_++];
    return visit_kind(kind, [&](auto zero) { return number<decltype(zero)>(word); });
  }
  void end() {
    if (!streamed_ && next_ != words_.size())
      input_.bad_line(fmt::format("{} values, expected {}", words_.size(), next_));
  }
  /// Of the last table: nothing but blanks follows.
  bool used_up() const {
    return next_ == words_.size() && input_.rest().find_first_not_of(" \t\r\n") == std::string_view::npos;
  }
  [[noreturn]] void bad(const std::string& what) const { input_.bad_line(what); }

 private:
  void take_line(std::string_view expected) {
    do words_ = words_of(input_.line(expected));
    while (words_.empty());
    next_ = 0;
  }

  /// As a double, which keeps digits of a coordinate that a float does not.
  template <class T>
  double number(std::string_view word) const {
    double value = 0;
    const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
    const char* end = word.data() + word.size();
    const auto [used, error] = std::from_chars(begin, end, value);
    if (error == std::errc::result_out_of_range && used == end) value = std::strtod(std::string(word).c_str(), nullptr);
    const bool is_number = error != std::errc::invalid_argument && used == end;
    if constexpr (std::is_floating_point_v<T>) {
      if (!is_number) input_.bad_line(fmt::format("`{}`, expected a number", shown(word)));
    } else if (!is_number || value != std::floor(value) || value < static_cast<double>(std::numeric_limits<T>::min()) ||
               value > static_cast<double>(std::numeric_limits<T>::max())) {  // 255.0 is a whole number
      input_.bad_line(fmt::format("`{}`, expected a whole number in {}..{}", shown(word), std::numeric_limits<T>::min(),
                                  std::numeric_limits<T>::max()));
    }
    return value;
  }

  Input& input_;
  const bool streamed_;
  std::vector<std::string_view> words_;
  size_t next_ = 0;
};

/// Values of a table in bytes.
class BinaryRows {
 public:
  BinaryRows(Input& input, bool) : input_(input) {}
  static constexpr size_t kLeastBytes = 1;

  void begin() {}
  double value(Kind kind) {
    return visit_kind(kind, [&](auto zero) { return static_cast<double>(input_.value<decltype(zero)>()); });
  }
  void end() {}
  bool used_up() const { return true; }
  [[noreturn]] void bad(const std::string& what) const { input_.bad_byte(what); }

 private:
  Input& input_;
};

template <class Rows>
uint64_t length_of(const Column& column, Rows& rows) {
  if (!column.length) return column.count;
  const double length = rows.value(*column.length);
  if (length >= 0 && length == std::floor(length) && length <= std::numeric_limits<uint32_t>::max())
    return static_cast<uint64_t>(length);
  rows.bad(fmt::format("a list of {} values, expected a whole number", length));
}

/// Values that each row has at least.
uint64_t least_values(const Table& table) {
  constexpr uint64_t kEnough = uint64_t{1} << 32;
  uint64_t sum = 0;
  for (const Column& column : table.columns) sum += column.length ? 1 : std::min(column.count, kEnough);
  return sum;
}

/// Reads every row; `each(column, value)` gets the first value of each column, `done()` the end of a row.
template <class Rows, class Each, class Done>
void read_rows(const Table& table, Rows& rows, const Each& each, const Done& done) {
  if (least_values(table) == 0) return;
  for (uint64_t row = 0; row < table.rows; ++row) {
    rows.begin();
    for (size_t c = 0; c < table.columns.size(); ++c) {
      const uint64_t length = length_of(table.columns[c], rows);
      for (uint64_t i = 0; i < length; ++i) {
        const double value = rows.value(table.columns[c].kind);
        if (i == 0) each(c, value);
      }
    }
    rows.end();
    done();
  }
}

/// A count that is wrong must not make us ask for the memory.
template <class Rows>
void check_room(const Table& table, const Input& input) {
  if (const uint64_t values = least_values(table);
      values > 0 && table.rows > input.left() / (Rows::kLeastBytes * values) + 1)
    input.bad_line(
        fmt::format("{} rows of {} values were announced, {} bytes follow", table.rows, values, input.left()));
}

template <class Rows>
Cloud read_tables(const Header& header, Input& input, bool streamed) {
  Rows rows(input, streamed);
  const auto pass_over = [&](const Table& table) {
    check_room<Rows>(table, input);
    read_rows(
        table, rows, [](size_t, double) {}, [] {});
  };
  for (size_t i = 0; i + 1 < header.tables.size(); ++i) pass_over(header.tables[i]);
  const Table& points = header.tables.back();
  check_room<Rows>(points, input);
  PointRows cloud(points, input);
  read_rows(
      points, rows, [&](size_t column, double value) { cloud.set(column, value); }, [&] { cloud.push(); });
  if (!streamed) return cloud.take(header);
  for (const Table& table : header.behind) pass_over(table);
  if (!rows.used_up()) rows.bad("more values than were announced");
  Cloud result = cloud.take(header);
  result.left_out.push_back("rows are not lines: the values are read one after the other");
  return result;
}

/// Rows as lines; where that fails, as one stream of values that must come out even.
Cloud read_text(const Header& header, const Input& input) {
  Input lines = input, stream = input;
  try {
    return read_tables<TextRows>(header, lines, false);
  } catch (const Bad& by_lines) {
    try {
      return read_tables<TextRows>(header, stream, true);
    } catch (const Bad&) {
      throw by_lines;
    }
  }
}

}  // namespace

tl::expected<Cloud, std::string> parse_cloud(std::string_view bytes, const std::string& name) {
  try {
    if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);  // a byte order mark
    Input input(bytes, name);
    Input start = input;
    const auto words = words_of(start.line("the first line of a PLY or PCD file"));
    const bool ply = words.size() == 1 && words[0] == "ply";
    const Header header = ply ? ply_header(start) : pcd_header(input);
    Input& rest = ply ? start : input;
    if (header.layout == Layout::ascii) return read_text(header, rest);
    if (header.layout == Layout::binary_swapped) rest.swap_bytes();
    if (header.layout != Layout::compressed) return read_tables<BinaryRows>(header, rest, false);
    const std::string rows = unpack_columns(rest, header.tables.back());
    Input unpacked(rows, name);
    return read_tables<BinaryRows>(header, unpacked, false);
  } catch (const Bad& bad) {
    return tl::make_unexpected(bad.text);
  }
}

}  // namespace takt::cloud
