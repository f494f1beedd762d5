// SPDX-License-Identifier: Apache-2.0
// Both formats are a text header that names the columns of a table, and the table itself, as text or as bytes.
#include <array>
#include <charconv>

#include "nodes/cloud/cloud_input.hpp"

namespace takt::cloud {
namespace {

/// In the order of Layout.
constexpr std::array<std::string_view, 3> kPlyLayouts{"ascii", "binary_little_endian", "binary_big_endian"};

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

}  // namespace

Header ply_header(Input& input) {
  Header header;
  bool encoded = false;
  std::vector<Table>* tables = nullptr;  ///< to which what comes next belongs
  for (;;) {
    const std::string_view line = input.line("end_header");
    const auto words = words_of(line);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() == 3) {
      const auto known = std::find(kPlyLayouts.begin(), kPlyLayouts.end(), words[1]);
      if (known == kPlyLayouts.end())
        input.bad_line(
            fmt::format("format {}, expected ascii, binary_little_endian or binary_big_endian", shown(words[1])));
      header.layout = static_cast<Layout>(known - kPlyLayouts.begin());
      encoded = true;
    } else if (words[0] == "element" && words.size() == 3) {
      const bool past_points = !header.tables.empty() && header.tables.back().name == "vertex";
      tables = past_points ? &header.behind : &header.tables;
      tables->push_back({std::string(words[1]), count_in(words[2], input), {}});
    } else if (words[0] == "property" && words.size() == 3 && tables != nullptr) {
      tables->back().columns.push_back({std::string(words[2]), ply_kind(words[1], input), std::nullopt, 1});
    } else if (words[0] == "property" && words.size() == 5 && words[1] == "list" && tables != nullptr) {
      tables->back().columns.push_back(
          {std::string(words[4]), ply_kind(words[3], input), ply_kind(words[2], input), 1});
    } else {
      input.bad_line(
          fmt::format("`{}`, expected format TYPE VERSION, element NAME COUNT, property TYPE NAME, property list TYPE "
                      "TYPE NAME, comment or end_header",
                      shown(line)));
    }
  }
  if (!encoded)
    input.bad_line(
        "the header ends without a line `format`, expected ascii, binary_little_endian or binary_big_endian");
  if (header.tables.empty() || header.tables.back().name != "vertex")
    input.bad_line("the header ends without `element vertex`");
  return header;
}

namespace {

Kind pcd_kind(std::string_view type, uint64_t size, const Input& input) {
  if (type == "F" && size == 4) return Kind::f32;
  if (type == "F" && size == 8) return Kind::f64;
  constexpr Kind kSigned[] = {Kind::i8, Kind::i16, Kind::i32, Kind::i64},
                 kUnsigned[] = {Kind::u8, Kind::u16, Kind::u32, Kind::u64};
  if ((type == "I" || type == "U") && size <= 8 && std::has_single_bit(size))
    return (type == "I" ? kSigned : kUnsigned)[std::countr_zero(size)];
  input.bad_line(fmt::format("TYPE {} of SIZE {}, expected F of 4 or 8, or I or U of 1, 2, 4 or 8", shown(type), size));
}

std::optional<Layout> pcd_layout(std::string_view word) {
  if (word == "ascii") return Layout::ascii;
  if (word == "binary") return Layout::binary;
  if (word == "binary_compressed") return Layout::compressed;
  return std::nullopt;
}

}  // namespace

Header pcd_header(Input& input) {
  std::vector<std::string> fields, types, left_out;
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
    if (key == "VIEWPOINT" && words != words_of("VIEWPOINT 0 0 0 1 0 0 0"))
      left_out.assign(1, fmt::format("`{}` is not applied", shown(line)));
    if (key == "VERSION" || key == "VIEWPOINT") continue;
    if (key == "FIELDS" || key == "COLUMNS") fields.assign(words.begin() + 1, words.end());
    else if (key == "TYPE") types.assign(words.begin() + 1, words.end());
    else if (key == "SIZE") counts_into(sizes);
    else if (key == "COUNT") counts_into(counts);
    else if (key == "WIDTH" && words.size() == 2) width = count_in(words[1], input);
    else if (key == "HEIGHT" && words.size() == 2) height = count_in(words[1], input);
    else if (key == "POINTS" && words.size() == 2) points = count_in(words[1], input);
    else if (const auto data = key == "DATA" && words.size() == 2 ? pcd_layout(words[1]) : std::nullopt) {
      Header header{*data, {{"the cloud", 0, {}}}, {}, std::move(left_out)};
      if (counts.empty()) counts.assign(fields.size(), 1);
      if (fields.empty() || sizes.size() != fields.size() || types.size() != fields.size() ||
          counts.size() != fields.size())
        input.bad_line(fmt::format("{} FIELDS, {} SIZEs, {} TYPEs, {} COUNTs, expected as many of each", fields.size(),
                                   sizes.size(), types.size(), counts.size()));
      for (size_t i = 0; i < fields.size(); ++i) {
        Kind kind = pcd_kind(types[i], sizes[i], input);
        // A packed colour is bits; what is no number would not survive being converted as one.
        if (header.layout != Layout::ascii && packed_colour(fields[i]) && kind == Kind::f32) kind = Kind::u32;
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
          fmt::format("`{}`, expected FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS, DATA ascii, "
                      "DATA binary or DATA binary_compressed",
                      shown(line)));
    }
  }
}

}  // namespace takt::cloud
