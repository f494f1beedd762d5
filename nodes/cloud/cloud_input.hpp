// SPDX-License-Identifier: Apache-2.0
// Inside the readers of clouds: a file in memory, and the tables that its header announces.
#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace takt::cloud {

/// What is wrong, and where; parse_cloud returns it.
struct Bad {
  std::string text;
};

inline std::vector<std::string_view> words_of(std::string_view line) {
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
inline std::string shown(std::string_view text) {
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
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), bytes_.data() + at_, sizeof(T));
    if (swapped_) std::reverse(bytes.begin(), bytes.end());
    at_ += sizeof(T);
    return std::bit_cast<T>(bytes);
  }
  std::string_view rest() const { return bytes_.substr(at_); }
  void swap_bytes() { swapped_ = true; }
  [[noreturn]] void bad_line(const std::string& what) const { throw Bad{fmt::format("{}:{}: {}", name_, line_, what)}; }
  [[noreturn]] void bad_byte(const std::string& what) const {
    throw Bad{fmt::format("{}: byte {}: {}", name_, at_, what)};
  }

 private:
  std::string_view bytes_;
  const std::string& name_;
  size_t at_ = 0, line_ = 0;
  bool swapped_ = false;
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

enum class Layout : uint8_t { ascii, binary, binary_swapped, compressed };

struct Header {
  Layout layout = Layout::binary;
  std::vector<Table> tables;  ///< up to that of the points
  std::vector<Table> behind;  ///< not read
  std::vector<std::string> left_out;
};

/// The header of a PLY file, whose first line was read. Throws Bad.
Header ply_header(Input& input);
/// The header of a PCD file. Throws Bad.
Header pcd_header(Input& input);
/// `rgb`, `rgba`: a packed colour, which is bits.
inline bool packed_colour(std::string_view name) { return name == "rgb" || name == "rgba"; }

/// What DATA binary_compressed holds: the columns, one after the other, by LZF; as the rows that DATA binary would
/// have. Throws Bad.
std::string unpack_columns(Input& input, const Table& table);

}  // namespace takt::cloud
