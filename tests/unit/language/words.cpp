// SPDX-License-Identifier: Apache-2.0
#include "graph/language/words.hpp"

#include <doctest/doctest.h>

using namespace takt::graph;

TEST_CASE("Edit distance counts inserts, deletes, replacements and swaps of neighbours") {
  CHECK(edit_distance("", "") == 0);
  CHECK(edit_distance("abc", "") == 3);
  CHECK(edit_distance("kitten", "sitting") == 3);
  CHECK(edit_distance("dispartiy", "disparity") == 1);
  CHECK(edit_distance("Pair", "pair") == 0);
}

TEST_CASE("Only near words are suggested") {
  CHECK(nearest("disparty", {"disparity", "rectified"}) == "disparity");
  CHECK(nearest("xyz", {"disparity", "rectified"}).empty());
  CHECK(nearest("a", {"b"}).empty());
  CHECK(nearest("", {"b"}).empty());
  CHECK(alternatives("par", {"b", "pair", "b"}) == "; did you mean `pair`? valid are: b, pair");
  CHECK(alternatives("x", {}) == "; valid are: (none)");
}
