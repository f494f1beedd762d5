// SPDX-License-Identifier: Apache-2.0
// Every page at every width: nothing is wider than the window, and no figure is cut without a sign.
#include "graph/command/top/pages.hpp"

#include <doctest/doctest.h>

#include <set>
#include <sstream>

#include "graph/command/top/screen.hpp"
#include "tests/unit/top/generated_run.hpp"

using namespace takt::top;

namespace {

constexpr Look kLooks[]{{true, true}, {false, false}};

std::string all_of(const std::vector<Line>& lines) {
  std::string text;
  for (const Line& line : lines) text += test::text_of(line) + "\n";
  return text;
}

std::string page_text(const Watched& run, Page page, size_t width, size_t columns = 0, Look look = {}) {
  const Content made = content(run, page, {width, columns, look});
  return all_of(made.head) + all_of(made.rows);
}

/// Words with a digit.
std::set<std::string> figures(const std::string& text) {
  std::set<std::string> found;
  std::istringstream words(text);
  for (std::string word; words >> word;)
    if (word.find_first_of("0123456789") != std::string::npos) found.insert(word);
  return found;
}

}  // namespace

TEST_CASE("no line is wider than the window, on any page, in any window") {
  const Watched run = test::generated_run();
  for (const Look& look : kLooks)
    for (const Size size : {Size{40, 10}, {80, 24}, {200, 60}, {41, 11}, {1, 1}, {7, 3}, {20, 5}, {500, 200}})
      for (size_t p = 0; p <= kPages; ++p) {
        View view;
        view.page = static_cast<Page>(std::min(p, kPages - 1));
        view.help = p == kPages;
        for (const double silent_s : {0.0, 120.0}) {
          const Screen screen = screen_of(run, view, {size, look, silent_s});
          CHECK(screen.lines.size() == size.height);
          for (const Line& line : screen.lines) {
            INFO(size.width, " page ", p, ": ", test::text_of(line));
            CHECK(width_of(line) <= size.width);
            for (const char c : test::text_of(line)) CHECK((look.utf8 || (c >= ' ' && c <= '~')));
          }
        }
      }
}

TEST_CASE("figures of a narrow window are those of a wide one, or are not there and counted") {
  const Watched run = test::generated_run();
  for (const Page page : {Page::nodes, Page::chains, Page::devices}) {
    const Content wide = content(run, page, {1000, 0, {}});
    CHECK(wide.right == 0);
    const std::set<std::string> known = figures(all_of(wide.rows));
    std::set<std::string> shown;
    for (const size_t width : {40, 80, 200}) {
      INFO(width);
      const Content first = content(run, page, {width, 0, {}});
      CHECK((first.right > 0 || all_of(first.rows).find(test::text_of(wide.rows[0]).substr(0, 2)) == 0));
      size_t columns = 0;
      for (;; ++columns) {  // as the key Right does
        const Content made = content(run, page, {width, columns, {}});
        CHECK(made.left == columns);
        for (const std::string& figure : figures(all_of(made.rows))) {
          INFO(figure);
          CHECK((known.contains(figure) || figure.ends_with("~")));
          shown.insert(figure);
        }
        if (made.right == 0) break;
      }
      for (const std::string& figure : known)  // all of them can be reached
        if (figure.find('_') == std::string::npos) CHECK((shown.contains(figure)));
    }
  }
}

TEST_CASE("the page of nodes: devices, misses and what is above its limit are marked by characters") {
  Watched run = test::generated_run(3);
  const std::string text = page_text(run, Page::nodes, 200);
  CHECK(text.find("@n0") != std::string::npos);
  CHECK(text.find("123456 [") != std::string::npos);     // misses, then the bar
  CHECK(text.find("[###      ]") != std::string::npos);  // 5.77 of 12 ms
  CHECK(text.find("[########!]") != std::string::npos);  // 12.5 of 12 ms
  CHECK(text.find("123457!") != std::string::npos);      // above the proven 60.1 ms
  CHECK(text.find("31.00!") == std::string::npos);
  CHECK(text.find("1/2") != std::string::npos);
  CHECK(text.find("on ") != std::string::npos);
}

TEST_CASE("a window of 40 columns has rate, misses and budget of a node") {
  const std::string text = page_text(test::generated_run(3), Page::nodes, 40);
  for (const char* title : {"node", "Hz", "miss", "exec/budget"}) {
    INFO(text);
    CHECK(text.find(title) != std::string::npos);
  }
}

TEST_CASE("a window of 80 columns has what a node promised and kept, too") {
  Watched run = test::generated_run(3);
  run.nodes[1] = run.nodes[2];
  const std::string text = page_text(run, Page::nodes, 80);
  for (const char* title : {"resp", "max", "proven", "deadline"}) {
    INFO(text);
    CHECK(text.find(title) != std::string::npos);
  }
}

TEST_CASE("chains above bound or proof are marked; without chains the page says so") {
  Watched run = test::generated_run();
  const std::string text = page_text(run, Page::chains, 120);
  CHECK(text.find("650.50!") != std::string::npos);  // above the proof, below the bound
  CHECK(text.find("80.30!") == std::string::npos);
  run.chains.clear();
  CHECK(page_text(run, Page::chains, 40).find("names no chains") != std::string::npos);
}

