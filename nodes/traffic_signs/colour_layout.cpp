// SPDX-License-Identifier: Apache-2.0
#include "nodes/traffic_signs/colour_layout.hpp"

#include <algorithm>
#include <fstream>
#include <string>

#include "nodes/traffic_signs/cascade.hpp"
#include "rt/file/input_file.hpp"
#include "rt/file/output_file.hpp"

namespace takt::traffic_signs {
namespace {

constexpr std::string_view kLetters = ".xo";  // in the order of Cell
constexpr size_t kMostCells = 64;             // each way
constexpr int kLeastPlain = 10;

}  // namespace

ColourLayout read_layout(const std::filesystem::path& file) {
  require_readable<CascadeError>(file);
  std::ifstream in(file);
  ColourLayout layout;
  int number = 0;
  const auto fail = [&](const std::string& what) {
    throw CascadeError(file.string() + ":" + std::to_string(number) + ": " + what);
  };
  for (std::string line; std::getline(in, line);) {
    ++number;
    line.erase(std::min(line.find('#'), line.size()));
    line.erase(line.find_last_not_of(" \t\r") + 1);
    if (line.empty()) continue;
    if (line.size() > kMostCells || layout.rows() == static_cast<int>(kMostCells))
      fail("a layout has at most 64 columns and rows");
    if (layout.columns == 0) layout.columns = static_cast<int>(line.size());
    if (static_cast<int>(line.size()) != layout.columns)
      fail("the row has " + std::to_string(line.size()) + " cells, the first one " + std::to_string(layout.columns));
    for (const char letter : line) {
      const size_t cell = kLetters.find(letter);
      if (cell == std::string_view::npos)
        fail(std::string("`") + letter + "` is unknown; valid are x (coloured), o (plain), . (either)");
      layout.cells.push_back(static_cast<ColourLayout::Cell>(cell));
    }
  }
  if (layout.columns == 0) fail("a layout needs at least one row of x, o and .");
  return layout;
}

void write_layout(const ColourLayout& layout, const std::filesystem::path& file, const std::string& comment) {
  std::ostringstream out;
  out << "# " << comment << '\n';
  for (size_t i = 0; i < layout.cells.size(); ++i) {
    out << kLetters[static_cast<size_t>(layout.cells[i])];
    if ((i + 1) % static_cast<size_t>(layout.columns) == 0) out << '\n';
  }
  require_written(write_file(file, out.str()));
}

Colour cell_colour(ImageView<const uint8_t> bgr, const Box& box, int columns, int rows, int column, int row) {
  int b = 0, g = 0, r = 0;
  for (const int v : {3, 5}) {  // eighths of the cell
    const int y = box.y + box.height * (8 * row + v) / (8 * rows);
    for (const int u : {3, 5}) {
      const int x = box.x + box.width * (8 * column + u) / (8 * columns);
      const uint8_t* pixel = &bgr.at(std::clamp(x, 0, bgr.width - 1), std::clamp(y, 0, bgr.height - 1));
      b += pixel[0], g += pixel[1], r += pixel[2];
    }
  }
  return {static_cast<uint8_t>(b / 4), static_cast<uint8_t>(g / 4), static_cast<uint8_t>(r / 4)};
}

double strength(SignColour colour, const Colour& pixel) {
  const int b = pixel.b, g = pixel.g, r = pixel.r;
  const auto share = [](int more, int whole) { return static_cast<double>(std::max(0, more)) / std::max(1, whole); };
  switch (colour) {
    case SignColour::red: return share(r - std::max(g, b), r);
    case SignColour::yellow: return share(std::min(r, g) - b, std::max(r, g));
    case SignColour::blue: return share(b - std::max(g, r), b);
    case SignColour::any: break;
  }
  return 0;
}

double layout_fit(const ColourLayout& layout, SignColour colour, ImageView<const uint8_t> bgr, const Box& box) {
  if (layout.columns == 0) return 1;
  double coloured = 0, plain = 0;
  int coloured_cells = 0, plain_cells = 0;
  for (size_t i = 0; i < layout.cells.size(); ++i) {
    if (layout.cells[i] == ColourLayout::Cell::either) continue;
    const int row = static_cast<int>(i) / layout.columns, column = static_cast<int>(i) % layout.columns;
    const bool wanted = layout.cells[i] == ColourLayout::Cell::coloured;
    (wanted ? coloured : plain) += strength(colour, cell_colour(bgr, box, layout.columns, layout.rows(), column, row));
    ++(wanted ? coloured_cells : plain_cells);
  }
  return coloured / std::max(1, coloured_cells) - plain / std::max(kLeastPlain, plain_cells);
}

}  // namespace takt::traffic_signs
