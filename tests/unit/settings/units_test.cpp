// SPDX-License-Identifier: Apache-2.0
#include "hal/settings/units.hpp"

#include <doctest/doctest.h>

#include "hal/settings/settings.hpp"

using namespace takt;

TEST_CASE("quantities carry their unit") {
  CHECK(*parse_quantity("0.24m", Dimension::length) == doctest::Approx(0.24));
  CHECK(*parse_quantity(" 24 cm ", Dimension::length) == doctest::Approx(0.24));
  CHECK(*parse_quantity("-90deg", Dimension::angle) == doctest::Approx(-1.5707963));
  CHECK(*parse_quantity("30000/1001", Dimension::rate) == doctest::Approx(29.97003));
  CHECK(*parse_quantity("+3", Dimension::number) == 3);
  for (const char* bad : {"", "0.24", "0.24deg", "m", "1e999m", "nanm", "infm", "0.2 4m"})
    CHECK_FALSE(parse_quantity(bad, Dimension::length));
  CHECK_FALSE(parse_quantity("15/0", Dimension::rate));
}

TEST_CASE("settings keep the first mistake and go on with defaults") {
  const nlohmann::json values = {{"range", "8"}, {"beams", 2.5}, {"fov", "180deg"}, {"on", "yes"}};
  Settings settings("laser", values, "/graph");
  CHECK(settings.quantity("fov", Dimension::angle, 0.0) == doctest::Approx(3.14159265));
  CHECK_FALSE(settings.error().has_value());
  CHECK(settings.quantity("range", Dimension::length, 5.0) == 5.0);
  CHECK(settings.count("beams", 181, 2, 4096) == 181);
  CHECK(settings.flag("on", true));
  REQUIRE(settings.error().has_value());
  CHECK(settings.error()->id == "laser");
  CHECK(settings.error()->what.find("`range`") != std::string::npos);
}

TEST_CASE("paths start at the graph's directory") {
  const nlohmann::json values = {{"rig", "rigs/a.yaml"}, {"absolute", "/b.yaml"}};
  Settings settings("camera", values, "/graph");
  CHECK(settings.path("rig", true) == "/graph/rigs/a.yaml");
  CHECK(settings.path("absolute", true) == "/b.yaml");
  CHECK(settings.path("none", false).empty());
  CHECK_FALSE(settings.error().has_value());
  CHECK(settings.path("none", true).empty());
  CHECK(settings.error().has_value());
}
