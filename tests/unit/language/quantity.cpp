// SPDX-License-Identifier: Apache-2.0
#include "graph/language/quantity.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

using namespace takt;
using namespace takt::graph;

TEST_CASE("Values are converted to the declared unit, rounded once") {
  CHECK(parse_in_unit("0.3m", "m").value() == 0.3);
  CHECK(parse_in_unit("30cm", "m").value() == 0.3);
  CHECK(parse_in_unit("300 mm", "m").value() == 0.3);
  CHECK(parse_in_unit("1.5km", "m").value() == 1500.0);
  CHECK(parse_in_unit("-2.5e-1m", "m").value() == -0.25);
  CHECK(parse_in_unit("180deg", "rad").value() == std::numbers::pi);
  CHECK(parse_in_unit("1rad", "rad").value() == 1.0);
  CHECK(parse_in_unit("1rad", "deg").value() == doctest::Approx(57.29577951308232).epsilon(1e-15));
  CHECK(parse_in_unit("90deg/s", "rad/s").value() == std::numbers::pi / 2);
  CHECK(parse_in_unit("2rad/s", "rad/s").value() == 2.0);
  CHECK(parse_in_unit("1.2m/s", "m/s").value() == 1.2);
  CHECK(parse_in_unit("20Hz", "Hz").value() == 20.0);
  CHECK(parse_in_unit("0.1s", "ms").value() == 100.0);
  CHECK(parse_in_unit("1/4 s", "s").value() == 0.25);
  CHECK(parse_in_unit("150", "px").value() == 150.0);
  CHECK(parse_in_unit("150px", "px").value() == 150.0);
  CHECK(parse_in_unit("1/3", "1").value() == 1.0 / 3.0);
  CHECK(parse_in_unit("3m/s2", "m/s2").value() == 3.0);
}

TEST_CASE("A missing or wrong unit says what to write") {
  CHECK(parse_in_unit("0.3", "m").error().find("write 0.3m") != std::string::npos);
  CHECK(parse_in_unit("3s", "m").error().find("m | cm | mm | km") != std::string::npos);
  CHECK(parse_in_unit("150m", "px").error().find("carries no unit: write 150") != std::string::npos);
  for (const char* text : {"",      " ",     "m",     "--3m",   "3..5m",
                           ".5m",   "5.m",   "1/0 s", "1/-3 s", "3 4m",
                           "0x10m", "1e99m", "nan",   "inf",    "9999999999999999999999m",
                           "-",     "1/",    "/3",    "3m/",    "1e400",
                           "1e-400"}) {
    CAPTURE(text);
    CHECK(!parse_in_unit(text, "m"));
  }
}

TEST_CASE("Durations are exact in nanoseconds") {
  CHECK(parse_duration_ns("15ms").value() == 15'000'000);
  CHECK(parse_duration_ns("0.1us").value() == 100);
  CHECK(parse_duration_ns("7ns").value() == 7);
  CHECK(parse_duration_ns("1/15 s").value() == 66'666'667);
  CHECK(parse_duration_ns("1/3ms").value() == 333'333);
  CHECK(parse_duration_ns("-1/15s").value() == -66'666'667);
  CHECK(parse_duration_ns("0.000000001s").value() == 1);
  CHECK(parse_duration_ns("15").error().find("write 15ms") != std::string::npos);
  CHECK(parse_duration_ns("15m").error().find("no unit of time") != std::string::npos);
  CHECK(!parse_duration_ns("1e15s"));
  CHECK(!parse_duration_ns("soon"));
  CHECK(parse_duration_ns("1.5h").value() == 5'400'000'000'000);
  CHECK(parse_duration_ns("1/3 min").value() == 20'000'000'000);
}

TEST_CASE("Each unit of time is worth the same to durations as to parameters, and is named where one is missing") {
  const std::vector<std::string> units = units_like("s");
  REQUIRE(units.size() > 4);
  const std::string missing = parse_duration_ns("3").error(), wrong = parse_duration_ns("3kg").error();
  for (const std::string& unit : units) {
    CAPTURE(unit);
    const double seconds = parse_in_unit("3" + unit, "s").value();
    CHECK(parse_duration_ns("3" + unit).value() == std::llround(seconds * 1e9));
    for (const std::string& told : {missing, wrong}) CHECK((told + " ").find(" " + unit) != std::string::npos);
  }
}

TEST_CASE("Rates are exact fractions without a unit") {
  CHECK(parse_rate("15").value() == Rate{15, 1});
  CHECK(parse_rate("7.5").value() == Rate{15, 2});
  CHECK(parse_rate("30000/1001").value() == Rate{30000, 1001});
  CHECK(parse_rate("2/6").value() == Rate{1, 3});
  CHECK(parse_rate("15Hz").error().find("write 15") != std::string::npos);
  for (const char* text : {"0", "-1", "-0.5", "0.0", "1/0", "often", "", "1e9", "1/100000000", "0.0000001"}) {
    CAPTURE(text);
    CHECK(!parse_rate(text));
  }
}
