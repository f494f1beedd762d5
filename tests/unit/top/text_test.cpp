// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/text.hpp"

#include <doctest/doctest.h>

#include "graph/command/top/table.hpp"
#include "tests/unit/top/generated_run.hpp"

using namespace takt::top;

namespace {

constexpr Look kUtf8{true, true}, kAscii{false, false};

}  // namespace

TEST_CASE("clean text has no control characters and a known width") {
  CHECK(clean("a\x1b[31mb\n\tc", kUtf8) == "a?[31mb  c");
  CHECK(clean("Tür", kUtf8) == "Tür");
  CHECK(clean("Tür", kAscii) == "T?r");
  CHECK(clean("\xff\xc3", kUtf8) == "??");
  CHECK(clean("\xc0\x80 \xed\xa0\x80 \xf5", kUtf8).find_first_not_of("? ") == std::string::npos);  // no UTF-8
  CHECK(clean("e\u0301\u200b", kUtf8) == "e??");
  CHECK(width_of("Tür") == 3);
  CHECK(width_of("門口") == 4);
  CHECK(width_of("") == 0);
}

TEST_CASE("a text that is cut has a sign, and is as wide as it may be") {
  CHECK(shortened("stereo", 6, kUtf8) == "stereo");
  CHECK(shortened("stereo", 5, kUtf8) == "ster…");
  CHECK(shortened("stereo", 5, kAscii) == "ster~");
  CHECK(shortened("stereo", 1, kAscii) == "~");
  CHECK(shortened("stereo", 0, kAscii) == "");
  CHECK(shortened("門門", 3, kUtf8) == "門…");
  CHECK(shortened("門門", 2, kUtf8) == "…");  // half a character is none
}

TEST_CASE("a line that is cut has a sign, wherever its pieces end") {
  const Line line{{"abc", Style::strong}, {"def", Style::bad}};
  CHECK(test::text_of(fitted(line, 6, kAscii)) == "abcdef");
  CHECK(test::text_of(fitted(line, 5, kAscii)) == "abcd~");
  CHECK(test::text_of(fitted(line, 4, kAscii)) == "abc~");
  CHECK(test::text_of(fitted(line, 3, kAscii)) == "ab~");
  CHECK(test::text_of(fitted(line, 0, kAscii)) == "");
  CHECK(fitted(line, 5, kAscii)[1].style == Style::bad);
}

TEST_CASE("wrapped text keeps each of its words") {
  CHECK(wrapped("one two three", 7) == std::vector<std::string>{"one two", "three"});
  CHECK(wrapped("one two three", 7, 2) == std::vector<std::string>{"one two", "  three"});
  CHECK(wrapped("abcdefghij", 4, 1) == std::vector<std::string>{"abcd", " efg", " hij"});
  CHECK(wrapped("", 10) == std::vector<std::string>{""});
  CHECK(wrapped("門門門", 4) == std::vector<std::string>{"門門", "門"});
  for (size_t width = 2; width < 40; ++width)
    for (const std::string& line : wrapped("  12.0 s  it waited for 門 and die Tür, abcdefghijklmnop", width, 3))
      CHECK(width_of(line) <= width);
}

TEST_CASE("a table leaves out columns and counts them; it cuts no figure") {
  const Table table{{{"node"}, {"Hz"}, {"done"}, {"process", true}},
                    {{{"stereo"}, {"15"}, {"1234567890"}, {"somewhere_else"}}, {{"x"}, {"on"}, {"1"}, {"y"}}}};
  const LaidOut all = lay_out(table, 40, 0, kAscii);
  CHECK(test::text_of(all.header) == "node   Hz       done process       ");
  CHECK(test::text_of(all.rows[0]) == "stereo 15 1234567890 somewhere_else");
  CHECK(test::text_of(all.rows[1]) == "x      on          1 y             ");
  CHECK(all.right == 0);
  CHECK(test::text_of(lay_out(table, 30, 0, kAscii).rows[0]) == "stereo 15 1234567890 somewher~");
  const LaidOut narrow = lay_out(table, 19, 0, kAscii);
  CHECK(test::text_of(narrow.rows[0]) == "stereo 15");
  CHECK(narrow.right == 2);
  const LaidOut shifted = lay_out(table, 19, 1, kAscii);
  CHECK(test::text_of(shifted.rows[0]) == "stereo 1234567890");
  CHECK(shifted.left == 1);
  CHECK(shifted.right == 1);
  CHECK(lay_out(table, 19, 99, kAscii).left == 3);
}
