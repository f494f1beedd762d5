// SPDX-License-Identifier: Apache-2.0
// Both formats are a text header that names the columns of a table, and the table itself, as text or as bytes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "nodes/cloud/cloud_file.hpp"
#include "rt/msg/point.hpp"

namespace takt::cloud {
namespace {

/// What is wrong, and where; parse_cloud returns it.
struct Bad {
  std::string text;
};

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  constexpr std::string_view kBlank = " \t";
  for (size_t from = line.find_first_not_of(kBlank); from != std::string_view::npos;) {
    const size_t to = std::min(line.find_first_of(kBlank, from), line.size());
    words.push_back(line.substr(from, to - from));
    from = line.find_first_not_of(kBlank, to);
  }
  return words;
}

/// Part of a file as it may stand in an error: what is no text is shown as `?`.
std::string shown(std::string_view text) {
  std::string out(text.substr(0, 60));
  for (char& c : out)
    if (c < ' ' || c > '~') c = '?';
  return out;
}

/// A file in memory, and how far it was read.
class Input {
 public:
  Input(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  bool at_end() const { return at_ == bytes_.size(); }
  size_t left() const { return bytes_.size() - at_; }

  /// The next line, without its end.
  std::string_view line(std::string_view expected) {
    ++line_;
    if (at_end()) bad_line(fmt::format("the file ends, expected {}", expected));
    const size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    std::string_view line = bytes_.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes_.size());
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  template <class T>
  T value() {
    if (left() < sizeof(T))
      bad_byte(fmt::format("{} bytes left, expected {} more for the next value", left(), sizeof(T)));
    T value;
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  [[noreturn]] void bad_line(const std::string& what) const { throw Bad{fmt::format("{}:{}: {}", name_, line_, what)}; }
  [[noreturn]] void bad_byte(const std::string& what) const {
    throw Bad{fmt::format("{}: byte {}: {}", name_, at_, what)};
  }

 private:
  std::string_view bytes_;
  const std::string& name_;
  size_t at_ = 0, line_ = 0;
};

enum class Kind : uint8_t { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

template <class Visit>
auto visit_kind(Kind kind, const Visit& visit) {
  switch (kind) {
    case Kind::i8: return visit(int8_t{});
    case Kind::u8: return visit(uint8_t{});
    case Kind::i16: return visit(int16_t{});
    case Kind::u16: return visit(uint16_t{});
    case Kind::i32: return visit(int32_t{});
    case Kind::u32: return visit(uint32_t{});
    case Kind::i64: return visit(int64_t{});
    case Kind::u64: return visit(uint64_t{});
    case Kind::f32: return visit(float{});
    case Kind::f64: break;
  }
  return visit(double{});
}

struct Column {
  std::string name;
  Kind kind = Kind::f32;
  std::optional<Kind> length;  ///< of a list: the kind of the number that stands before it
  uint64_t count = 1;          ///< values, where it is no list
};

struct Table {
  std::string name;
  uint64_t rows = 0;
  std::vector<Column> columns;
};

struct Header {
  Encoding encoding = Encoding::binary;
  std::vector<Table> tables;
};

/// Values of a table in text, a row a line.
class TextRows {
 public:
  explicit TextRows(Input& input) : input_(input) {}
  static constexpr size_t kLeastBytes = 2;  ///< a digit and what parts it from the next

  void begin() {
    do words_ = words_of(input_.line("another row of values"));
    while (words_.empty());
    next_ = 0;
  }
  double value(Kind kind) {
    if (next_ == words_.size()) input_.bad_line(fmt::format("{} values, expected more", words_.size()));
    return visit_kind(kind, [&](auto zero) { return static_cast<double>(number<decltype(zero)>(words_[next_++])); });
  }
  void end() {
    if (next_ != words_.size()) input_.bad_line(fmt::format("{} values, expected {}", words_.size(), next_));
  }
  [[noreturn]] void bad(const std::string& what) const { input_.bad_line(what); }

 private:
  template <class T>
  T number(std::string_view word) const {
    T value{};
    const char* end = word.data() + word.size();
    const auto [used, error] = std::from_chars(word.data() + (word.starts_with('+') ? 1 : 0), end, value);
    if (error == std::errc{} && used == end) return value;
    if constexpr (std::is_floating_point_v<T>) input_.bad_line(fmt::format("`{}`, expected a number", shown(word)));
    else
      input_.bad_line(fmt::format("`{}`, expected a whole number in {}..{}", shown(word), std::numeric_limits<T>::min(),
                                  std::numeric_limits<T>::max()));
  }

  Input& input_;
  std::vector<std::string_view> words_;
  size_t next_ = 0;
};

/// Values of a table in bytes.
class BinaryRows {
 public:
  explicit BinaryRows(Input& input) : input_(input) {}
  static constexpr size_t kLeastBytes = 1;

  void begin() {}
  double value(Kind kind) {
    return visit_kind(kind, [&](auto zero) { return static_cast<double>(input_.value<decltype(zero)>()); });
  }
  void end() {}
  [[noreturn]] void bad(const std::string& what) const { input_.bad_byte(what); }

 private:
  Input& input_;
};

/// What a column means to us.
enum Role : uint8_t { kX, kY, kZ, kRed, kGreen, kBlue, kPacked, kRoles, kNone };

Role role_of(const std::string& name) {
  constexpr std::array<std::string_view, kRoles> kNames{"x", "y", "z", "red", "green", "blue", "rgb"};
  const auto found = std::find(kNames.begin(), kNames.end(), name == "rgba" ? "rgb" : name);
  return found == kNames.end() ? kNone : static_cast<Role>(found - kNames.begin());
}

/// A row of the table of points, as far as it means something to us.
class PointRow {
 public:
  PointRow(const Table& table, const Input& input) {
    for (const Column& column : table.columns) {
      Role role = role_of(column.name);
      if (role != kNone && (kinds_[role] || column.length || column.count != 1)) role = kNone;  // the first one counts
      if (role != kNone) kinds_[role] = column.kind;
      roles_.push_back(role);
    }
    for (const Role role : {kX, kY, kZ})
      if (!kinds_[role])
        input.bad_line(fmt::format("{} has no column {}, expected x, y and z", table.name, "xyz"[role]));
    for (const Role role : {kRed, kGreen, kBlue})
      if (kinds_[role] && kinds_[role] != Kind::u8) input.bad_line("red, green and blue are expected to be uchar");
    if (kinds_[kPacked] && kinds_[kPacked] != Kind::f32 && kinds_[kPacked] != Kind::u32 && kinds_[kPacked] != Kind::i32)
      input.bad_line("a packed colour is expected to be of TYPE F or U and SIZE 4");
  }

  void set(size_t column, double value) {
    if (roles_[column] != kNone) values_[roles_[column]] = value;
  }
  bool coloured() const { return kinds_[kPacked] || (kinds_[kRed] && kinds_[kGreen] && kinds_[kBlue]); }
  Point point() const {
    return {static_cast<float>(values_[kX]), static_cast<float>(values_[kY]), static_cast<float>(values_[kZ])};
  }
  Colour colour() const {
    if (!kinds_[kPacked])
      return {static_cast<uint8_t>(values_[kBlue]), static_cast<uint8_t>(values_[kGreen]),
              static_cast<uint8_t>(values_[kRed])};
    const uint32_t rgb = kinds_[kPacked] == Kind::f32 ? std::bit_cast<uint32_t>(static_cast<float>(values_[kPacked]))
                                                      : static_cast<uint32_t>(static_cast<int64_t>(values_[kPacked]));
    return {static_cast<uint8_t>(rgb), static_cast<uint8_t>(rgb >> 8), static_cast<uint8_t>(rgb >> 16)};
  }

 private:
  std::vector<Role> roles_;  ///< of each column
  std::array<std::optional<Kind>, kRoles> kinds_;
  std::array<double, kRoles> values_{};
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
void read_rows(const Table& table, Input& input, const Each& each, const Done& done) {
  if (least_values(table) == 0) return;
  Rows rows(input);
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

template <class Rows>
Cloud read_tables(const Header& header, Input& input) {
  Cloud cloud;
  for (const Table& table : header.tables) {
    // A count that is wrong must not make us ask for the memory.
    if (const uint64_t values = least_values(table);
        values > 0 && table.rows > input.left() / (Rows::kLeastBytes * values) + 1)
      input.bad_line(
          fmt::format("{} rows of {} values were announced, {} bytes follow", table.rows, values, input.left()));
    if (&table != &header.tables.back()) {
      read_rows<Rows>(
          table, input, [](size_t, double) {}, [] {});
      continue;
    }
    PointRow row(table, input);
    cloud.points.reserve(table.rows);
    if (row.coloured()) cloud.colours.reserve(table.rows);
    read_rows<Rows>(
        table, input, [&row](size_t column, double value) { row.set(column, value); },
        [&] {
          cloud.points.push_back(row.point());
          if (row.coloured()) cloud.colours.push_back(row.colour());
        });
  }
  return cloud;
}

uint64_t count_in(std::string_view word, const Input& input) {
  uint64_t value = 0;
  const auto [used, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || used != word.data() + word.size())
    input.bad_line(fmt::format("`{}`, expected a count", shown(word)));
  return value;
}

Kind ply_kind(std::string_view word, const Input& input) {
  constexpr std::pair<std::string_view, Kind> kKinds[] = {
      {"char", Kind::i8},   {"uchar", Kind::u8},   {"short", Kind::i16},   {"ushort", Kind::u16},
      {"int", Kind::i32},   {"uint", Kind::u32},   {"float", Kind::f32},   {"double", Kind::f64},
      {"int8", Kind::i8},   {"uint8", Kind::u8},   {"int16", Kind::i16},   {"uint16", Kind::u16},
      {"int32", Kind::i32}, {"uint32", Kind::u32}, {"float32", Kind::f32}, {"float64", Kind::f64}};
  for (const auto& [name, kind] : kKinds)
    if (word == name) return kind;
  input.bad_line(
      fmt::format("`{}`, expected a type: char, uchar, short, ushort, int, uint, float, double", shown(word)));
}

/// The header of a PLY file, whose first line was read. Tables up to that of the vertices; none behind it matters.
Header ply_header(Input& input) {
  Header header;
  bool encoded = false, past_vertices = false;
  for (;;) {
    const std::string_view line = input.line("end_header");
    const auto words = words_of(line);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() == 3) {
      if (words[1] != "ascii" && words[1] != "binary_little_endian")
        input.bad_line(fmt::format("format {}, expected ascii or binary_little_endian", shown(words[1])));
      header.encoding = words[1] == "ascii" ? Encoding::ascii : Encoding::binary;
      encoded = true;
    } else if (words[0] == "element" && words.size() == 3) {
      past_vertices = past_vertices || (!header.tables.empty() && header.tables.back().name == "vertex");
      if (!past_vertices) header.tables.push_back({std::string(words[1]), count_in(words[2], input), {}});
    } else if (words[0] == "property" && words.size() == 3 && !header.tables.empty()) {
      if (!past_vertices)
        header.tables.back().columns.push_back({std::string(words[2]), ply_kind(words[1], input), std::nullopt, 1});
    } else if (words[0] == "property" && words.size() == 5 && words[1] == "list" && !header.tables.empty()) {
      if (!past_vertices)
        header.tables.back().columns.push_back(
            {std::string(words[4]), ply_kind(words[3], input), ply_kind(words[2], input), 1});
    } else {
      input.bad_line(
          fmt::format("`{}`, expected format TYPE VERSION, element NAME COUNT, property TYPE NAME, property list TYPE "
                      "TYPE NAME, comment or end_header",
                      shown(line)));
    }
  }
  if (!encoded) input.bad_line("the header ends without a line `format`, expected ascii or binary_little_endian");
  if (header.tables.empty() || header.tables.back().name != "vertex")
    input.bad_line("the header ends without `element vertex`");
  return header;
}

Kind pcd_kind(std::string_view type, uint64_t size, const Input& input) {
  if (type == "F" && size == 4) return Kind::f32;
  if (type == "F" && size == 8) return Kind::f64;
  constexpr Kind kSigned[] = {Kind::i8, Kind::i16, Kind::i32, Kind::i64},
                 kUnsigned[] = {Kind::u8, Kind::u16, Kind::u32, Kind::u64};
  if ((type == "I" || type == "U") && size <= 8 && std::has_single_bit(size))
    return (type == "I" ? kSigned : kUnsigned)[std::countr_zero(size)];
  input.bad_line(fmt::format("TYPE {} of SIZE {}, expected F of 4 or 8, or I or U of 1, 2, 4 or 8", shown(type), size));
}

/// The header of a PCD file.
Header pcd_header(Input& input) {
  std::vector<std::string> fields, types;
  std::vector<uint64_t> sizes, counts;
  std::optional<uint64_t> width, height, points;
  for (;;) {
    const std::string_view line = input.line("DATA");
    const auto words = words_of(line);
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string_view key = words[0];
    const auto counts_into = [&](std::vector<uint64_t>& list) {
      list.clear();
      for (size_t i = 1; i < words.size(); ++i) list.push_back(count_in(words[i], input));
    };
    if (key == "VERSION" || key == "VIEWPOINT") continue;
    if (key == "FIELDS" || key == "COLUMNS") fields.assign(words.begin() + 1, words.end());
    else if (key == "TYPE") types.assign(words.begin() + 1, words.end());
    else if (key == "SIZE") counts_into(sizes);
    else if (key == "COUNT") counts_into(counts);
    else if (key == "WIDTH" && words.size() == 2) width = count_in(words[1], input);
    else if (key == "HEIGHT" && words.size() == 2) height = count_in(words[1], input);
    else if (key == "POINTS" && words.size() == 2) points = count_in(words[1], input);
    else if (key == "DATA" && words.size() == 2 && (words[1] == "ascii" || words[1] == "binary")) {
      Header header{words[1] == "ascii" ? Encoding::ascii : Encoding::binary, {{"the cloud", 0, {}}}};
      if (counts.empty()) counts.assign(fields.size(), 1);
      if (fields.empty() || sizes.size() != fields.size() || types.size() != fields.size() ||
          counts.size() != fields.size())
        input.bad_line(fmt::format("{} FIELDS, {} SIZEs, {} TYPEs, {} COUNTs, expected as many of each", fields.size(),
                                   sizes.size(), types.size(), counts.size()));
      for (size_t i = 0; i < fields.size(); ++i) {
        Kind kind = pcd_kind(types[i], sizes[i], input);
        // A packed colour is bits; what is no number would not survive being converted as one.
        if (header.encoding == Encoding::binary && role_of(fields[i]) == kPacked && kind == Kind::f32) kind = Kind::u32;
        header.tables[0].columns.push_back({fields[i], kind, std::nullopt, counts[i]});
      }
      if (!points && !width) input.bad_line("neither POINTS nor WIDTH stand before DATA");
      header.tables[0].rows = points ? *points : *width * height.value_or(1);
      if (width && height && *width != 0 && header.tables[0].rows / *width != *height)
        input.bad_line(
            fmt::format("{} POINTS, expected WIDTH times HEIGHT, {} times {}", header.tables[0].rows, *width, *height));
      return header;
    } else {
      input.bad_line(
          fmt::format("`{}`, expected FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS, DATA ascii or DATA "
                      "binary",
                      shown(line)));
    }
  }
}

}  // namespace

tl::expected<Cloud, std::string> parse_cloud(std::string_view bytes, const std::string& name) {
  try {
    Input input(bytes, name);
    Input start = input;
    const bool ply = start.line("the first line of a PLY or PCD file") == "ply";
    const Header header = ply ? ply_header(start) : pcd_header(input);
    Input& rest = ply ? start : input;
    return header.encoding == Encoding::ascii ? read_tables<TextRows>(header, rest)
                                              : read_tables<BinaryRows>(header, rest);
  } catch (const Bad& bad) {
    return tl::make_unexpected(bad.text);
  }
}

}  // namespace takt::cloud
