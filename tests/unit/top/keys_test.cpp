// SPDX-License-Identifier: Apache-2.0
#include "graph/command/top/keys.hpp"

#include <doctest/doctest.h>

using namespace takt::top;
using Kind = Key::Kind;

namespace {

std::vector<Key> keys_of(std::string_view bytes) { return KeyReader().read(bytes); }

View pressed(View view, const std::vector<Kind>& keys, const Extent& extent) {
  for (const Kind key : keys) view = after(view, {key}, extent);
  return view;
}

constexpr Extent kThirty{30, 10, 4};

}  // namespace

TEST_CASE("each key of the help has its meaning") {
  const std::vector<std::pair<std::string_view, Key>> keys{
      {"1", {Kind::page, 0}},       {"7", {Kind::page, 6}},       {"\t", {Kind::next}},
      {"\x1b[Z", {Kind::previous}}, {"j", {Kind::down}},          {"k", {Kind::up}},
      {"\x1b[A", {Kind::up}},       {"\x1bOB", {Kind::down}},     {"\x1b[C", {Kind::right}},
      {"\x1bOD", {Kind::left}},     {"\x1b[5~", {Kind::page_up}}, {"\x1b[6~", {Kind::page_down}},
      {" ", {Kind::page_down}},     {"\x1b[H", {Kind::first}},    {"\x1b[4~", {Kind::last}},
      {"g", {Kind::first}},         {"G", {Kind::last}},          {"?", {Kind::help}},
      {"q", {Kind::quit}},          {"\x03", {Kind::quit}},       {"\x1a", {Kind::suspend}},
      {"\f", {Kind::redraw}},       {"\x1b[1;5A", {Kind::up}},    {"h", {Kind::left}},
  };
  for (const auto& [bytes, key] : keys) {
    INFO(bytes);
    CHECK(keys_of(bytes) == std::vector<Key>{key});
  }
  for (const std::string_view nothing : {"8", "0", "x", "\xc3\xbc", "\x1b[24~", "\x1b[<0;1;1M", ""}) {
    INFO(nothing);
    CHECK(keys_of(nothing).empty());
  }
}

TEST_CASE("a sequence may come in parts, and several keys at once") {
  KeyReader reader;
  CHECK(reader.read("\x1b").empty());
  CHECK(reader.waiting());
  CHECK(reader.read("[").empty());
  CHECK(reader.read("5").empty());
  CHECK(reader.read("~q") == std::vector<Key>{{Kind::page_up}, {Kind::quit}});
  CHECK(!reader.waiting());
  CHECK(keys_of("jj\x1b[Bk") == std::vector<Key>{{Kind::down}, {Kind::down}, {Kind::down}, {Kind::up}});
}

TEST_CASE("the Escape key alone is one once nothing follows; a sequence that ends early is none") {
  KeyReader reader;
  CHECK(reader.read("\x1b").empty());
  CHECK(reader.rest() == std::vector<Key>{{Kind::back}});
  CHECK(reader.rest().empty());
  CHECK(reader.read("\x1b[").empty());
  CHECK(reader.rest().empty());
  CHECK(reader.read("\x1bq") == std::vector<Key>{{Kind::back}, {Kind::quit}});
  CHECK(reader.read("\x1b[" + std::string(100, '0')).size() == 0);  // no endless wait
  CHECK(reader.read("q") == std::vector<Key>{{Kind::quit}});
}

TEST_CASE("pages follow each other in a circle") {
  View view;
  for (size_t p = 0; p < kPages; ++p) {
    CHECK(view.page == static_cast<Page>(p));
    view = after(view, {Kind::next}, kThirty);
  }
  CHECK(view.page == Page::nodes);
  CHECK(after(view, {Kind::previous}, kThirty).page == Page::parameters);
  CHECK(after(view, {Kind::page, 2}, kThirty).page == Page::timeline);
}

TEST_CASE("scrolling stays within the page, which keeps its place") {
  View view = pressed({}, {Kind::up}, kThirty);
  CHECK(view.rows[0] == 0);
  CHECK(pressed(view, {Kind::down, Kind::down, Kind::up}, kThirty).rows[0] == 1);
  CHECK(pressed(view, {Kind::page_down}, kThirty).rows[0] == 9);
  CHECK(pressed(view, {Kind::page_down, Kind::page_down, Kind::page_down, Kind::down}, kThirty).rows[0] == 20);
  CHECK(pressed(view, {Kind::last}, kThirty).rows[0] == 20);
  CHECK(pressed(view, {Kind::last, Kind::page_up}, kThirty).rows[0] == 11);
  CHECK(pressed(view, {Kind::last, Kind::first}, kThirty).rows[0] == 0);
  CHECK(pressed(view, {Kind::last}, {5, 10, 0}).rows[0] == 0);
  view = pressed(view, {Kind::page_down, Kind::next, Kind::previous}, kThirty);
  CHECK(view.rows[0] == 9);
  CHECK(view.rows[1] == 0);
  view = pressed(view, {Kind::up}, {12, 10, 0});  // the window became larger meanwhile
  CHECK(view.rows[0] == 1);
}

TEST_CASE("columns move only while some are out of sight") {
  View view = pressed({}, {Kind::left, Kind::right, Kind::right}, kThirty);
  CHECK(view.columns[0] == 2);
  CHECK(pressed(view, {Kind::right}, {30, 10, 0}).columns[0] == 2);
  CHECK(pressed(view, {Kind::left, Kind::left, Kind::left}, kThirty).columns[0] == 0);
}

TEST_CASE("the log shows its end until one scrolls up, and again from the end on") {
  View view = after({}, {Kind::page, 5}, kThirty);
  CHECK(view.newest);
  view = pressed(view, {Kind::up}, kThirty);
  CHECK(!view.newest);
  CHECK(view.rows[5] == 19);
  view = pressed(view, {Kind::down}, kThirty);
  CHECK(view.newest);
  CHECK(pressed(view, {Kind::page_up}, kThirty).rows[5] == 11);
  view = pressed(view, {Kind::first, Kind::last}, kThirty);
  CHECK(view.newest);
}

TEST_CASE("help opens and closes, and scrolls by itself") {
  View view = pressed({}, {Kind::down, Kind::help, Kind::down, Kind::down}, kThirty);
  CHECK(view.help);
  CHECK(view.help_rows == 2);
  CHECK(view.rows[0] == 1);
  CHECK(pressed(view, {Kind::right}, kThirty).columns[0] == 0);
  CHECK(!pressed(view, {Kind::help}, kThirty).help);
  CHECK(!pressed(view, {Kind::back}, kThirty).help);
  CHECK(!after(view, {Kind::page, 1}, kThirty).help);
  CHECK(pressed(view, {Kind::help, Kind::help}, kThirty).help_rows == 0);
  CHECK(pressed(view, {Kind::quit}, kThirty).ended);
}
