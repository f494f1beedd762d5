// SPDX-License-Identifier: Apache-2.0
// Values that outlast a run: the file of `takt set --keep`, written, read, refused.
#include "graph/language/overlay.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <iterator>

#include "tests/unit/language/fixture.hpp"

namespace {

using namespace takt;
using namespace takt::graph;

/// A graph `tiny`, with a folder for state in its own.
struct State : test::Files {
  std::filesystem::path file = overlay_file(folder(), "tiny");
  void keep(const OverlayChanges& changes) const {
    const auto done = change_overlay(file, "tiny", changes);
    REQUIRE_MESSAGE(done, done.error());
  }
  void write(const std::string& text) const {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  std::string text() const {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  Loaded load(std::vector<std::string> set = {}) const {
    LoadOptions options;
    options.state = folder();
    options.set = std::move(set);
    return test::Files::load(options);
  }
};

const ParamSpec& param(const Loaded& loaded, const std::string& name) {
  REQUIRE_MESSAGE(loaded.graph, test::all(loaded));
  return loaded.graph->nodes[0].params.at(name);
}

}  // namespace

TEST_CASE("what is kept is read by the next run, beside what the graph says") {
  const State state;
  state.keep({{"stereo.max_range", "12m"}, {"stereo.cost", "census"}, {"stereo.fill", "false"}});
  state.keep({{"stereo.window", "1/15 s"}, {"stereo.table", "two words: \"quoted\" \\ # no comment"}});
  const Loaded loaded = state.load();
  CHECK(std::get<double>(param(loaded, "max_range").value) == 12);
  CHECK(param(loaded, "max_range").by == ChosenBy::kept);
  CHECK(std::get<std::string>(param(loaded, "cost").value) == "census");
  CHECK(std::get<bool>(param(loaded, "fill").value) == false);
  CHECK(std::get<double>(param(loaded, "window").value) == doctest::Approx(1.0 / 15));
  CHECK(std::get<std::string>(param(loaded, "table").value) == "two words: \"quoted\" \\ # no comment");
  CHECK(param(loaded, "disparities").by == ChosenBy::file);
  CHECK(loaded.graph->kept.file == state.file);
  CHECK(loaded.graph->kept.values.size() == 5);
  CHECK(state.text().find("  stereo.max_range: 12m\n") != std::string::npos);
}

TEST_CASE("--set wins over what is kept, and that is known; without the folder nothing is read") {
  const State state;
  state.keep({{"stereo.max_range", "12m"}});
  const Loaded loaded = state.load({"stereo.max_range=30m"});
  CHECK(std::get<double>(param(loaded, "max_range").value) == 30);
  CHECK(param(loaded, "max_range").by == ChosenBy::command_line);
  CHECK(loaded.graph->kept.values.at(0).overridden);
  const Loaded without = state.test::Files::load();
  CHECK(std::get<double>(param(without, "max_range").value) == 20);
  CHECK(without.graph->kept.file.empty());
}

TEST_CASE("a value that is forgotten is gone, the others stay") {
  const State state;
  state.keep({{"stereo.max_range", "12m"}, {"stereo.table", "\"123\""}});
  state.write(state.text() + "  stereo.gain: 2\n");
  CHECK(forget_value(state.file, "tiny", "stereo.max_range"));
  const Loaded loaded = state.load();
  CHECK(std::get<double>(param(loaded, "max_range").value) == 20);
  CHECK(loaded.graph->kept.values.size() == 2);
  const auto gone = forget_value(state.file, "tiny", "stereo.gains");
  REQUIRE_FALSE(gone);
  CHECK(gone.error().find("did you mean `stereo.gain`") != std::string::npos);
}

TEST_CASE("a text that looks like a number stays a text when others are written") {
  const State state;
  state.write("takt: 1\ngraph: tiny\nvalues:\n  stereo.table: \"123\"\n");
  state.keep({{"stereo.gain", "2"}});
  CHECK(std::get<std::string>(param(state.load(), "table").value) == "123");
}

TEST_CASE("what does not fit the graph is an error with its place and the way out, and nothing is loaded") {
  const State state;
  const std::string head = "takt: 1\ngraph: tiny\nvalues:\n";
  const auto wrong = [&](const std::string& line, int column, const std::string& words) {
    state.write(head + "  " + line + "\n");
    test::expect(state.load(), "tiny.yaml", 4, column, {words, "takt set --forget " + line.substr(0, line.find(':'))});
    CHECK(forget_value(state.file, "tiny", line.substr(0, line.find(':'))));
    CHECK(state.load().graph);
  };
  wrong("stereos.max_range: 12m", 3, "did you mean `stereo`");
  wrong("stereo.max_rang: 12m", 3, "did you mean `max_range`");
  wrong("stereo.max_range: 120m", 21, "must lie in 0.5..50 (in m)");
  wrong("stereo.max_range: 12", 21, "without a unit");
  wrong("camera.rate: 12", 3, "there is no node `camera`");
}

TEST_CASE("a file that is no overlay is refused, and is not written over") {
  const State state;
  for (const std::string text :
       {"takt: 2\ngraph: tiny\n", "takt: 1\ngraph: other\n", "takt: 1\nvalue: {}\n", "- 1\n", "takt: 1\nvalues: [1]\n",
        "takt: 1\nvalues: {stereo: 1}\n", "takt: [\n", "graph: tiny\n"}) {
    CAPTURE(text);
    state.write(text);
    CHECK_FALSE(state.load().graph);
    CHECK_FALSE(change_overlay(state.file, "tiny", {{"stereo.gain", "2"}}));
    CHECK(state.text() == text);
  }
  CHECK_FALSE(change_overlay({}, "tiny", {{"stereo.gain", "2"}}));
  CHECK_FALSE(change_overlay("/proc/no/such.yaml", "tiny", {{"stereo.gain", "2"}}));
  state.write("takt: 1\nvalues: {}\n");
  CHECK_FALSE(change_overlay(state.file, "tiny", {{"stereo.table", "two\nlines"}}));
}

TEST_CASE("the folder of state is the first that the environment names") {
  CHECK(state_folder("/a", "/b", "/c", "/d") == "/a");
  CHECK(state_folder(nullptr, "/var/lib/takt:/var/lib/more", "/c", "/d") == "/var/lib/takt");
  CHECK(state_folder("", nullptr, "/c", "/d") == "/c/takt");
  CHECK(state_folder(nullptr, nullptr, nullptr, "/d") == "/d/.local/state/takt");
  CHECK(state_folder(nullptr, nullptr, nullptr, nullptr).empty());
  CHECK(overlay_file({}, "ace").empty());
}
