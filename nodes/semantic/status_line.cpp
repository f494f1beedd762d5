// SPDX-License-Identifier: Apache-2.0
#include "nodes/semantic/status_line.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "rt/msg/ace/stop_command.hpp"

namespace takt::semantic {
namespace {

constexpr int16_t kHalf = 500;

/// Text in memory of a fixed size; what does not fit is cut off.
class Line {
 public:
  explicit Line(std::span<char> into) : into_(into) {}
  void add(std::string_view text) {
    const size_t n = std::min(text.size(), into_.size() - used_);
    std::copy_n(text.data(), n, into_.data() + used_);
    used_ += n;
  }
  /// A part of the line: "NAME: ".
  void part(std::string_view name) {
    if (used_ > 0) add(" | ");
    add(name);
    add(": ");
    listed_ = 0;
  }
  void item(std::string_view text) {
    if (listed_++ > 0) add(", ");
    add(text);
  }
  template <class... Format>
  void number(Format... value) {
    char digits[32];
    add({digits, static_cast<size_t>(std::to_chars(digits, digits + sizeof(digits), value...).ptr - digits)});
  }
  void metres(double m) {
    number(std::clamp(m, 0.0, 1e6), std::chars_format::fixed, 1);
    add(" m");
  }
  bool empty() const { return used_ == 0; }
  std::string_view text() const { return {into_.data(), used_}; }

 private:
  std::span<char> into_;
  size_t used_ = 0;
  int listed_ = 0;
};

void add_stop(const Status& status, Line& line) {
  if (status.stop_reasons == 0 && !status.stop_lost) return;
  line.part("robot stopped");
  if (status.stop_lost) line.item("no stop command");
  constexpr std::pair<uint32_t, const char*> kWords[] = {{stop_reason::obstacle, "obstacle"},
                                                         {stop_reason::line, "line"},
                                                         {stop_reason::scan_lost, "scan lost"},
                                                         {stop_reason::line_lost, "line lost"},
                                                         {stop_reason::safe_stop, "safe stop"}};
  for (const auto& reason : kWords)
    if ((status.stop_reasons & reason.first) != 0) line.item(reason.second);
}

void add_requests(const Status& status, Line& line) {
  bool stopped = false, paced = false;
  for (const Request& r : status.deviating) (r.run ? paced : stopped) = true;
  if (stopped) line.part("stopped");
  for (const Request& r : status.deviating)
    if (!r.run) line.item(r.node);
  if (paced) line.part("paced");
  for (const Request& r : status.deviating) {
    if (!r.run) continue;
    line.item(r.node);
    line.add("/");
    line.number(static_cast<unsigned>(r.every));
  }
}

}  // namespace

std::optional<double> free_way_m(const Grid& grid, double strip_m) {
  std::optional<double> nearest;
  const auto cells = grid.view();
  for (int row = 0; row < grid.height; ++row) {
    const double low = grid.origin_y_m + row * grid.cell_m;
    if (low + grid.cell_m <= 0) continue;
    for (int column = 0; column < grid.width; ++column) {
      const double left = grid.origin_x_m + column * grid.cell_m;
      if (left >= strip_m / 2 || left + grid.cell_m <= -strip_m / 2 || cells.at(column, row) <= kHalf) continue;
      if (!nearest || low < *nearest) nearest = std::max(low, 0.0);
    }
  }
  return nearest;
}

std::string_view write_status(const Status& status, std::span<char> into) {
  Line line(into);
  add_stop(status, line);
  add_requests(status, line);
  if (status.objects) {
    line.part("objects");
    line.number(*status.objects);
  }
  if (status.obstacle_m) {
    line.part("obstacle ahead");
    line.metres(*status.obstacle_m);
  }
  if (status.ground_m) {
    line.part("ground ends ahead");
    line.metres(*status.ground_m);
  }
  if (line.empty()) line.add("all nodes at full rate");
  return line.text();
}

}  // namespace takt::semantic
