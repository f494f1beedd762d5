// SPDX-License-Identifier: Apache-2.0
#include "graph/view/html_report.hpp"

#include <cmath>

#include "fixture.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::view;
using test::has;
using Json = nlohmann::ordered_json;

namespace {

Json distribution(double p50, double p99, double max) {
  return {{"p50", p50}, {"p99", p99}, {"p999", nullptr}, {"max", max}};
}

Json node(const std::string& name, int released, int completed, int misses) {
  return {{"name", name},
          {"rate_hz", 15.0},
          {"criticality", "high"},
          {"released", released},
          {"completed", completed},
          {"deadline_misses", misses},
          {"granted", {{"policy", "deadline"}, {"cpus", {0, 1}}, {"verified", true}}},
          {"lateness_us", distribution(41, 87, 93)},
          {"exec_ms", distribution(8.25, 12.5, 12.75)},
          {"lateness_histogram_us", {{32, 3}, {64, 180}, {128, 17}}}};
}

/// As `takt run` writes it, small enough to see what must be on the page.
Json full_report() {
  Json report;
  report["graph"] = "ace";
  report["schedule"] = "thesis";
  report["profile"] = "sim";
  report["clock"] = "real";
  report["policy_asked"] = report["policy_granted"] = "deadline";
  report["duration_s"] = 20.0;
  report["machine"] = {{"cpu", "Some CPU"}, {"cores", 2}};
  report["ok"] = false;
  report["modes"] = Json::array({{{"name", "full"}, {"from_s", 0.0}, {"to_s", 20.0}, {"reason", "start"}}});
  report["nodes"] = {node("stereo", 300, 300, 0), node("ego_motion", 200, 150, 7)};
  report["edges"] = {{{"from", "stereo.disparity"}, {"to", "ego_motion.disparity"}, {"sent", 299}, {"dropped", 98}}};
  report["chains"] = {
      {{"name", "obstacle"}, {"age_ms", distribution(82, 101, 812)}, {"bound_ms", 700.0}, {"within", false}}};
  report["memory"] = {{"shm_mb", 92.25},
                      {"rss_mb", 415},
                      {"pools", {{{"port", "stereo.cloud"}, {"bytes", 1000000}, {"chunks", 7}, {"exhausted", 2}}}}};
  report["cpu"] = {{"utilisation", 0.4},
                   {"by", {{"nodes", 0.26}, {"devices", 0.01}, {"simulator", 0.13}, {"runtime", 0.0}}}};
  report["host_stall_ms"] = 60;
  report["adjusted"] = {"policy <deadline> -> cooperative"};
  report["timeline"] = {
      {{"node", "stereo"}, {"cpu", 0}, {"release_ms", 1026.0}, {"start_ms", 1026.05}, {"finish_ms", 1035.0}},
      {{"node", "ego_motion"}, {"cpu", 0}, {"release_ms", 1030.0}, {"start_ms", 1030.5}, {"finish_ms", 1150.0}},
      {{"node", "stereo"}, {"cpu", 1}, {"release_ms", 1092.7}, {"start_ms", 1092.8}, {"finish_ms", 1101.0}}};
  return report;
}

}  // namespace

TEST_CASE("The page shows what the report holds") {
  const test::TemporaryFolder folder;
  const std::string page = html_report(ace_registry(), full_report(), test::load_ace(), folder.path);
  for (const char* words :
       {"<!DOCTYPE html>", "ace on thesis", "NOT OK", "deadline granted (asked deadline), verified",
        "read back for 2 of 2 nodes", "20.0 s", "Some CPU", "60 ms taken by the host",
        "policy &lt;deadline&gt; -&gt; cooperative", "<svg xmlns", "head_camera.pair → mapping_3d.obstacles",
        "EXCEEDED", "92.2 MB shared", "stereo.cloud", "7.00", "simulator 0.130"}) {
    CAPTURE(words);
    CHECK(has(page, words));
  }
  for (const char* name : {"stereo", "ego_motion"}) {
    CHECK(has(page, "<td>" + std::string(name) + "</td>"));
    CHECK(has(page, "<h3>" + std::string(name) + "</h3>"));
  }
  CHECK(has(page, "<td class=\"n bad\">7</td>"));    // misses
  CHECK(has(page, "<td class=\"n bad\">150</td>"));  // fell behind
  CHECK(has(page, "<td class=\"n\">300</td>"));
}

TEST_CASE("The page is self-contained") {
  const test::TemporaryFolder folder;
  folder.write("left.png", "\x89PNG\r\n\x1a\n<not much>");
  const std::string page = html_report(ace_registry(), full_report(), test::load_ace(), folder.path);
  CHECK_FALSE(has(page, "<script"));
  CHECK_FALSE(has(page, "<link"));
  CHECK_FALSE(has(page, "url("));
  CHECK_FALSE(has(page, "@import"));
  CHECK(test::count(page, "http") == 1);  // the name space of the SVG
  CHECK(test::count(page, "src=") == test::count(page, "src=\"data:"));
  CHECK(test::count(page, "<section>") == test::count(page, "</section>"));
  CHECK(test::count(page, "<tr>") == test::count(page, "</tr>"));
  CHECK(test::count(page, "<table>") == test::count(page, "</table>"));
}

