// SPDX-License-Identifier: Apache-2.0
// The pages of `takt top` as lines of text, each at most as wide as the window. Pure functions, any thread.
//
//   const Content page = content(run, Page::nodes, {.width = 40, .columns = 0, .look = look});
#pragma once
#include <string_view>
#include <vector>

#include "graph/command/top/keys.hpp"
#include "graph/command/top/text.hpp"
#include "graph/command/top/watched.hpp"

namespace takt::top {

struct Content {
  std::vector<Line> head;      ///< stays where it is
  std::vector<Line> rows;      ///< scrolls
  size_t left = 0, right = 0;  ///< columns that are out of sight there
};

struct Fit {
  size_t width = 80;
  size_t columns = 0;  ///< so many are scrolled out at the left
  Look look;
};

/// Page and name, as its tab shows it.
std::string_view name_of(Page page);

Content content(const Watched& run, Page page, const Fit& fit);

Content nodes_page(const Watched& run, const Fit& fit);
Content chains_page(const Watched& run, const Fit& fit);
/// The last 10 s of each node, one character for each stretch of time.
Content timeline_page(const Watched& run, const Fit& fit);
Content devices_page(const Watched& run, const Fit& fit);
Content processes_page(const Watched& run, const Fit& fit);
Content log_page(const Watched& run, const Fit& fit);
Content parameters_page(const Watched& run, const Fit& fit);
Content help_page(const Fit& fit);

/// `share` of `cells` characters, in eighths of one where the terminal has signs for them.
std::string bar(double share, size_t cells, const Look& look);

}  // namespace takt::top
