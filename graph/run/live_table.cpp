// SPDX-License-Identifier: Apache-2.0
#include "graph/run/live_table.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <thread>
#include <utility>

#include "rt/capability.hpp"

namespace takt::command {
namespace {

constexpr int kNarrowest = 60;

bool terminal() {
  const char* term = std::getenv("TERM");
  return isatty(STDERR_FILENO) && term != nullptr && std::string_view(term) != "dumb";
}

winsize terminal_size() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) size = {24, 80, 0, 0};
  return size;
}

double ms(const std::atomic<int64_t>& ns) { return static_cast<double>(ns.load(std::memory_order_relaxed)) / 1e6; }

}  // namespace

LiveTable::LiveTable(const Plan& plan, const RunBoard& board, std::string title)
    : plan_(plan),
      board_(board),
      title_(std::move(title)),
      said_(plan, board, in_journal(STDERR_FILENO)),
      thread_([this] {
        keep_rights(Rights::none);
        show();
      }) {}

LiveTable::~LiveTable() {
  ended_.store(1);
  ended_.notify_all();
  thread_.join();
}

void LiveTable::show() {
  const bool redraw = terminal() && terminal_size().ws_col >= kNarrowest;
  const int ticks = redraw ? 5 : 50;
  for (int tick = 1; ended_.load() == 0; ++tick) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const bool said = print_said();
    if (tick % ticks != 0 && !(said && redraw)) continue;
    if (redraw) draw_table(terminal_size().ws_col, terminal_size().ws_row);
    else print_line();
  }
  clear_table();
  print_said();
}

void LiveTable::clear_table() {
  if (const int lines = std::exchange(drawn_lines_, 0); lines > 0) std::fprintf(stderr, "\x1b[%dA\x1b[J", lines);
}

/// Where the table stood; true if there was something to say.
bool LiveTable::print_said() {
  const std::vector<std::string> lines = said_.take();
  if (lines.empty()) return false;
  clear_table();
  for (const std::string& line : lines) std::fprintf(stderr, "%s\n", line.c_str());
  return true;
}

void LiveTable::draw_table(int columns, int rows) {
  std::string text = drawn_lines_ > 0 ? fmt::format("\x1b[{}A", drawn_lines_) : "";
  const auto line = [&](const std::string& content) {
    text += "\x1b[K" + content.substr(0, static_cast<size_t>(columns) - 1) + "\n";
    ++drawn_lines_;
  };
  drawn_lines_ = 0;
  line(title_);
  line(fmt::format("  {:<14} {:>6} {:>9} {:>7} {:>7} {:>9} {:>10}", "node", "Hz", "completed", "missed", "skipped",
                   "CPU ms", "response ms"));
  const size_t fitting = static_cast<size_t>(std::max(rows - 4, 1));
  for (size_t t = 0; t < std::min(fitting, plan_.tasks.size()); ++t) {
    const TaskPlan& task = plan_.tasks[t];
    const TaskStatistics& s = board_.task(t);
    line(fmt::format("  {:<14} {:>6} {:>9} {:>7} {:>7} {:>9.2f} {:>10.2f}", task.name.substr(0, 14),
                     task.rate ? fmt::format("{:g}", task.rate->hz()) : "on", s.completed.load(),
                     s.deadline_misses.load(), s.skipped.load(), ms(s.last_exec_ns), ms(s.last_response_ns)));
  }
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
}

void LiveTable::print_line() {
  std::string text;
  for (size_t t = 0; t < plan_.tasks.size(); ++t) {
    const TaskStatistics& s = board_.task(t);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", plan_.tasks[t].name, s.completed.load());
    if (const uint64_t missed = s.deadline_misses.load()) text += fmt::format(" ({} missed)", missed);
  }
  std::fprintf(stderr, "completed: %s\n", text.c_str());
}

}  // namespace takt::command
