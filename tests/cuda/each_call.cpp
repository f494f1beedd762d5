// SPDX-License-Identifier: Apache-2.0
// each_call PLUGIN, which is built with the shim of CUDA: every call of CUDA fails once, in setup and in jobs. Then the
// card is refused with what failed, or the CPU does the work; nothing is left behind. Exit 1: not so.
#include <dlfcn.h>

#include <array>
#include <cstdio>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/cuda/quicker.hpp"
#include "nodes/object_detection/cooccurrence_stage.hpp"
#include "nodes/stereo/cuda_matcher.hpp"
#include "tests/cuda/shim.hpp"

using namespace takt;

namespace {

constexpr int kJobs = 3;

struct Tally {
  int refused = 0, by_cpu = 0, by_card = 0;
  int calls = 0;      ///< of CUDA, up to the end of the last job
  std::string wrong;  ///< what should not be, the last one
};

/// Three matches. What the shim's card finds is 0 everywhere; the CPU finds more.
void match(const cuda::CardUse& use, const CudaShim& shim, Tally& tally) {
  constexpr int kWidth = 96, kHeight = 40;
  stereo::MatcherParameters p;
  p.disparities = 32;
  const std::vector<uint8_t> left = cuda::noise(kWidth * kHeight);
  std::vector<uint8_t> right(left.size());
  for (size_t i = 0; i < right.size(); ++i) right[i] = left[(i + 7) % left.size()];
  const ImageView<const uint8_t> one(left.data(), kWidth, kHeight), other(right.data(), kWidth, kHeight);
  std::vector<int16_t> expected(left.size()), found(left.size());
  std::vector<uint8_t> sure(left.size());
  const auto views = [&](std::vector<int16_t>& disparity) {
    return stereo::DisparityViews{{disparity.data(), kWidth, kHeight}, {sure.data(), kWidth, kHeight}};
  };
  if (!stereo::make_matcher(kWidth, kHeight, 1, p)->match(one, other, views(expected))) tally.wrong = "no match";
  stereo::CudaMatcher matcher(kWidth, kHeight, 1, p, use);
  for (int job = 0; job < kJobs; ++job) {
    std::fill(found.begin(), found.end(), int16_t{-5});
    if (!matcher.match(one, other, views(found))) tally.wrong = "a match failed";
    if (found == expected) ++tally.by_cpu;
    else if (found == std::vector<int16_t>(found.size(), 0)) ++tally.by_card;
    else tally.wrong = "neither side's result";
  }
  tally.calls = shim.calls;
}

/// Three images, three windows of each.
void count(const cuda::CardUse& use, const CudaShim& shim, Tally& tally) {
  using namespace object_detection;
  const SearchGrid grid = make_search_grid(90, 70, 40, 60);
  const PairBins bins;
  const std::vector<uint8_t> pixels = cuda::noise(size_t{3} * 90 * 70);
  const ImageView<const uint8_t> image(pixels.data(), 90, 70, 3);
  const std::vector<std::vector<Histogram>> objects{
      {cooccurrence_histogram({pixels.data() + 30, 60, 60, 3, ptrdiff_t{3} * 90}, bins)}};
  CooccurrenceStage plain(grid, bins, objects), stage(grid, bins, objects);
  stage.use(use);
  for (int job = 0; job < kJobs; ++job) {
    const std::vector<WindowOfObject> questions{{0, 0}, {1, 0}, {3, 0}};
    stage.count_ahead(image, questions);
    for (const WindowOfObject& question : questions) {
      const uint32_t found = stage.missing(image, question.window, question.object)[0],
                     expected = plain.missing(image, question.window, question.object)[0];
      if (expected == 0) tally.wrong = "both sides find 0";
      if (found == expected) ++tally.by_cpu;
      else if (found == 0) ++tally.by_card;
      else tally.wrong = "neither side's result";
    }
  }
  tally.calls = shim.calls;
}

bool each_call_fails(const char* name, CudaShim& shim, const cuda::CardUse& use,
                     const std::function<void(const cuda::CardUse&, const CudaShim&, Tally&)>& work) {
  Tally tally;
  bool good = true, reached = true;
  int call = 0;
  while (reached) {
    shim.fail_at = ++call;
    shim.calls = 0;
    const int by_cpu = tally.by_cpu;
    bool refused = false;
    try {
      work(use, shim, tally);
    } catch (const std::runtime_error& error) {
      refused = true;
      ++tally.refused;
      if (std::string(error.what()).find("the shim fails") == std::string::npos) tally.wrong = error.what();
    }
    reached = refused || tally.calls >= call;
    if (reached && !refused && tally.by_cpu == by_cpu) tally.wrong = "the card did what it could not";
    if (shim.live != 0) tally.wrong = std::to_string(shim.live) + " things are left";
    shim.live = 0;
    if (!tally.wrong.empty()) std::printf("%s, call %d: %s\n", name, call, tally.wrong.c_str());
    good = good && tally.wrong.empty();
    tally.wrong.clear();
  }
  std::printf("%s: %d calls, each failed once: %d times refused, else %d results of the CPU and %d of the card\n", name,
              call - 1, tally.refused, tally.by_cpu, tally.by_card);
  return good && tally.refused > 0 && tally.by_cpu > 0 && tally.by_card > 0;
}

}  // namespace

int main(int count_of_words, char** words) {
  void* module = count_of_words > 1 ? dlopen(words[1], RTLD_NOW | RTLD_LOCAL) : nullptr;
  if (module == nullptr) return std::printf("%s\n", count_of_words > 1 ? dlerror() : "each_call PLUGIN"), 2;
  const auto* table = static_cast<const cuda::Table*>(dlsym(module, "takt_cuda"));
  auto* shim = static_cast<CudaShim*>(dlsym(module, "takt_cuda_shim"));
  if (table == nullptr || shim == nullptr) return std::printf("%s is not built with the shim\n", words[1]), 2;
  const cuda::CardUse use{{table, 0, "a shim"}, 5'000'000};
  const bool stereo = each_call_fails("stereo", *shim, use, match),
             cooccurrences = each_call_fails("co-occurrences", *shim, use, count);
  return stereo && cooccurrences ? 0 : 1;
}
