// SPDX-License-Identifier: Apache-2.0
#include "nodes/ground_map/terrain_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace takt::ground_map {
namespace {

class TerrainParser {
 public:
  explicit TerrainParser(std::string name) : name_(std::move(name)) {}

  TerrainLearning parse(std::istream& text) {
    for (std::string line; std::getline(text, line);) {
      ++line_;
      std::istringstream rest(line.substr(0, line.find('#')));
      std::vector<std::string> words;
      for (std::string word; rest >> word;) words.push_back(word);
      if (!words.empty()) take(words);
    }
    if (!learning_) fail("has no maps; write `cells COLUMNS ROWS LEFT BEHIND METRES`, then maps");
    if (rows_missing_ > 0) fail(fmt::format("the last map lacks {} rows", rows_missing_));
    for (size_t kind = 0; kind < kTerrainKinds; ++kind)
      if (learning_->maps(kind) == 0) fail(fmt::format("has no `map {}`", kTerrainNames[kind]));
    return std::move(*learning_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw TerrainError(fmt::format("{}:{}: {}", name_, line_, what));
  }

  void take(const std::vector<std::string>& words) {
    if (rows_missing_ > 0) take_row(words);
    else if (words[0] == "cells") take_shape(words);
    else if (words[0] == "map") begin(words);
    else fail(fmt::format("unknown word `{}`; valid are cells, map", words[0]));
  }

  void take_shape(const std::vector<std::string>& words) {
    if (learning_) fail("`cells` stands there a second time");
    if (words.size() != 6) fail("`cells` takes COLUMNS ROWS LEFT BEHIND METRES");
    shape_.columns = whole(words[1], 1, 200);
    shape_.rows = whole(words[2], 1, 200);
    shape_.left = whole(words[3], 0, shape_.columns);
    shape_.behind = whole(words[4], 0, shape_.rows);
    shape_.cell_m = number(words[5], 0.05, 1);
    learning_.emplace(shape_);
    cells_.resize(shape_.cells());
  }

  void begin(const std::vector<std::string>& words) {
    if (!learning_) fail("`map` stands before `cells COLUMNS ROWS LEFT BEHIND METRES`");
    const auto found = std::find(kTerrainNames.begin(), kTerrainNames.begin() + kTerrainKinds, words.back());
    kind_ = static_cast<size_t>(found - kTerrainNames.begin());
    if (words.size() != 2 || kind_ == kTerrainKinds) fail("`map` takes left, right, middle or crossing");
    rows_missing_ = shape_.rows;
  }

  void take_row(const std::vector<std::string>& words) {
    if (words.size() != static_cast<size_t>(shape_.columns))
      fail(fmt::format("the row has {} cells, must have {}", words.size(), shape_.columns));
    int16_t* row = cells_.data() + static_cast<ptrdiff_t>(--rows_missing_) * shape_.columns;
    for (const std::string& word : words) *row++ = static_cast<int16_t>(whole(word, kUnknown, kOccupied));
    if (rows_missing_ == 0) learning_->add(kind_, cells_);
  }

  double number(const std::string& word, double low, double high) const {
    size_t used = 0;
    double value = NAN;
    try {
      value = std::stod(word, &used);
    } catch (const std::exception&) {
    }
    if (used != word.size() || !(value >= low && value <= high))
      fail(fmt::format("`{}` is no number in {}..{}", word, low, high));
    return value;
  }
  int whole(const std::string& word, int low, int high) const {
    const double value = number(word, low, high);
    if (value != std::floor(value)) fail(fmt::format("`{}` is no whole number", word));
    return static_cast<int>(value);
  }

  std::string name_;
  int line_ = 0;
  TerrainShape shape_;
  std::optional<TerrainLearning> learning_;
  size_t kind_ = 0;
  int rows_missing_ = 0;
  std::vector<int16_t> cells_;
};

}  // namespace

TerrainLearning parse_terrain(std::istream& text, const std::string& name) { return TerrainParser(name).parse(text); }

TerrainLearning read_terrain(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in)
    throw TerrainError(file.string() + ": cannot be read; maps of terrain are a text file, see `takt terrain learn`");
  return parse_terrain(in, file.string());
}

void write_terrain_shape(std::ostream& out, const TerrainShape& shape) {
  out << fmt::format("cells {} {} {} {} {}\n", shape.columns, shape.rows, shape.left, shape.behind, shape.cell_m);
}

void write_terrain_map(std::ostream& out, const TerrainShape& shape, size_t kind, std::span<const int16_t> cells) {
  out << "map " << kTerrainNames[kind] << '\n';
  for (int row = shape.rows; row-- > 0;)
    out << fmt::format(
        "{}\n",
        fmt::join(cells.subspan(static_cast<size_t>(row * shape.columns), static_cast<size_t>(shape.columns)), " "));
}

}  // namespace takt::ground_map
