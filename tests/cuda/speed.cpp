// SPDX-License-Identifier: Apache-2.0
// speed PLUGIN [RUNS]: how long a match, and co-occurrences of windows, take on the card, from images in memory that
// the card sees to the result; and on one thread of the CPU, some runs before and some after it.
#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "nodes/object_detection/cooccurrence_stage.hpp"
#include "nodes/stereo/cuda_matcher.hpp"

using namespace takt;

namespace {

/// Pages that the card sees, filled with noise.
class Shared {
 public:
  Shared(const cuda::Table& table, size_t bytes)
      : table_(table),
        bytes_((bytes + 4095) / 4096 * 4096),
        memory_(static_cast<uint8_t*>(std::aligned_alloc(4096, bytes_))) {
    std::mt19937 random(1);
    for (size_t i = 0; i < bytes_; ++i) memory_[i] = static_cast<uint8_t>(random());
    registered_ = table.register_memory(memory_, bytes_);
  }
  ~Shared() {
    if (registered_) table_.forget_memory(memory_);
    std::free(memory_);
  }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
  bool registered() const { return registered_; }
  uint8_t* at(size_t byte = 0) const { return memory_ + byte; }

 private:
  const cuda::Table& table_;
  const size_t bytes_;
  uint8_t* const memory_;
  bool registered_ = false;
};

struct Times {
  std::vector<double> ms;
  /// False if one fails.
  template <class Run>
  bool add(size_t runs, Run run) {
    for (; runs > 0; --runs) {
      const auto begun = std::chrono::steady_clock::now();
      if (!run()) return false;
      ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count());
    }
    return true;
  }
  std::string text() {
    std::sort(ms.begin(), ms.end());
    char line[100];
    std::snprintf(line, sizeof line, "p50 %.3f, p99 %.3f, max %.3f", ms[ms.size() / 2], ms[ms.size() * 99 / 100],
                  ms.back());
    return line;
  }
};

/// Prints both sides; false if a run fails.
template <class OnCard, class OnCpu>
bool measure(const std::string& name, const char* target, size_t runs, OnCard on_card, OnCpu on_cpu) {
  constexpr size_t kOfCpu = 10;
  Times card, cpu;
  const bool good = cpu.add(kOfCpu, on_cpu) && card.add(runs, on_card) && cpu.add(kOfCpu, on_cpu);
  if (good)
    std::printf("%-46s %s ms; CPU, one thread, %s: %s ms\n", name.c_str(), card.text().c_str(), target,
                cpu.text().c_str());
  else std::printf("%s: a run failed\n", name.c_str());
  return good;
}

