// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/frame.hpp"

#include <doctest/doctest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/unit/top/generated_run.hpp"

using namespace takt::top;

namespace {

constexpr Look kPlain{false, false};

/// A terminal that knows what Frame may send, in ASCII: place, clear, clear the rest of the line, style.
struct Tube {
  Size size;
  std::vector<std::string> rows{size.height, std::string(size.width, '#')};  // what was there before
  size_t row = 0, column = 0;

  void take(const std::string& bytes) {
    for (size_t at = 0; at < bytes.size(); ++at)
      if (bytes[at] == '\x1b') at = sequence(bytes, at + 2);
      else put(bytes[at]);
  }
  void put(char c) {
    REQUIRE(row < size.height);
    REQUIRE(column < size.width);
    rows[row][column++] = c;
  }
  size_t sequence(const std::string& bytes, size_t at) {
    const size_t end = bytes.find_first_of("HJKm", at);
    REQUIRE(end != std::string::npos);
    const std::string parameters = bytes.substr(at, end - at);
    if (bytes[end] == 'H') {
      row = parameters.empty() ? 0 : std::stoul(parameters) - 1;
      column = 0;
    } else if (bytes[end] == 'J') {
      for (std::string& line : rows) line.assign(size.width, ' ');
    } else if (bytes[end] == 'K') {
      REQUIRE(column < size.width);  // behind the last column terminals differ
      rows[row].replace(column, std::string::npos, size.width - column, ' ');
    }
    return end;
  }
};

std::vector<std::string> padded(const std::vector<Line>& lines, const Size& size) {
  std::vector<std::string> rows;
  for (const Line& line : lines) rows.push_back(left_aligned(test::text_of(line), size.width));
  rows.resize(size.height, std::string(size.width, ' '));
  return rows;
}

}  // namespace

TEST_CASE("a terminal shows the lines after each difference, whatever was there before") {
  std::mt19937 random(7);
  const auto below = [&](size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random); };
  const Size size{12, 5};
  for (const Look& look : {Look{true, false}, kPlain}) {
    Tube tube{size};
    Frame frame;
    std::vector<Line> lines;
    for (int step = 0; step < 500; ++step) {
      if (below(5) == 0) lines.resize(below(size.height + 1));
      for (Line& line : lines)
        if (below(2) == 0)
          line = {{std::string(below(7), 'a'), Style::bad}, {std::string(below(7), 'b'), Style::plain}};
      if (below(50) == 0) {
        tube = Tube{size};
        frame.forget();
      }
      tube.take(frame.difference(lines, size, look));
      REQUIRE(tube.rows == padded(lines, size));
    }
  }
}

TEST_CASE("what stays as it is is not sent again, and another size draws all") {
  Frame frame;
  const std::vector<Line> lines{{{"one"}}, {{"two", Style::bad}}};
  CHECK(frame.difference(lines, {80, 24}, kPlain).find("two") != std::string::npos);
  CHECK(frame.difference(lines, {80, 24}, kPlain).empty());
  CHECK(frame.difference({{{"one"}}, {{"2"}}}, {80, 24}, kPlain) == "\x1b[2;1H2\x1b[K");
  CHECK(frame.difference(lines, {81, 24}, kPlain).starts_with("\x1b[H\x1b[2J"));
  frame.forget();
  CHECK(frame.difference(lines, {81, 24}, kPlain).find("one") != std::string::npos);
}

TEST_CASE("without colours no style is sent; with them each ends where its text does") {
  const std::vector<Line> lines{{{"bad", Style::bad}, {" "}, {"plain"}}};
  CHECK(Frame().difference(lines, {80, 24}, kPlain) == "\x1b[H\x1b[2J\x1b[1;1Hbad plain");
  CHECK(Frame().difference(lines, {80, 24}, {true, false}) == "\x1b[H\x1b[2J\x1b[1;1H\x1b[31mbad\x1b[0m plain");
}
