// SPDX-License-Identifier: Apache-2.0
// Co-occurrences on a card that is played by the definition: what is asked of it, and what becomes of its answers.
#include "nodes/object_detection/cuda_cooccurrences.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "nodes/object_detection/detector.hpp"
#include "nodes/object_detection/reference.hpp"
#include "nodes/object_detection/scenes.hpp"
#include "tests/unit/object_detection/objects.hpp"

using namespace takt;
using namespace takt::object_detection;

namespace takt::cuda {
/// Keeps what the shape of make_cooccurrences points to, which it need not after that call.
struct CooccurrencesOnCard {
  CooccurrenceShape shape;
  std::vector<CooccurrenceObject> objects;
  std::vector<std::vector<uint8_t>> colours;
  std::vector<std::vector<uint32_t>> rows;
  explicit CooccurrencesOnCard(const CooccurrenceShape& of)
      : shape(of), objects(of.of_object, of.of_object + of.objects) {
    for (const CooccurrenceObject& object : objects) {
      colours.emplace_back(object.colour_of_slot, object.colour_of_slot + object.colours);
      rows.emplace_back(object.rows, object.rows + object.views * object.row_stride);
    }
  }
};
}  // namespace takt::cuda

namespace {

cuda::Outcome outcome_of_pairs = cuda::Outcome::done;
int pair_calls = 0, pair_questions = 0, pair_cards = 0;

uint32_t missing_in(const cuda::CooccurrencesOnCard& card, const std::vector<uint32_t>& counts, size_t object,
                    size_t view) {
  const auto& colours = card.colours[object];
  const uint32_t* row = card.rows[object].data() + view * static_cast<size_t>(card.objects[object].row_stride);
  uint32_t missing = 0;
  for (size_t a = 0; a < colours.size(); ++a)
    for (size_t b = a; b < colours.size(); ++b)
      for (int k = 1; k <= card.shape.distances; ++k) {
        const uint32_t wanted = *row++,
                       there = counts[pair_bin(colours[a], colours[b], k, card.shape.colours, card.shape.distances)];
        missing += wanted > there ? wanted - there : 0;
      }
  return missing;
}

cuda::Outcome find_by_definition(cuda::CooccurrencesOnCard* card, const cuda::CooccurrenceCall* call, int64_t) {
  ++pair_calls;
  pair_questions = call->questions_count;
  if (outcome_of_pairs != cuda::Outcome::done) return outcome_of_pairs;
  const auto& shape = card->shape;
  const ImageView<const uint8_t> image(call->bgr, shape.width, shape.height, 3, call->stride);
  std::vector<std::vector<uint32_t>> counts;
  for (int i = 0; i < call->windows_count; ++i)
    counts.push_back(cooccurrence_window_reference(image, call->windows[i].x, call->windows[i].y, shape.side,
                                                   {shape.colours, shape.distances}));
  int most = 0;
  for (const auto& object : card->objects) most = std::max(most, object.views);
  for (int q = 0; q < call->questions_count; ++q) {
    const auto object = static_cast<size_t>(call->questions[q].object);
    for (int view = 0; view < card->objects[object].views; ++view)
      call->missing[q * most + view] =
          missing_in(*card, counts[static_cast<size_t>(call->questions[q].window)], object, static_cast<size_t>(view));
  }
  return cuda::Outcome::done;
}

const cuda::Table kPairShim{"",
                            [](char*) -> int32_t { return 1; },
                            [](int32_t, char*) {},
                            nullptr,
                            nullptr,
                            nullptr,
                            [](const cuda::CooccurrenceShape* shape, int32_t, char*) {
                              return ++pair_cards, new cuda::CooccurrencesOnCard(*shape);
                            },
                            find_by_definition,
                            [](cuda::CooccurrencesOnCard* card) { --pair_cards, delete card; },
                            [](void*, size_t) { return true; },
                            [](void*) {}};

const cuda::CardUse kPairs{{&kPairShim, 0, "a shim"}, 1'500'000};

struct TwoDetectors {
  std::vector<DatabaseObject> database = read_database(test::kObjects, 48, TestViews::read);
  DetectorParameters p = [] {
    DetectorParameters wanted;
    wanted.scales = {1, 0.7};
    return wanted;
  }();
  Detector plain{640, 480, database, p}, with_card{640, 480, database, p};
  std::vector<Detection> one = std::vector<Detection>(50), other = one;

  TwoDetectors() {
    outcome_of_pairs = cuda::Outcome::done;
    pair_calls = 0;
    with_card.use(kPairs);
  }
  /// Both search the scene; how often the card was asked.
  int calls_for(uint64_t seed) {
    SceneParameters wanted;
    wanted.fewest_objects = 1;
    const Scene scene = make_scene(database, wanted, seed, 0);
    pair_calls = 0;
    REQUIRE(plain.run(scene.view()));
    REQUIRE(with_card.run(scene.view()));
    const size_t count = plain.detections(0, one);
    REQUIRE(count > 0);
    REQUIRE(with_card.detections(0, other) == count);
    for (size_t i = 0; i < count; ++i) {
      CHECK(one[i].class_id == other[i].class_id);
      CHECK(one[i].score == other[i].score);
      CHECK(one[i].x_px == other[i].x_px);
      CHECK(one[i].y_px == other[i].y_px);
    }
    return pair_calls;
  }
};

}  // namespace

TEST_CASE("object_detection: with a card the same is found, and all windows of a scale are asked for at once") {
  {
    TwoDetectors two;
    CHECK(pair_cards == 2);
    CHECK(two.calls_for(1) == 2 + 2);  // each scale meets it first
    CHECK(two.calls_for(1) == 2);
    CHECK(pair_questions > 0);
    CHECK(two.calls_for(2) == 2);
    CHECK(two.with_card.trouble().empty());
  }
  CHECK(pair_cards == 0);
}

TEST_CASE("object_detection: what a card is late with or fails to count the CPU counts") {
  TwoDetectors two;
  two.calls_for(1);
  outcome_of_pairs = cuda::Outcome::late;
  CHECK(two.calls_for(1) == 2);
  CHECK(two.with_card.trouble() == "a shim was later than 1500 us");
  outcome_of_pairs = cuda::Outcome::done;
  CHECK(two.calls_for(1) == 2);
  CHECK(two.with_card.trouble().empty());
  outcome_of_pairs = cuda::Outcome::failed;
  CHECK(two.calls_for(1) == 2);
  CHECK(two.calls_for(2) == 0);
  CHECK(two.with_card.trouble() == "a shim has failed, and is not asked again");
  two.with_card.leave_card("gone");
  CHECK(pair_cards == 0);
  CHECK(two.calls_for(1) == 0);
  CHECK(two.with_card.trouble() == "gone");
}

TEST_CASE("object_detection: a card without co-occurrences to count is refused") {
  const auto database = read_database(test::kObjects, 48, TestViews::skip);
  DetectorParameters p;
  p.last = Stage::orientation;
  Detector detector(640, 480, database, p);
  CHECK_THROWS_AS(detector.use(kPairs), std::invalid_argument);
}
