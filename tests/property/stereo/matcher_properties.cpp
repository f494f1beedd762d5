// SPDX-License-Identifier: Apache-2.0
// The fast matcher against the slow reference: equal bit for bit, for every cost, odd size and SIMD target.
#include <doctest/doctest.h>

#include <array>
#include <random>
#include <string>
#include <vector>

#include "nodes/stereo/band_matcher.hpp"
#include "nodes/stereo/general_matcher.hpp"
#include "nodes/stereo/reference.hpp"
#include "nodes/stereo/semi_global_matcher.hpp"
#include "nodes/stereo/window_matcher.hpp"
#include "tests/on_each_target.hpp"
#include "tests/property/stereo/random_pairs.hpp"
#include "tests/property_scale.hpp"

using namespace takt;
using namespace takt::stereo;
using namespace takt::test;

namespace {

/// `room`: disparities that the matcher takes memory for, of which it then searches those of `p`.
void expect_equal(const Picture& left, const Picture& right, const MatcherParameters& p, int room = 0) {
  Output slow(left);
  reference::match(left.view(), right.view(), p, slow.views(left));
  MatcherParameters largest = p;
  largest.disparities = std::max(room, p.disparities);
  WindowMatcher matcher(left.width, left.height, left.channels, largest);
  matcher.limit_search(p.disparities);
  expect_equal(matcher, left, right, p, slow);
}

}  // namespace

TEST_CASE("random pairs, sizes, costs: equal to the reference on every SIMD target") {
  int targets = 0;
  on_each_target([&] {
    ++targets;
    std::mt19937 random(test::seed(7));
    for (int round = 0; round < test::rounds(60); ++round) {
      const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const int channels = pick(0, 1) ? 3 : 1;
      const int width = pick(1, round % 6 ? 45 : 200), height = pick(1, round % 6 ? 33 : 9);
      const Picture left = random_picture(random, width, height, channels, round % 3 ? 256 : 3);
      const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
      expect_equal(left, right, random_parameters(random, 60));
    }
  });
  CHECK(targets >= 1);
}

TEST_CASE("a search limited after construction: equal to the reference of the smaller range") {
  on_each_target([&] {
    std::mt19937 random(test::seed(19));
    for (int round = 0; round < test::rounds(30); ++round) {
      const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const Picture left = random_picture(random, pick(1, 45), pick(1, 33), 1, 256);
      const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
      expect_equal(left, right, random_parameters(random, 200), pick(1, 512));
    }
  });
}

TEST_CASE("rows that are wanted: equal to the reference of the whole image") {
  on_each_target([&] {
    std::mt19937 random(test::seed(37));
    for (int round = 0; round < test::rounds(40); ++round) {
      const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const Picture left = random_picture(random, pick(1, 45), pick(2, 40), 1, 256);
      const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
      const MatcherParameters p = random_parameters(random, 60);
      Output expected(left), out(left);
      reference::match(left.view(), right.view(), p, expected.views(left));
      WindowMatcher matcher(left.width, left.height, 1, p);
      for (int wish = 0; wish < 3; ++wish) {
        const int first = pick(0, left.height - 1), last = pick(first + 1, left.height);
        INFO(matcher.target(), " rows ", first, " to ", last, " of ", left.height);
        matcher.want_rows(first, last);
        REQUIRE(matcher.match(left.view(), right.view(), out.views(left)));
        CHECK(out.rows(first, last, left.width) == expected.rows(first, last, left.width));
      }
    }
  });
}

TEST_CASE("search ranges of several register blocks and strips of columns: equal to the reference") {
  on_each_target([&] {
    std::mt19937 random(test::seed(11));
    for (const int disparities : {129, 150, 193, 300, 512})
      for (const auto cost : {CostKind::gradient, CostKind::ssd, CostKind::sad, CostKind::census}) {
        const Picture left = random_picture(random, 347, 3, 3, 256);
        MatcherParameters p;
        p.disparities = disparities;
        p.cost = cost;
        p.n_square = 5;
        p.n_min = 3;
        expect_equal(left, shifted(random, left, disparities / 2, 10), p);
        p.uniqueness = 20;
        p.n_square = 3;
        if (disparities == 193) expect_equal(left, shifted(random, left, disparities / 2, 30), p);
      }
  });
}

