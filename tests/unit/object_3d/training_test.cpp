// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/training.hpp"

#include <doctest/doctest.h>

#include <sstream>

using namespace takt::object_3d;

namespace {

std::string error_of(const std::string& text) {
  std::istringstream in(text);
  try {
    parse_training(in, "file.txt");
  } catch (const TrainingError& error) {
    return error.what();
  }
  return "";
}

bool says(const std::string& text, const std::string& words) {
  const std::string error = error_of(text);
  CAPTURE(error);
  CHECK(error.find(words) != std::string::npos);
  return error.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("training data: classes in their order, numbers at their attributes, comments passed over") {
  std::istringstream in(
      "# made by hand\nattributes height length\n\nclass box  # a box\nsample 0.5 1\nsample 0.6 2\nclass can\nsample 3 "
      "4\n");
  const Training training = parse_training(in, "file.txt");
  CHECK(training.classes == std::vector<std::string>{"box", "can"});
  CHECK(training.used == std::vector<Attribute>{Attribute::height, Attribute::length});
  REQUIRE(training.samples.size() == 3);
  CHECK(value(training.samples[1].attributes, Attribute::height) == 0.6f);
  CHECK(value(training.samples[2].attributes, Attribute::length) == 4);
  CHECK(value(training.samples[2].attributes, Attribute::width) == 0);
  CHECK(training.samples[2].class_id == 1);
}

TEST_CASE("what was written is read again") {
  Training training{{Attribute::area, Attribute::grey}, {"a", "b"}, {}};
  training.samples.resize(2);
  training.samples[1].class_id = 1;
  training.samples[0].attributes[static_cast<size_t>(Attribute::area)] = 0.012345f;
  training.samples[1].attributes[static_cast<size_t>(Attribute::grey)] = 1e-7f;
  std::stringstream text;
  write_training(text, training);
  const Training again = parse_training(text, "file.txt");
  CHECK(again.classes == training.classes);
  CHECK(again.used == training.used);
  for (size_t i = 0; i < 2; ++i) CHECK(again.samples[i].attributes == training.samples[i].attributes);
}

TEST_CASE("mistakes in training data are told with file, line and what is valid") {
  CHECK(says("", "file.txt:0: names no class"));
  CHECK(says("attributes length\nclas box\n", "file.txt:2: unknown word `clas`; valid are attributes, class, sample"));
  CHECK(says("attributes length lenght\n", "file.txt:1: unknown attribute `lenght`; valid are length, width, height"));
  CHECK(says("attributes length length\n", "`length` stands there twice"));
  CHECK(says("attributes\n", "takes at least one name"));
  CHECK(says("attributes length\nattributes width\n", "file.txt:2: `attributes` stands there a second time"));
  CHECK(says("class box\n", "file.txt:1: `class` stands before `attributes"));
  CHECK(says("attributes length\nsample 1\n", "file.txt:2: `sample` stands before the first `class"));
  CHECK(says("attributes length\nclass a\nsample 1 2\n", "file.txt:3: the sample has 2 numbers, must have 1"));
  CHECK(says("attributes length\nclass a\nsample 1x\n", "`1x` is no number"));
  CHECK(says("attributes length\nclass a\nsample nan\n", "`nan` is no number"));
  CHECK(says("attributes length\nclass a\nclass b\n", "file.txt:3: class `a` has no sample"));
  CHECK(says("attributes length\nclass a\nsample 1\nclass b\n", "class `b` has no sample"));
  CHECK(says("attributes length\nclass a\nsample 1\nclass a\n", "class `a` is there already"));
  CHECK(says("attributes length\nclass a b\n", "takes exactly one name"));
  CHECK_THROWS_WITH_AS(read_training("/nonexistent/t.txt"), doctest::Contains("/nonexistent/t.txt: cannot be read"),
                       TrainingError);
}
