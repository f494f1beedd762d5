// SPDX-License-Identifier: Apache-2.0
// Where a property fails, says which environment repeats it.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <iostream>

#include "tests/property_scale.hpp"

int main(int argc, char** argv) {
  try {
    const double scale = takt::test::property_scale();
    const auto seed = takt::test::property_seed();
    const int code = doctest::Context(argc, argv).run();
    if (code != 0) {
      std::cerr << "this run: TAKT_PROPERTY_SCALE=" << scale << " TAKT_PROPERTY_SEED=";
      seed ? std::cerr << *seed << '\n' : std::cerr << "(unset)\n";
    }
    return code;
  } catch (const std::invalid_argument& wrong) {
    std::cerr << wrong.what() << '\n';
    return 2;
  }
}