TEST_CASE("window of 15, minimum filter of 5, the defaults: equal to the reference") {
  std::mt19937 random(test::seed(13));
  MatcherParameters p;
  p.disparities = 40;
  for (const auto cost : {CostKind::gradient, CostKind::ssd, CostKind::sad, CostKind::census})
    for (const int channels : {1, 3}) {
      p.cost = cost;
      const Picture left = random_picture(random, 71, 31, channels, 256);
      expect_equal(left, shifted(random, left, 17, 5), p);
    }
}

TEST_CASE("flat images, where every disparity ties: the smallest wins") {
  const Picture flat{33, 9, 1, std::vector<uint8_t>(33 * 9, 90)};
  MatcherParameters p;
  p.disparities = 20;
  expect_equal(flat, flat, p);
  p.uniqueness = 1;  // and is rejected once ambiguity counts
  expect_equal(flat, flat, p);
}

TEST_CASE("semi-global matching of random pairs: equal to the reference on every SIMD target") {
  on_each_target([&] {
    std::mt19937 random(test::seed(23));
    for (int round = 0; round < test::rounds(30); ++round) {
      const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const int channels = pick(0, 1) ? 3 : 1;
      const Picture left = random_picture(random, pick(1, 60), pick(1, 20), channels, round % 3 ? 256 : 3);
      const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
      MatcherParameters p = random_parameters(random, 140);
      p.cost = CostKind::census;
      p.selection = Selection::semi_global;
      p.n_square = p.n_min = 1;
      p.c_max = pick(1, 48);
      p.p2 = pick(1, std::min(85 - p.c_max, 60));
      p.p1 = pick(1, p.p2);
      Output slow(left);
      reference::semi_global(left.view(), right.view(), p, slow.views(left));
      MatcherParameters largest = p;
      largest.disparities = std::max(p.disparities, pick(1, 512));
      SemiGlobalMatcher matcher(left.width, left.height, channels, largest);
      matcher.limit_search(p.disparities);
      expect_equal(matcher, left, right, p, slow);
    }
  });
}

TEST_CASE("the general matcher agrees with the fast ones where both serve") {
  std::mt19937 random(test::seed(29));
  for (int round = 0; round < test::rounds(40); ++round) {
    const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
    const int channels = pick(0, 1) ? 3 : 1;
    const Picture left = random_picture(random, pick(1, 45), pick(1, 33), channels, round % 3 ? 256 : 3);
    const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
    MatcherParameters p = random_parameters(random, 60);
    if (p.n_min > 1) {  // what lies beside a filtered winner is another thing there: the next test
      p.uniqueness = 0;
      p.subpixel = false;
    }
    if (round % 2 == 1) {
      p = MatcherParameters::quality();
      p.disparities = pick(1, 60);
      p.left_right_check = round % 4 == 1;
      p.subpixel = round % 3 == 1;
    }
    const auto fast = make_matcher(left.width, left.height, channels, p);
    Output expected(left);
    REQUIRE(fast->match(left.view(), right.view(), expected.views(left)));
    GeneralMatcher general(left.width, left.height, channels, p);
    expect_equal(general, left, right, p, expected);
  }
}

TEST_CASE("the general matcher of four grey levels, where derivatives saturate: equal to the reference") {
  std::mt19937 random(test::seed(61));
  for (int round = 0; round < test::rounds(20); ++round) {
    const Picture left = random_picture(random, 40, 12, 1, 4), right = shifted(random, left, 5, 30);
    MatcherParameters p;
    p.disparities = 12;
    p.n_square = 3;
    p.n_min = 1;
    p.c_max = 64;
    p.left_right_check = true;
    Output expected(left);
    reference::match(left.view(), right.view(), p, expected.views(left));
    GeneralMatcher general(left.width, left.height, 1, p);
    expect_equal(general, left, right, p, expected);
  }
}

