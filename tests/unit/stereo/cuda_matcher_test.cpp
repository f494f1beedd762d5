// SPDX-License-Identifier: Apache-2.0
#include "nodes/stereo/cuda_matcher.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

using namespace takt;
using namespace takt::stereo;

namespace takt::cuda {
/// A card that writes what no matcher does, so that it is seen who matched.
struct StereoOnCard {
  StereoShape shape;
};
}  // namespace takt::cuda

namespace {

constexpr int16_t kOfCard = 77;
cuda::Outcome next_outcome = cuda::Outcome::done;
int asked = 0, alive = 0;
cuda::StereoCall last_call;

const cuda::Table kShim{
    "",
    [](char*) -> int32_t { return 1; },
    [](int32_t, char*) {},
    [](const cuda::StereoShape* shape, int32_t, char*) { return ++alive, new cuda::StereoOnCard{*shape}; },
    [](cuda::StereoOnCard* card, const cuda::StereoCall* call, int64_t) {
      ++asked;
      last_call = *call;
      for (int y = 0; next_outcome == cuda::Outcome::done && y < card->shape.height; ++y)
        std::fill_n(call->disparity + y * call->disparity_stride, card->shape.width, kOfCard);
      return next_outcome;
    },
    [](cuda::StereoOnCard* card) { --alive, delete card; },
    nullptr,
    nullptr,
    nullptr,
    [](void*, size_t) { return true; },
    [](void*) {}};

constexpr int kWide = 48, kHigh = 20;

struct CardScene {
  MatcherParameters p;
  std::vector<uint8_t> left = std::vector<uint8_t>(kWide * kHigh), right = left;
  std::vector<int16_t> disparity = std::vector<int16_t>(kWide * kHigh);
  std::vector<uint8_t> confidence = left;
  DisparityViews out{{disparity.data(), kWide, kHigh}, {confidence.data(), kWide, kHigh}};
  CudaMatcher matcher;

  explicit CardScene(MatcherParameters wanted = {})
      : p(wanted), matcher(kWide, kHigh, 1, wanted, {{&kShim, 0, "a shim"}, 1'500'000}) {
    for (size_t i = 0; i < left.size(); ++i)
      left[i] = static_cast<uint8_t>(i * 97 % 251), right[i] = static_cast<uint8_t>((i + 4) * 97 % 251);
    asked = 0;
    next_outcome = cuda::Outcome::done;
  }
  /// Who matched: the card, or the CPU, and then as a matcher without card does.
  bool by_card() {
    REQUIRE(matcher.match({left.data(), kWide, kHigh}, {right.data(), kWide, kHigh}, out));
    if (disparity[0] == kOfCard) return true;
    std::vector<int16_t> expected(disparity.size());
    std::vector<uint8_t> sure(disparity.size());
    const auto plain = make_matcher(kWide, kHigh, 1, p);
    REQUIRE(plain->match({left.data(), kWide, kHigh}, {right.data(), kWide, kHigh},
                         {{expected.data(), kWide, kHigh}, {sure.data(), kWide, kHigh}}));
    CHECK(disparity == expected);
    CHECK(confidence == sure);
    return false;
  }
};

}  // namespace

TEST_CASE("the card matches while it is in time; the CPU does what comes late, then all for a while") {
  MatcherParameters p;
  p.disparities = 16;
  CardScene scene(p);
  CHECK(scene.by_card());
  CHECK(scene.matcher.trouble().empty());
  next_outcome = cuda::Outcome::late;
  for (int i = 0; i < cuda::Trust::kMostLate; ++i) {
    CHECK_FALSE(scene.by_card());
    CHECK(scene.matcher.trouble() == "a shim was later than 1500 us");
  }
  next_outcome = cuda::Outcome::done;
  const int asked_before = asked;
  for (int i = 0; i < cuda::Trust::kPause; ++i) CHECK_FALSE(scene.by_card());
  CHECK(asked == asked_before);
  CHECK(scene.by_card());
  CHECK(scene.matcher.trouble().empty());
}

TEST_CASE("a card that has failed is not asked again, and is let go") {
  MatcherParameters p;
  p.disparities = 16;
  {
    CardScene scene(p);
    CHECK(alive == 1);
    next_outcome = cuda::Outcome::failed;
    CHECK_FALSE(scene.by_card());
    next_outcome = cuda::Outcome::done;
    for (int i = 0; i < 2 * cuda::Trust::kPause; ++i) CHECK_FALSE(scene.by_card());
    CHECK(asked == 1);
    CHECK(scene.matcher.trouble() == "a shim has failed, and is not asked again");
  }
  CHECK(alive == 0);
}

TEST_CASE("search and confidence change on both sides; what a card has no twin for is refused") {
  MatcherParameters p;
  p.disparities = 16;
  CardScene scene(p);
  scene.matcher.limit_search(9);
  p.min_confidence = 33;
  scene.matcher.tune(p);
  CHECK(scene.by_card());
  CHECK(last_call.disparities == 9);
  CHECK(last_call.min_confidence == 33);
  CHECK_FALSE(
      scene.matcher.match({scene.left.data(), kWide, kHigh - 1}, {scene.right.data(), kWide, kHigh}, scene.out));
  MatcherParameters mixed;
  mixed.cost = CostKind::mixed;
  CHECK_THROWS_AS(CardScene{mixed}, std::invalid_argument);
  CHECK(alive == 1);
}

TEST_CASE("the card is taken if it needs less time by the clock; one that has failed is not") {
  struct Steps final : Clock {  // the card is asked first, five times
    int64_t of_card_ns, of_twin_ns;
    mutable int64_t at_ns = 0, readings = 0;
    Steps(int64_t card, int64_t twin) : of_card_ns(card), of_twin_ns(twin) {}
    int64_t now_ns() const override { return at_ns += readings++ < 10 ? of_card_ns : of_twin_ns; }
    bool is_virtual() const override { return false; }
  };
  MatcherParameters p;
  p.disparities = 16;
  CardScene scene(p);
  CHECK(scene.matcher.is_quicker(Steps(100, 200)));
  CHECK_FALSE(scene.matcher.is_quicker(Steps(200, 100)));
  CHECK_FALSE(scene.matcher.is_quicker(Steps(0, 0)));
  next_outcome = cuda::Outcome::failed;
  CHECK_FALSE(scene.matcher.is_quicker(Steps(100, 200)));
}