TEST_CASE("Histograms and timeline are drawn from the report") {
  const test::TemporaryFolder folder;
  const auto graph = test::load_ace();
  const std::string page = html_report(ace_registry(), full_report(), graph, folder.path);
  CHECK(has(page, "up to 64 µs: 180 jobs"));
  CHECK(test::count(page, "class=\"bar\"") == 6);
  CHECK(has(page, ">core 0</text>"));
  CHECK(has(page, ">core 1</text>"));
  // Every job once on its core, once in its node's row; the window starts at the ten ms before the first release.
  CHECK(test::count(page, "<title>stereo: start") == 4);
  CHECK(has(page, "stereo: start 6.05 ms, finish 15.00 ms, core 0"));
  // ego_motion's deadline of 80 ms is at 1110 ms, and it finished at 1150 ms.
  CHECK(test::count(page, "late deadline\" d=\"M") == 1);
  Json report = full_report();
  report["timeline"][1]["finish_ms"] = 1109.0;
  CHECK(test::count(html_report(ace_registry(), report, graph, folder.path), "late deadline\" d=\"M") == 0);
}

TEST_CASE("Buckets too fine to be seen are added up, none is lost") {
  const test::TemporaryFolder folder;
  Json report = full_report();
  report["nodes"].erase(1);
  Json fine = Json::array();
  for (int i = 0; i < 700; ++i) fine.push_back({40 * std::pow(2, i / 128.0), i % 3});
  report["nodes"][0]["lateness_histogram_us"] = fine;
  const std::string page = html_report(ace_registry(), report, test::load_ace(), folder.path);
  int jobs = 0;
  size_t bars = 0;
  for (size_t at = page.find("<title>up to "); at != std::string::npos; at = page.find("<title>up to ", at + 1), ++bars)
    jobs += std::stoi(page.substr(page.find(": ", at) + 2));
  CHECK(jobs == 233 * 3);
  CHECK(bars <= 18);  // 5.5 octaves are 1.65 decades
}

TEST_CASE("Jobs that overlap on one core stand in two lanes") {
  const test::TemporaryFolder folder;
  const auto graph = test::load_ace();
  const auto lane_height = [&](double second_start_ms) {
    Json report = full_report();
    report["timeline"][2]["cpu"] = 0;
    report["timeline"][1]["start_ms"] = second_start_ms;
    report["timeline"][1]["finish_ms"] = 1090.0;
    const std::string page = html_report(ace_registry(), report, graph, folder.path);
    const size_t at = page.find("class=\"lane\""), height = page.find("height=\"", at);
    return std::stod(page.substr(height + 8));
  };
  CHECK(lane_height(1030.0) == doctest::Approx(2 * lane_height(1036.0)));
}

TEST_CASE("Pictures of the output folder are inlined") {
  const test::TemporaryFolder folder;
  folder.write("track.png", std::string("\x89PNG\r\n\x1a\n") + "ab");
  folder.write("a<b.png", std::string("\x89PNG\r\n\x1a\n") + "abc");
  folder.write("fake.png", "GIF89a");
  folder.write("notes.txt", "text");
  const std::string page = html_report(ace_registry(), full_report(), test::load_ace(), folder.path);
  CHECK(has(page, "src=\"data:image/png;base64,iVBORw0KGgphYg==\"><figcaption>track.png</figcaption>"));
  CHECK(has(page, "src=\"data:image/png;base64,iVBORw0KGgphYmM=\"><figcaption>a&lt;b.png</figcaption>"));
  CHECK(has(page, "fake.png: is no PNG image"));
  CHECK_FALSE(has(page, "notes.txt"));
}

TEST_CASE("What the report lacks is said, key by key") {
  const test::TemporaryFolder folder;
  const auto graph = test::load_ace();
  const Json full = full_report();
  for (const auto& [key, value] : full.items()) {
    Json report = full;
    report.erase(key);
    const std::string erased = key;
    CAPTURE(erased);
    const size_t with = test::count(html_report(ace_registry(), full, graph, folder.path), "not recorded");
    const bool in_graph_too = key == "graph";
    CHECK(test::count(html_report(ace_registry(), report, graph, folder.path), "not recorded") >=
          with + (in_graph_too ? 0 : 1));
  }
  const std::string empty = html_report(ace_registry(), Json::object(), graph, folder.path);
  CHECK(test::count(empty, "not recorded") >= 15);
  CHECK(has(empty, "<svg xmlns"));
}

TEST_CASE("A histogram or timeline that is missing is said; an empty one has no sample") {
  const test::TemporaryFolder folder;
  const auto graph = test::load_ace();
  Json report = full_report();
  report["nodes"][0].erase("lateness_histogram_us");
  report["nodes"][1]["lateness_histogram_us"] = Json::array();
  report["timeline"] = Json::array();
  const std::string page = html_report(ace_registry(), report, graph, folder.path);
  CHECK(has(page, "<h3>stereo</h3>\n<p class=\"note\">not recorded</p>"));
  CHECK(has(page, "<h3>ego_motion</h3>\n<p class=\"note\">no sample</p>"));
  CHECK(has(page, "no job in this second"));
}

TEST_CASE("Values of the wrong kind never throw") {
  const test::TemporaryFolder folder;
  const auto graph = test::load_ace();
  const Json full = full_report();
  const auto survives = [&](const Json& report) {
    CHECK(has(html_report(ace_registry(), report, graph, folder.path), "</html>"));
  };
  for (const Json& wrong : {Json(nullptr), Json("text"), Json(-1.5), Json(1e300),
                            Json::array({1, "a", nullptr, Json::array()}), Json::object({{"a", 1}}), Json(true)}) {
    survives(wrong);
    for (const auto& [key, value] : full.items()) {
      Json report = full;
      report[key] = wrong;
      survives(report);
    }
    for (const auto& [key, value] : full["nodes"][0].items()) {
      Json report = full;
      report["nodes"][0][key] = wrong;
      survives(report);
    }
    for (const auto& [key, value] : full["timeline"][0].items()) {
      Json report = full;
      report["timeline"][0][key] = wrong;
      CHECK(html_report(ace_registry(), report, graph, folder.path).size() < 2'000'000);
    }
  }
}
