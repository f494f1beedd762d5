// SPDX-License-Identifier: Apache-2.0
// check PLUGIN [CASES]: what the card finds against the definitions, in so many random cases of each kind. Exit 1: a
// value differs; 77: there is no card. Fewer than 100 are for compute-sanitizer, under which no time says anything: no
// bounds then.
#include "tests/cuda/check.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

using namespace takt;

int main(int count, char** words) {
  void* module = count > 1 ? dlopen(words[1], RTLD_NOW | RTLD_LOCAL) : nullptr;
  if (module == nullptr) return std::printf("%s\n", count > 1 ? dlerror() : "check PLUGIN [CASES]"), 2;
  const cuda::Table* card = static_cast<const cuda::Table*>(dlsym(module, "takt_cuda"));
  char text[cuda::kWhyBytes] = "";
  if (card->cards(text) <= 0) return std::printf("NOT RUN: no card: %s\n", text), 77;
  const unsigned cases = count > 2 ? static_cast<unsigned>(std::atoi(words[2])) : 100;
  std::vector<std::thread> threads;
  std::atomic<size_t> wrong{0};
  std::atomic<unsigned> next{0};
  for (unsigned t = 0; t < std::max(1U, std::thread::hardware_concurrency()); ++t)
    threads.emplace_back([&] {
      for (unsigned seed; (seed = next++) < cases;)
        wrong += (test::check_stereo(*card, seed) > 0) + (test::check_cooccurrences(*card, seed) > 0);
    });
  for (std::thread& thread : threads) thread.join();
  const bool bounds = cases >= 100;
  if (bounds) wrong += test::check_bounds(*card) > 0;
  card->card_name(0, text);
  std::printf("%s: %u cases of each%s, %zu wrong\n", text, cases, bounds ? " and the bounds" : "", wrong.load());
  return wrong.load() > 0;
}
