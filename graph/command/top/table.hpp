// SPDX-License-Identifier: Apache-2.0
// A table that is fitted into a width: columns that find no place are left out and counted; no figure is ever cut.
//
//   Table table{{{"node"}, {"Hz"}}, {{{"stereo"}, {"15"}}}};
//   const LaidOut laid = lay_out(table, 40, 0, look);
#pragma once
#include <string>
#include <vector>

#include "graph/command/top/text.hpp"

namespace takt::top {

struct Column {
  std::string title;
  bool words = false;  ///< text: stands on the left and may be shortened. Else a figure
};

struct Table {
  std::vector<Column> columns;           ///< the first names the row; the others in the order of their weight
  std::vector<std::vector<Piece>> rows;  ///< one piece for each column
};

struct LaidOut {
  Line header;
  std::vector<Line> rows;
  size_t left = 0, right = 0;  ///< columns left out there, or cut and with more room once `shift` is larger
};

/// The first column, and as many of the others as find place, without the first `shift` of them.
LaidOut lay_out(const Table& table, size_t width, size_t shift, const Look& look);

}  // namespace takt::top
