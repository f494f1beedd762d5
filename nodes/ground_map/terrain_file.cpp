// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/terrain_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "rt/file/input_file.hpp"

namespace takt::ground_map {
namespace {

class TerrainParser {
 public:
  TerrainParser(std::istream& text, const std::string& name) : text_(text), name_(name) {}

  TerrainLearning parse() {
    if (!next()) fail("has no maps; write `cells COLUMNS ROWS LEFT BEHIND METRES`, then maps");
    const TerrainShape shape = take_shape();
    TerrainLearning learning(shape);
    while (next()) {
      const size_t kind = take_kind();
      learning.add(kind, take_cells(shape));
    }
    for (size_t kind = 0; kind < kTerrainKinds; ++kind)
      if (learning.maps(kind) == 0) fail(fmt::format("has no `map {}`", kTerrainNames[kind]));
    return learning;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw TerrainError(fmt::format("{}:{}: {}", name_, line_, what));
  }

  /// The words of the next line that has any; false at the end.
  bool next() {
    words_.clear();
    for (std::string line; words_.empty() && std::getline(text_, line); ++line_) {
      std::istringstream rest(line.substr(0, line.find('#')));
      words_.assign(std::istream_iterator<std::string>(rest), {});
    }
    return !words_.empty();
  }

  TerrainShape take_shape() const {
    if (words_.size() != 6 || words_[0] != "cells") fail("must begin with `cells COLUMNS ROWS LEFT BEHIND METRES`");
    TerrainShape shape;
    shape.columns = whole(words_[1], 1, 200);
    shape.rows = whole(words_[2], 1, 200);
    shape.left = whole(words_[3], 0, shape.columns);
    shape.behind = whole(words_[4], 0, shape.rows);
    shape.cell_m = number(words_[5], 0.05, 1);
    return shape;
  }

  size_t take_kind() const {
    const auto end = kTerrainNames.begin() + kTerrainKinds,
               found = std::find(kTerrainNames.begin(), end, words_.back());
    if (words_.size() != 2 || words_[0] != "map" || found == end)
      fail("here must stand `map` with left, right, middle or crossing");
    return static_cast<size_t>(found - kTerrainNames.begin());
  }

  std::vector<int16_t> take_cells(const TerrainShape& shape) {
    std::vector<int16_t> cells(shape.cells());
    for (int row = shape.rows; row-- > 0;) {
      if (!next()) fail(fmt::format("the last map lacks {} rows", row + 1));
      if (words_.size() != static_cast<size_t>(shape.columns))
        fail(fmt::format("the row has {} cells, must have {}", words_.size(), shape.columns));
      std::transform(words_.begin(), words_.end(), cells.begin() + static_cast<ptrdiff_t>(row) * shape.columns,
                     [&](const std::string& word) { return static_cast<int16_t>(whole(word, kUnknown, kOccupied)); });
    }
    return cells;
  }

  double number(const std::string& word, double low, double high) const {
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    if (*end != 0 || !(value >= low && value <= high))
      fail(fmt::format("`{}` is no number in {}..{}", word, low, high));
    return value;
  }
  int whole(const std::string& word, int low, int high) const {
    const double value = number(word, low, high);
    if (value != std::floor(value)) fail(fmt::format("`{}` is no whole number", word));
    return static_cast<int>(value);
  }

  std::istream& text_;
  const std::string& name_;
  int line_ = 0;
  std::vector<std::string> words_;
};

}  // namespace

TerrainLearning parse_terrain(std::istream& text, const std::string& name) { return TerrainParser(text, name).parse(); }

TerrainLearning read_terrain(const std::filesystem::path& file) {
  if (std::filesystem::exists(file)) require_readable<TerrainError>(file);
  std::ifstream in(file);
  if (!in)
    throw TerrainError(file.string() + ": cannot be read; maps of terrain are a text file, see `takt terrain learn`");
  return parse_terrain(in, file.string());
}

void write_terrain_shape(std::ostream& out, const TerrainShape& shape) {
  out << fmt::format("cells {} {} {} {} {}\n", shape.columns, shape.rows, shape.left, shape.behind, shape.cell_m);
}

void write_terrain_map(std::ostream& out, const TerrainShape& shape, size_t kind, std::span<const int16_t> cells) {
  const auto columns = static_cast<size_t>(shape.columns);
  out << "map " << kTerrainNames[kind] << '\n';
  for (auto row = static_cast<size_t>(shape.rows); row-- > 0;)
    out << fmt::format("{}\n", fmt::join(cells.subspan(row * columns, columns), " "));
}

}  // namespace takt::ground_map
