// SPDX-License-Identifier: Apache-2.0
#include "graph/run/junit.hpp"

#include <doctest/doctest.h>
#include <tinyxml2.h>

#include <map>
#include <string>

namespace {

using Json = nlohmann::ordered_json;

Json node(const char* name, const char* criticality, int missed, int completed) {
  return {{"name", name},   {"criticality", criticality}, {"deadline_misses", missed}, {"rate_hz", 10.0},
          {"released", 20}, {"completed", completed}};
}

Json report() {
  return {{"graph", "a<b>"},
          {"duration_s", 2.0},
          {"ok", false},
          {"proofs", {{"verdict", "held"}}},
          {"nodes",
           {node("fast", "high", 0, 19), node("late", "high", 3, 20), node("low", "low", 3, 20),
            node("slow", "low", 0, 18)}}};
}

/// What a reader of JUnit files finds: failures by test case, empty where there is none.
std::map<std::string, std::string> cases_in(const std::string& text) {
  tinyxml2::XMLDocument xml;
  REQUIRE(xml.Parse(text.c_str()) == tinyxml2::XML_SUCCESS);
  const tinyxml2::XMLElement* suite = xml.FirstChildElement("testsuite");
  REQUIRE(suite != nullptr);
  std::map<std::string, std::string> cases;
  int failures = 0;
  for (auto* one = suite->FirstChildElement("testcase"); one != nullptr; one = one->NextSiblingElement("testcase")) {
    const tinyxml2::XMLElement* failure = one->FirstChildElement("failure");
    failures += failure != nullptr;
    cases[one->Attribute("name")] = failure != nullptr ? failure->Attribute("message") : "";
  }
  CHECK(suite->IntAttribute("tests") == static_cast<int>(cases.size()));
  CHECK(suite->IntAttribute("failures") == failures);
  CHECK(suite->Attribute("name") == std::string("takt.a<b>"));
  return cases;
}

}  // namespace

TEST_CASE("junit: each node is a case, and fails where the exit code has its reason") {
  const auto cases = cases_in(takt::command::junit_text(report()));
  CHECK(cases.size() == 6);
  CHECK(cases.at("fast").empty());
  CHECK(cases.at("late") == "missed 3 deadlines");
  CHECK(cases.at("low").empty());
  CHECK(cases.at("slow") == "completed 18 of 20 releases");
  CHECK(cases.at("nothing was seen above its proof").empty());
  CHECK(cases.at("every job returned").empty());
}

TEST_CASE("junit: a run that is not ok has a case that fails, whatever the reason") {
  Json hung = report();
  hung["nodes"] = Json::array({node("fast", "high", 0, 20)});
  CHECK_FALSE(cases_in(takt::command::junit_text(hung)).at("every job returned").empty());
  hung["ok"] = true;
  CHECK(cases_in(takt::command::junit_text(hung)).at("every job returned").empty());
  hung["proofs"]["verdict"] = "unexplained";
  CHECK_FALSE(cases_in(takt::command::junit_text(hung)).at("nothing was seen above its proof").empty());
}

TEST_CASE("junit: what a graph or a scenario expects decides alone") {
  Json expecting = report();
  expecting["expectations"] = {
      {"conditions",
       {{{"what", "base.odometry x_m"}, {"expected", "at least 2 m"}, {"observed", "1 m"}, {"met", false}},
        {{"what", "stop"}, {"expected", "once"}, {"observed", "yes"}, {"met", true}}}}};
  const auto cases = cases_in(takt::command::junit_text(expecting));
  CHECK(cases.size() == 2);
  CHECK(cases.at("base.odometry x_m: at least 2 m") == "expected at least 2 m, observed 1 m");
  CHECK(cases.at("stop: once").empty());
}
