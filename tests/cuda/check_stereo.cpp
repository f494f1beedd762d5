// SPDX-License-Identifier: Apache-2.0
// The matcher on the card against the definition (nodes/stereo/reference.hpp), on pairs that are made here from noise.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "nodes/stereo/cuda_matcher.hpp"
#include "nodes/stereo/reference.hpp"
#include "tests/cuda/check.hpp"

using namespace takt;
using stereo::CostKind;
using stereo::MatcherParameters;

namespace {

struct Size {
  int width, height, channels;
};

/// Noise of blocks of a few pixels, the right one moved by what changes along the rows.
std::vector<uint8_t> noise(const Size& size, unsigned seed, bool right) {
  std::mt19937 random(seed);
  const int wide = size.width + 600;
  std::vector<uint8_t> coarse(static_cast<size_t>(wide) * static_cast<size_t>(size.height) *
                              static_cast<size_t>(size.channels));
  for (uint8_t& level : coarse) level = static_cast<uint8_t>(random() % 7 * 36);
  std::vector<uint8_t> out(static_cast<size_t>(size.width) * static_cast<size_t>(size.height) *
                           static_cast<size_t>(size.channels));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      for (int c = 0; c < size.channels; ++c) {
        const int from = x + (right ? 5 + (y / 16) % 40 : 0);
        out[static_cast<size_t>((y * size.width + x) * size.channels + c)] = static_cast<uint8_t>(
            coarse[static_cast<size_t>((y / 3 * wide + from / 2) * size.channels + c)] + random() % 3);
      }
  return out;
}

struct Result {
  std::vector<int16_t> disparity;
  std::vector<uint8_t> confidence, fraction;
  explicit Result(const Size& size) {
    const auto pixels = static_cast<size_t>(size.width) * static_cast<size_t>(size.height);
    disparity.assign(pixels, -7), confidence.assign(pixels, 77), fraction.assign(pixels, 77);
  }
};

struct Case {
  Size size;
  MatcherParameters p;
};

std::string text_of(const Case& c) {
  static const char* costs[] = {"gradient", "ssd", "sad", "census"};
  return std::to_string(c.size.width) + "x" + std::to_string(c.size.height) + "x" + std::to_string(c.p.disparities) +
         " " + std::to_string(c.size.channels) + " " + costs[static_cast<int>(c.p.cost)] + " c_max " +
         std::to_string(c.p.truncation()) + " n " + std::to_string(c.p.n_square) + "/" + std::to_string(c.p.n_min) +
         (c.p.selection == stereo::Selection::semi_global
              ? " paths " + std::to_string(c.p.step_once()) + " " + std::to_string(c.p.step_twice())
              : "") +
         (c.p.subpixel ? " subpixel" : "") + (c.p.median ? " median" : "") + (c.p.left_right_check ? " check" : "") +
         (c.p.uniqueness ? " unique" : "");
}

Case draw(unsigned seed) {
  std::mt19937 random(seed);
  const auto among = [&](auto... values) {
    const int all[] = {values...};
    return all[random() % (sizeof all / sizeof *all)];
  };
  Case c;
  c.size = {among(31, 64, 97, 150), among(17, 40, 66), among(1, 3)};
  c.p.cost = static_cast<CostKind>(random() % 4);
  c.p.disparities = among(1, 2, 5, 32, 77, 129, 150, 257, 300);
  c.p.c_max = random() % 3 != 0 ? 0 : 1 + static_cast<int>(random() % 40);
  c.p.n_square = among(1, 3, 7, 9, 15, 31);
  c.p.n_min = std::min(c.p.n_square, among(1, 3, 5, 9));
  while (c.p.max_sum() > 65534) c.p.n_square -= 2, c.p.n_min = std::min(c.p.n_min, c.p.n_square);
  c.p.subpixel = random() % 2, c.p.median = random() % 2, c.p.left_right_check = random() % 2;
  c.p.uniqueness = random() % 2 ? among(10, 40, 200) : 0;
  if (random() % 3 == 0) {
    c.p.cost = CostKind::census;
    c.p.selection = stereo::Selection::semi_global;
    c.p.n_square = c.p.n_min = 1;
    c.p.p1 = among(0, 1, 7, 20);
    c.p.p2 = c.p.p1 > 0 ? c.p.p1 + static_cast<int>(random() % 20) : 0;
    c.p.c_max = among(0, 10, 25);
  }
  c.p.min_confidence = random() % 2 ? among(50, 200) : 0;
  return c;
}

}  // namespace

