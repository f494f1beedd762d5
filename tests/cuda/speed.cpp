// SPDX-License-Identifier: Apache-2.0
// speed PLUGIN [MATCHES]: how long a match takes on the card, from images in shared memory to the result there, on
// noise. No CPU beside it.
#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "nodes/cuda/table.hpp"

using namespace takt::cuda;

namespace {

struct Row {
  const char* name;
  StereoShape shape;
};

const Row kRows[] = {
    {"640x480x150 gradient", {640, 480, 3, 150, 0, 10, 15, 5, 0, 0, 0, 0, 0}},
    {"640x480x150 gradient, left-right check", {640, 480, 3, 150, 0, 10, 15, 5, 0, 0, 0, 1, 0}},
    {"640x480x150 census", {640, 480, 3, 150, 3, 24, 9, 5, 0, 0, 0, 0, 0}},
    {"640x480x150 ssd", {640, 480, 3, 150, 1, 50, 15, 5, 0, 0, 0, 0, 0}},
    {"640x480x150 semi-global, median", {640, 480, 3, 150, 3, 24, 1, 1, 0, 0, 1, 0, 1}},
    {"1280x960x256 gradient", {1280, 960, 3, 256, 0, 10, 15, 5, 0, 0, 0, 0, 0}},
    {"1280x960x256 gradient, left-right check", {1280, 960, 3, 256, 0, 10, 15, 5, 0, 0, 0, 1, 0}},
    {"1280x960x256 census, left-right check", {1280, 960, 3, 256, 3, 24, 9, 5, 0, 0, 0, 1, 0}},
    {"1280x960x256 semi-global, median", {1280, 960, 3, 256, 3, 24, 1, 1, 0, 0, 1, 0, 1}},
};

bool measure(const Table& cuda, const Row& row, size_t matches) {
  const StereoShape& s = row.shape;
  const auto pixels = static_cast<size_t>(s.width) * static_cast<size_t>(s.height),
             bytes = (9 * pixels + 4095) / 4096 * 4096;
  auto* memory = static_cast<uint8_t*>(std::aligned_alloc(4096, bytes));
  std::mt19937 random(1);
  for (size_t i = 0; i < bytes; ++i) memory[i] = static_cast<uint8_t>(random());
  char why[kWhyBytes] = "";
  StereoOnCard* stereo = cuda.register_memory(memory, bytes) ? cuda.make_stereo(&s, 0, why) : nullptr;
  if (stereo == nullptr) return std::printf("%s: %s\n", row.name, why), false;
  const StereoCall call{memory,
                        memory + 3 * pixels,
                        3 * s.width,
                        3 * s.width,
                        reinterpret_cast<int16_t*>(memory + 6 * pixels),
                        memory + 8 * pixels,
                        nullptr,
                        s.width,
                        s.width,
                        s.width,
                        s.disparities,
                        0,
                        14,
                        60};
  std::vector<double> ms;
  while (ms.size() < matches) {
    const auto begun = std::chrono::steady_clock::now();
    if (cuda.match(stereo, &call, 1'000'000'000) != Outcome::done) break;
    ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count());
  }
  const bool all = ms.size() == matches;
  std::sort(ms.begin(), ms.end());
  if (all)
    std::printf("%-42s p50 %.3f  p99 %.3f  max %.3f ms\n", row.name, ms[matches / 2], ms[matches * 99 / 100],
                ms.back());
  else std::printf("%s: a match failed\n", row.name);
  cuda.free_stereo(stereo);
  cuda.forget_memory(memory);
  std::free(memory);
  return all;
}

}  // namespace

int main(int count, char** words) {
  void* module = count > 1 ? dlopen(words[1], RTLD_NOW | RTLD_LOCAL) : nullptr;
  if (module == nullptr) return std::printf("%s\n", count > 1 ? dlerror() : "speed PLUGIN [MATCHES]"), 2;
  const auto* cuda = static_cast<const Table*>(dlsym(module, "takt_cuda"));
  char text[kWhyBytes] = "";
  if (cuda->cards(text) <= 0) return std::printf("NOT RUN: no card: %s\n", text), 77;
  cuda->card_name(0, text);
  std::printf("%s, default policy\n", text);
  const auto matches = static_cast<size_t>(count > 2 ? std::atoi(words[2]) : 2000);
  return std::all_of(std::begin(kRows), std::end(kRows), [&](const Row& row) { return measure(*cuda, row, matches); })
             ? 0
             : 1;
}