TEST_CASE(
    "the general matcher equals the reference: every cost and share of it, filtered or not, what lies beside the "
    "winner") {
  std::mt19937 random(test::seed(43));
  for (const CostKind cost :
       {CostKind::gradient, CostKind::ssd, CostKind::sad, CostKind::census, CostKind::rss, CostKind::mixed})
    for (const int n_min : {1, 5})
      for (const double weight : {0.0, 0.5, 1.0})
        for (const int channels : {1, 3}) {
          if (weight != 1 && cost != CostKind::mixed) continue;
          if (cost == CostKind::rss && channels == 3) continue;  // roots of sums are no whole numbers: the next test
          for (int round = 0; round < test::rounds(8); ++round) {
            const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
            const Picture left = random_picture(random, pick(1, 40), pick(1, 25), channels, round % 3 ? 256 : 4);
            const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
            MatcherParameters p = random_parameters(random, 40);
            p.cost = cost;
            p.c_max = round % 4 == 0 ? 0 : pick(1, 48);
            p.intensity_weight = weight;
            p.n_min = n_min;
            p.n_square = std::max(p.n_square, n_min);
            INFO("weight ", weight);
            Output expected(left);
            reference::match(left.view(), right.view(), p, expected.views(left), reference::Beside::filtered);
            GeneralMatcher general(left.width, left.height, channels, p);
            expect_equal(general, left, right, p, expected);
          }
        }
}

TEST_CASE(
    "cost rss of colours: winner, fraction and uniqueness of the reference's sums, but for the last bits of a float") {
  std::mt19937 random(test::seed(47));
  size_t kept = 0;
  for (const int n_min : {1, 5})
    for (int round = 0; round < test::rounds(12); ++round) {
      const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const Picture left = random_picture(random, pick(6, 40), pick(1, 25), 3, 256);
      const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 60));
      MatcherParameters p;
      p.cost = CostKind::rss;
      p.c_max = pick(20, 255);
      p.disparities = pick(2, 40);
      p.n_square = 7;
      p.n_min = n_min;
      p.subpixel = true;
      p.uniqueness = 40;
      Output found(left);
      REQUIRE(GeneralMatcher(left.width, left.height, 3, p).match(left.view(), right.view(), found.views(left)));
      const auto sums =
          reference::filtered(reference::window_sums(left.view(), right.view(), p, false), left.width, left.height, p);
      for (size_t i = 0; i < found.disparity.size(); ++i) {
        const double* at = &sums[i * static_cast<size_t>(p.disparities)];
        const reference::Choice best = reference::winner(at, p, 65535);
        kept += !best.ambiguous;
        CHECK(std::abs(found.confidence[i] - reference::confidence(best.sum, p.max_sum(), p)) <= 1);
        CHECK((found.disparity[i] < 0) == best.ambiguous);
        if (found.disparity[i] < 0) continue;
        CHECK(at[found.disparity[i]] <= best.sum + 1e-3);
        if (found.disparity[i] == best.disparity) CHECK(std::abs(found.fraction[i] - best.fraction) <= 1);
      }
    }
  CHECK(kept >= test::at_scale(1000));
}

TEST_CASE("bands of rows on threads give the result of one matcher") {
  std::mt19937 random(test::seed(31));
  for (int round = 0; round < test::rounds(25); ++round) {
    const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
    const int channels = pick(0, 1) ? 3 : 1, height = pick(32, 90);
    const Picture left = random_picture(random, pick(1, 60), height, channels, round % 3 ? 256 : 3);
    const Picture right = shifted(random, left, pick(0, left.width - 1), pick(0, 100));
    const MatcherParameters p = random_parameters(random, 60);
    Output expected(left);
    REQUIRE(make_matcher(left.width, height, channels, p)->match(left.view(), right.view(), expected.views(left)));
    // Impatient, the caller does a second time what others have begun; patient, it takes their results.
    const int patience = std::array<int, 3>{0, BandMatcher::kPatience, 1'000'000'000}[static_cast<size_t>(round % 3)];
    BandMatcher bands(left.width, height, channels, p, pick(1, std::min(4, height / 16)), patience);
    for (int call = 0; call < 3; ++call) expect_equal(bands, left, right, p, expected);

    MatcherParameters narrow = p;
    narrow.disparities = pick(1, p.disparities);
    bands.limit_search(narrow.disparities);
    REQUIRE(make_matcher(left.width, height, channels, narrow)->match(left.view(), right.view(), expected.views(left)));
    expect_equal(bands, left, right, narrow, expected);
  }
}