bool measure_match(const cuda::Card& card, const std::string& name, int width, int height,
                   const stereo::MatcherParameters& p, size_t runs) {
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const Shared memory(*card.cuda, 9 * pixels);
  const ImageView<const uint8_t> left(memory.at(), width, height, 3), right(memory.at(3 * pixels), width, height, 3);
  const stereo::DisparityViews out{{reinterpret_cast<int16_t*>(memory.at(6 * pixels)), width, height},
                                   {memory.at(8 * pixels), width, height}};
  stereo::CudaMatcher matcher(width, height, 3, p, {card, 1'000'000'000});
  const auto twin = stereo::make_matcher(width, height, 3, p);
  const std::string size = std::to_string(width) + "x" + std::to_string(height) + "x" + std::to_string(p.disparities);
  return measure(
             size + " " + name, twin->target(), runs,
             [&] { return matcher.match(left, right, out) && matcher.trouble().empty(); },
             [&] { return twin->match(left, right, out); }) &&
         memory.registered();
}

bool measure_matches(const cuda::Card& card, size_t runs) {
  using stereo::CostKind;
  stereo::MatcherParameters gradient, census, ssd;
  census.cost = CostKind::census;
  census.n_square = 9;
  ssd.cost = CostKind::ssd;
  const auto with_check = [](stereo::MatcherParameters p) {
    p.left_right_check = true;
    return p;
  };
  const auto far = [](stereo::MatcherParameters p) {
    p.disparities = 256;
    return p;
  };
  bool good = measure_match(card, "gradient", 640, 480, gradient, runs);
  good = measure_match(card, "gradient, check", 640, 480, with_check(gradient), runs) && good;
  good = measure_match(card, "census", 640, 480, census, runs) && good;
  good = measure_match(card, "ssd", 640, 480, ssd, runs) && good;
  good = measure_match(card, "semi-global, median", 640, 480, stereo::MatcherParameters::quality(), runs) && good;
  good = measure_match(card, "gradient", 1280, 960, far(gradient), runs) && good;
  good = measure_match(card, "gradient, check", 1280, 960, with_check(far(gradient)), runs) && good;
  good = measure_match(card, "census, check", 1280, 960, with_check(far(census)), runs) && good;
  return measure_match(card, "semi-global, median", 1280, 960, far(stereo::MatcherParameters::quality()), runs) && good;
}

/// Windows of an image of patches against three objects of a dozen views each, cut out of the image.
bool measure_windows(const cuda::Card& card, int patch, size_t count, size_t runs) {
  using namespace object_detection;
  constexpr int kWidth = 640, kHeight = 480, kObjects = 3, kViews = 12, kView = 48;
  const SearchGrid grid = make_search_grid(kWidth, kHeight, kView, 64);
  const PairBins bins;
  const Shared memory(*card.cuda, size_t{3} * kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      std::copy_n(memory.at(static_cast<size_t>(3 * (y / patch * 997 + x / patch))), 3,
                  memory.at(static_cast<size_t>(3 * (y * kWidth + x))));
  const ImageView<const uint8_t> image(memory.at(), kWidth, kHeight, 3);
  std::vector<std::vector<Histogram>> objects(kObjects);
  for (int i = 0; i < kObjects * kViews; ++i)
    objects[static_cast<size_t>(i / kViews)].push_back(
        cooccurrence_histogram({&image.at(i * 16, i * 12), kView, kView, 3, image.stride}, bins));
  std::vector<WindowOfObject> questions;
  for (size_t i = 0; i < count; ++i)
    for (size_t object = 0; object < kObjects; ++object)
      questions.push_back({i * static_cast<size_t>(grid.windows()) / count, object});
  const CooccurrenceStage stage(grid, bins, objects);
  CudaCooccurrences on_card(grid, bins, stage.references(), {card, 1'000'000'000});
  CooccurrenceStage twin(grid, bins, objects);
  return measure(
      std::to_string(count) + " windows, co-occurrences, " + (patch == 1 ? "noise" : "patches"), "SIMD", runs,
      [&] { return on_card.find(image, questions); },
      [&] {
        for (const WindowOfObject& question : questions) (void)twin.missing(image, question.window, question.object);
        return true;
      });
}

}  // namespace

int main(int count, char** words) {
  void* module = count > 1 ? dlopen(words[1], RTLD_NOW | RTLD_LOCAL) : nullptr;
  if (module == nullptr) return std::printf("%s\n", count > 1 ? dlerror() : "speed PLUGIN [RUNS]"), 2;
  const auto* table = static_cast<const cuda::Table*>(dlsym(module, "takt_cuda"));
  char text[cuda::kWhyBytes] = "";
  if (table->cards(text) <= 0) return std::printf("NOT RUN: no card: %s\n", text), 77;
  table->card_name(0, text);
  std::printf("%s, default policy\n", text);
  const auto runs = static_cast<size_t>(count > 2 ? std::atoi(words[2]) : 2000);
  const cuda::Card card{table, 0, text};
  bool good = measure_matches(card, runs);
  for (const int patch : {1, 23})
    for (const size_t windows : {size_t{999}, size_t{10}}) good = measure_windows(card, patch, windows, runs) && good;
  return good ? 0 : 1;
}