namespace takt::test {

size_t check_stereo(const cuda::Table& card, unsigned seed) {
  const Case c = draw(seed);
  const Size& size = c.size;
  const std::vector<uint8_t> left = noise(size, seed, false), right = noise(size, seed, true);
  const cuda::StereoShape shape = stereo::card_shape(size.width, size.height, size.channels, c.p);
  char why[cuda::kWhyBytes] = "";
  cuda::StereoOnCard* matcher = card.make_stereo(&shape, 0, why);
  if (matcher == nullptr) return std::printf("%s: %s\n", text_of(c).c_str(), why), 1;
  size_t wrong = 0;
  for (const int search : {c.p.disparities, std::max(1, c.p.disparities / 2)}) {
    Result ours(size), theirs(size);
    const cuda::StereoCall call{left.data(),
                                right.data(),
                                size.width * size.channels,
                                size.width * size.channels,
                                ours.disparity.data(),
                                ours.confidence.data(),
                                ours.fraction.data(),
                                size.width,
                                size.width,
                                size.width,
                                search,
                                c.p.min_confidence,
                                c.p.step_once(),
                                c.p.step_twice()};
    if (card.match(matcher, &call, 2'000'000'000) != cuda::Outcome::done)
      wrong += std::printf("%s: not done\n", text_of(c).c_str()) > 0;
    MatcherParameters p = c.p;
    p.disparities = search;
    const auto view = [&](auto& values) { return ImageView(values.data(), size.width, size.height); };
    const bool paths = p.selection == stereo::Selection::semi_global;
    const auto by_definition = [&](auto... views) {
      paths ? stereo::reference::semi_global(views...) : stereo::reference::match(views...);
    };
    by_definition(stereo::reference::Bytes{left.data(), size.width, size.height, size.channels},
                  stereo::reference::Bytes{right.data(), size.width, size.height, size.channels}, p,
                  stereo::DisparityViews{view(theirs.disparity), view(theirs.confidence), view(theirs.fraction)});
    size_t here = 0;
    for (size_t i = 0; i < ours.disparity.size(); ++i) {
      const bool same = ours.disparity[i] == theirs.disparity[i] && ours.confidence[i] == theirs.confidence[i] &&
                        ours.fraction[i] == theirs.fraction[i];
      if (!same && here++ == 0)
        std::printf("%s, search %d: (%zu, %zu) is %d %d %d, not %d %d %d\n", text_of(c).c_str(), search,
                    i % static_cast<size_t>(size.width), i / static_cast<size_t>(size.width), ours.disparity[i],
                    ours.confidence[i], ours.fraction[i], theirs.disparity[i], theirs.confidence[i],
                    theirs.fraction[i]);
    }
    if (here > 0) std::printf("  %zu values differ\n", here);
    wrong += here;
  }
  card.free_stereo(matcher);
  return wrong;
}

size_t check_bounds(const cuda::Table& card) {
  const Size size{640, 480, 1};
  const auto pixels = static_cast<size_t>(size.width) * static_cast<size_t>(size.height),
             bytes = (3 * pixels + 4095) / 4096 * 4096;
  auto* memory = static_cast<uint8_t*>(std::aligned_alloc(4096, bytes));
  const bool registered = card.register_memory(memory, bytes);
  const std::vector<uint8_t> left = noise(size, 1, false), right = noise(size, 1, true);
  const cuda::StereoShape shape = stereo::card_shape(size.width, size.height, 1, {});
  char why[cuda::kWhyBytes] = "";
  cuda::StereoOnCard* matcher = card.make_stereo(&shape, 0, why);
  const cuda::StereoCall call{left.data(),
                              right.data(),
                              size.width,
                              size.width,
                              reinterpret_cast<int16_t*>(memory),
                              memory + 2 * pixels,
                              nullptr,
                              size.width,
                              size.width,
                              size.width,
                              150,
                              0,
                              0,
                              0};
  const auto begun = std::chrono::steady_clock::now();
  size_t wrong = !registered || matcher == nullptr || card.match(matcher, &call, 2'000'000'000) != cuda::Outcome::done,
         late = 0, done = 0;
  const int64_t whole_ns = (std::chrono::steady_clock::now() - begun).count();
  const std::vector<uint8_t> whole(memory, memory + 3 * pixels), untouched(3 * pixels, 0x55);
  for (int i = 0; matcher != nullptr && i < 600; ++i) {
    std::memset(memory, 0x55, 3 * pixels);
    const cuda::Outcome outcome = card.match(matcher, &call, i * whole_ns / 250);
    late += outcome == cuda::Outcome::late;
    done += outcome == cuda::Outcome::done;
    std::this_thread::sleep_for(std::chrono::nanoseconds(8 * whole_ns));  // what is under way ends
    const std::vector<uint8_t>& expected = outcome == cuda::Outcome::done ? whole : untouched;
    size_t here = 0, first = 0, last = 0;
    for (size_t at = 0; at < 3 * pixels; ++at)
      if (memory[at] != expected[at]) first = here++ == 0 ? at : first, last = at;
    if (here > 0)
      std::printf("bound %d, outcome %d: %zu bytes differ, from %zu to %zu; the first is %d\n", i,
                  static_cast<int>(outcome), here, first, last, memory[first]);
    wrong += here > 0;
  }
  std::printf("bounds of up to 2.4 times a match: %zu late, %zu done, %zu wrong\n", late, done, wrong);
  if (matcher != nullptr) card.free_stereo(matcher);
  card.forget_memory(memory);
  std::free(memory);
  return wrong + (late == 0) + (done == 0);
}

}  // namespace takt::test