TEST_CASE("the timeline has a character for each stretch, and `!` where a job was late") {
  const Watched run = test::generated_run();
  for (const size_t width : {20, 40, 80, 200, 1000}) {
    INFO(width);
    const Content page = content(run, Page::timeline, {width, 0, {}});
    REQUIRE(page.rows.size() == run.nodes.size());
    for (size_t n = 0; n < run.nodes.size(); ++n) {
      const std::string row = test::text_of(page.rows[n]);
      CHECK(row.size() == width);
      CHECK((row.find('!') != std::string::npos) == (n == 1));
    }
    CHECK(all_of(page.rows).find('~') != std::string::npos);
    CHECK(all_of(page.head).find("some jobs are") != std::string::npos);
  }
}

TEST_CASE("the timeline: a job stands where it ran, as high as its response was long") {
  Watched run = test::generated_run(1);
  NodeSeen& node = run.nodes[0];
  run.running_s = 20;
  node.name = "12345678";
  node.device = false;
  node.deadline_ms = 950;
  node.jobs = {{9.0, 9.0, 9.5},    {10.0, 10.0, 10.1}, {12.0, 12.0, 12.9},
               {15.0, 15.4, 16.6}, {19.4, 19.5, 19.9}, {19.95, 19.95, 19.96}};
  // Ten columns of 1 s: 10 to 20 s. The first job is older, the fourth ends 1.6 s after its release.
  CHECK(test::text_of(content(run, Page::timeline, {19, 0, {}}).rows[0]) == "12345678 . #  !!  |");
  CHECK(test::text_of(content(run, Page::timeline, {19, 0, {true, true}}).rows[0]) == "12345678 ▁ █  !!  ▅");
}

TEST_CASE("the log keeps every word, newest last") {
  Watched run = test::generated_run();
  const std::string wide = page_text(run, Page::log, 200);
  CHECK(wide.find("     0.5 s mode      full: the start\n") == 0);
  CHECK(wide.find("er bog in die T?r; ? ?[31m and ?") != std::string::npos);
  const Content narrow = content(run, Page::log, {40, 0, {}});
  std::string words;
  for (const Line& line : narrow.rows) words += test::text_of(line) + " ";
  CHECK(words.find("which took") != std::string::npos);
  CHECK(test::text_of(narrow.rows.back()).find("70 ms") != std::string::npos);
  run.events_left_out = 12;
  CHECK(page_text(run, Page::log, 40).find("12 older left out") == 0);
  run.events.clear();
  CHECK(page_text(run, Page::log, 40).find("nothing so far") != std::string::npos);
}

TEST_CASE("devices, processes, parameters") {
  const Watched run = test::generated_run();
  CHECK(page_text(run, Page::devices, 200).find("no frame for 200 ms; is the cable in?") != std::string::npos);
  const std::string processes = page_text(run, Page::processes, 100);
  CHECK(processes.find("CPU 0.61 cores, memory 921 MB") == 0);
  CHECK(processes.find("composed") != std::string::npos);
  CHECK(page_text(run, Page::parameters, 100).find("cruise.speed 0.2 m/s (set at 3.1 s") != std::string::npos);
}

TEST_CASE("the head line says what runs; the tabs fit; the last line says what is out of sight") {
  const Watched run = test::generated_run();
  const auto lines = [&](View view, Size size, double silent_s = 0) {
    return screen_of(run, view, {size, {}, silent_s}).lines;
  };
  const auto narrow = lines({}, {40, 10});
  CHECK(test::text_of(narrow[0]) == "ace, sim, deadline, full, 12.5 s");
  CHECK(test::text_of(narrow[1]) == "123456 misses");
  CHECK(test::text_of(narrow[2]) == "[1 nodes] 2 3 4 5 6 7 ?");
  INFO(test::text_of(narrow[9]));
  CHECK(test::text_of(narrow[9]).find("1-5 of 26  12 >  q ends") == 0);
  const auto wide = lines({}, {80, 24});
  CHECK(test::text_of(wide[0]) == "ace, sim, deadline, full, 12.5 s, 123456 misses");
  CHECK(test::text_of(wide[1]) == "[1 nodes] 2 chains 3 timeline 4 devices 5 processes 6 log 7 parameters ? help");
  CHECK(all_of(lines({}, {80, 24}, 5)).find("no news for 5 s") != std::string::npos);
  View log;
  log.page = Page::log;
  CHECK(all_of(lines(log, {40, 6})).find("70 ms") != std::string::npos);  // its end
  log.newest = false;
  CHECK(all_of(lines(log, {40, 6})).find("full: the start") != std::string::npos);
}

TEST_CASE("running time") {
  CHECK(duration_text(0) == "0.0 s");
  CHECK(duration_text(59.94) == "59.9 s");
  CHECK(duration_text(205) == "3:25");
  CHECK(duration_text(3723) == "1:02:03");
}

TEST_CASE("a bar is as long as its share") {
  CHECK(bar(0, 4, {}) == "[     ]");
  CHECK(bar(0.5, 4, {}) == "[##   ]");
  CHECK(bar(1, 4, {}) == "[#### ]");
  CHECK(bar(7, 4, {}) == "[####!]");
  CHECK(bar(0.375, 4, {true, true}) == "▕█▌   ▏");
  for (double share = -1; share < 3; share += 0.01)
    for (const Look& look : kLooks) CHECK(width_of(bar(share, 8, look)) == 11);
}
