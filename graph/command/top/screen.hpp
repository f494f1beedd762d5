// SPDX-License-Identifier: Apache-2.0
// What `takt top` shows in a window: head line, tabs, page, last line. Pure functions, any thread.
//
//   const Screen screen = screen_of(run, view, window);
//   terminal.write(frame.difference(screen.lines, window));
#pragma once
#include <vector>

#include "graph/command/top/keys.hpp"
#include "graph/command/top/text.hpp"
#include "graph/command/top/watched.hpp"

namespace takt::top {

struct Window {
  Size size;
  Look look;
  double silent_s = 0;  ///< for so long the run has said nothing
};

struct Screen {
  std::vector<Line> lines;  ///< as many as the window has, none wider than it
  Extent extent;            ///< of the page, for keys
};

Screen screen_of(const Watched& run, const View& view, const Window& window);

/// "12.5 s", "3:25", "1:02:03"
std::string duration_text(double seconds);

}  // namespace takt::top
