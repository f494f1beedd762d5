// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "graph/check/doctor_text.hpp"
#include "graph/check/figures_file.hpp"
#include "rt/machine/parse.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using graph::doctor_json;
using graph::doctor_text;
using graph::figures_file;
using graph::measured_json;
using graph::measured_text;
using graph::write_whole;
using machine::Finding;
using machine::Status;

namespace {

const machine::Identity kHere{"Some CPU", 2, "6.1.0 #1 SMP"};

std::vector<Finding> findings() {
  const std::string words =
      "a value that is long enough to be broken between two of its words, and then once more "
      "because it has so many of them";
  return {{"policies", "first", machine::Need::deadline, Status::ok, "granted", "what it is for"},
          {"policies",
           "second",
           machine::Need::fixed,
           Status::lacks,
           words,
           "meaning",
           {{"shell",
             "sudo something --with a --very-long list --of options --that does not --fit into --one line "
             "--of eighty"},
            {"systemd unit", "[Service]\nOne=1\nTwo=2"}}},
          {"memory", "third", machine::Need::advice, Status::unknown, "nobody knows", "meaning"}};
}

}  // namespace

TEST_CASE("the text is 80 columns wide, and a broken command can be pasted") {
  const std::string text = doctor_text(kHere, findings());
  machine::for_each_line(text, [](std::string_view line) {
    CAPTURE(line);
    CHECK(line.size() <= 80);
  });
  CHECK(text.find(" \\\n") != std::string::npos);
  CHECK(text.find("            [Service]\n            One=1\n") != std::string::npos);
  CHECK(text.find("3 checks: 1 ok, 0 warn, 1 lacks, 1 unknown\n") != std::string::npos);
  CHECK(text.find("\npolicies\n") < text.find("\nmemory\n"));
  CHECK(text.find("  lacks   second: a value") != std::string::npos);
}

TEST_CASE("the same as JSON") {
  const auto json = doctor_json(kHere, findings());
  CHECK(json["machine"]["cores"] == 2);
  CHECK(json["checks"].size() == 3);
  CHECK(json["checks"][1]["status"] == "lacks");
  CHECK(json["checks"][1]["fixes"][1]["where"] == "systemd unit");
  CHECK(json["counts"]["unknown"] == 1);
}

TEST_CASE("where the figures of a machine go") {
  CHECK(figures_file("/x/m.json", "/cache", "/home/a") == "/x/m.json");
  CHECK(figures_file(nullptr, "/cache", "/home/a") == "/cache/takt/machine.json");
  CHECK(figures_file("", "", "/home/a") == "/home/a/.cache/takt/machine.json");
  CHECK(figures_file(nullptr, nullptr, nullptr).empty());
}

TEST_CASE(
    "figures to be charged: 99th percentiles, the dearer transport, the largest overrun; absent if not measured") {
  const auto spread = [](double p50, double p99, double max, int64_t samples) {
    return machine::Spread{p50, p99, max, samples};
  };
  machine::Measured m;
  const auto nothing = measured_json(kHere, "now", m);
  for (const char* key : {"policy", "release_us", "switch_us", "publish_us", "take_us", "per_mb_us", "enforcement_us",
                          "demotion_us", "tick_us", "deadline_bandwidth"}) {
    CAPTURE(key);
    CHECK(!nothing.contains(key));
  }
  m.release = machine::ReleaseCost{Policy::fixed, spread(10, 50, 900, 800)};
  m.context_switch = machine::SwitchCost{true, spread(1, 2, 30, 20)};  // too few for a 99th percentile
  machine::TransferCosts local{};
  for (size_t i = 0; i < local.size(); ++i)
    local[i] = {machine::kTransferBytes[i], spread(1, 2, 3, 1000), spread(1, 4, 9, 1000)};
  auto iceoryx = local;
  iceoryx[0].publish = spread(5, 7, 9, 1000);
  local[2].take = spread(1 + 3.686272, 9, 9, 1000);  // one us a megabyte
  m.local = local;
  m.iceoryx = iceoryx;
  m.reservation_overrun = spread(2000, 3500, 4100, 100);
  m.watchdog_overrun = spread(10, 20, 45, 300);
  m.tick_us = 4000;
  m.bandwidth = machine::BandwidthLimit{1.8, 0};
  const auto json = measured_json(kHere, "now", m);
  CHECK(json["policy"] == "fixed");
  CHECK(json["release_us"] == 50);
  CHECK(json["switch_us"] == 30);
  CHECK(json["publish_us"] == 7);
  CHECK(json["take_us"] == 4);
  CHECK(json["per_mb_us"].get<double>() == doctest::Approx(1));
  CHECK(json["enforcement_us"] == 4100);
  CHECK(json["demotion_us"] == 45);
  CHECK(json["tick_us"] == 4000);
  CHECK(json["deadline_bandwidth"] == 1.8);
  CHECK(json["measured_at"] == "now");
  CHECK(json["machine"]["cpu"] == "Some CPU");
  CHECK(json["details"]["release_us"]["samples"] == 800);
  machine::for_each_line(measured_text(m), [](std::string_view line) { CHECK(line.size() <= 80); });
}

TEST_CASE("a file is replaced as a whole, its folder made; where that fails the reason is told") {
  const test::TemporaryFolder folder;
  const auto file = folder.path / "deep/file.json";
  CHECK(write_whole(file, "one") == "");
  CHECK(write_whole(file, "two") == "");
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  CHECK(text.str() == "two");
  CHECK(write_whole(file / "below", "three") != "");
  CHECK(std::distance(std::filesystem::directory_iterator(file.parent_path()), {}) == 1);
}
