// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "graph/command/top/text.hpp"

namespace takt::top {

/// What the terminal shows at present, so that only lines that changed are sent: less to wait
/// for over ssh.
///
///   terminal.write(frame.difference(lines, size, look));
class Frame {
 public:
  /// The bytes that turn what is shown into these lines, none wider than `size.width`.
  std::string difference(const std::vector<Line>& lines, const Size& size, const Look& look);
  /// Nothing is known of the terminal any more: the next difference draws all of it.
  void forget() { known_ = false; }

 private:
  std::vector<std::string> shown_;
  Size size_;
  bool known_ = false;
};

}  // namespace takt::top
