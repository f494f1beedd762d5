// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_3d/classifier.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace takt::object_3d;

namespace {

Attributes at(double length, double width) {
  Attributes b{};
  b[static_cast<size_t>(Attribute::length)] = static_cast<float>(length);
  b[static_cast<size_t>(Attribute::width)] = static_cast<float>(width);
  return b;
}

/// Mean 0 and variance 1 in both attributes: scaling leaves them as they are.
Training corners() {
  return {{Attribute::length, Attribute::width},
          {"south", "north"},
          {{0, at(-1, -1)}, {0, at(1, -1)}, {1, at(-1, 1)}, {1, at(1, 1)}}};
}

/// `classes` clumps on a circle of radius 4.
Training clumps(size_t classes, size_t each, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<> noise(0, 0.4);
  Training training{{Attribute::length, Attribute::width}, {}, {}};
  for (size_t c = 0; c < classes; ++c) {
    training.classes.push_back("class" + std::to_string(c));
    const double angle = 6.283185 * static_cast<double>(c) / static_cast<double>(classes);
    for (size_t i = 0; i < each; ++i)
      training.samples.push_back({c, at(4 * std::cos(angle) + noise(random), 4 * std::sin(angle) + noise(random))});
  }
  return training;
}

}  // namespace

TEST_CASE("nearest neighbour: the likenesses of the formula, by hand") {
  NearestNeighbour nearest(corners(), {});
  const Answer at_sample = nearest.classify(at(1, 1));
  CHECK(at_sample.class_id == 1);
  CHECK(at_sample.score == doctest::Approx(1 / (1 + std::exp(-2.0))));  // the other class is 2 away
  const Answer between = nearest.classify(at(1, 0));
  CHECK(between.class_id == kUnknown);  // both classes alike: 0.5 is below t_p
  CHECK(between.score == doctest::Approx(0.5));
  CHECK(nearest.classify(at(1, 3.1)).class_id == 1);         // q = exp(-2.205) = 0.11
  CHECK(nearest.classify(at(1, 3.2)).class_id == kUnknown);  // q = 0.089, below t_q
  CHECK(nearest.classify(at(1, 1000)).score == 0);           // no likeness at all
}

TEST_CASE("nearest neighbour without rejection always answers, unless nothing is near at all") {
  NearestNeighbour nearest(corners(), {.reject = false});
  CHECK(nearest.classify(at(1, 0.01)).class_id == 1);
  CHECK(nearest.classify(at(1, 5)).class_id == 1);
}

TEST_CASE("scaling: attributes of any unit count alike, one that never varies does not count") {
  Training training = corners();
  training.used.push_back(Attribute::height);
  for (Sample& sample : training.samples) {
    sample.attributes[static_cast<size_t>(Attribute::length)] =
        1000 * value(sample.attributes, Attribute::length) + 5000;
    sample.attributes[static_cast<size_t>(Attribute::height)] = 7;
  }
  Attributes b = at(6000, 1);
  b[static_cast<size_t>(Attribute::height)] = 7;
  NearestNeighbour nearest(training, {});
  CHECK(nearest.classify(b).score == doctest::Approx(1 / (1 + std::exp(-2.0))));
}

TEST_CASE("support vector machines: n against the rest, n (n - 1) / 2 in pairs, decisions as OpenCV's") {
  for (const size_t classes : {2, 3, 6}) {
    const Training training = clumps(classes, 20, 1), test = clumps(classes, 20, 2);
    SupportVectorMachines rest(training, {SvmScheme::one_vs_rest}), pairs(training, {SvmScheme::pairwise});
    CHECK(rest.machines() == classes);
    CHECK(pairs.machines() == classes * (classes - 1) / 2);
    CHECK(rest.largest_difference() < 1e-5);
    CHECK(pairs.largest_difference() < 1e-5);
    for (const Sample& sample : test.samples) {
      const auto wanted = static_cast<int>(sample.class_id);
      CHECK(rest.classify(sample.attributes).class_id == wanted);
      CHECK(pairs.classify(sample.attributes).class_id == wanted);
    }
  }
}

TEST_CASE("one against the rest knows that nothing fits; pairs always answer") {
  const Training training = clumps(4, 30, 3);
  SupportVectorMachines rest(training, {SvmScheme::one_vs_rest}), pairs(training, {SvmScheme::pairwise});
  const Attributes far = at(40, 40);
  CHECK(rest.classify(far).class_id == kUnknown);
  CHECK(pairs.classify(far).class_id != kUnknown);
}

TEST_CASE("one class is too few for a support vector machine") {
  CHECK_THROWS_AS(SupportVectorMachines(clumps(1, 5, 1), {}), TrainingError);
}
