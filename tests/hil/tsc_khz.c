// SPDX-License-Identifier: Apache-2.0
// The rate of this machine's time stamp counter in kHz, which the guest's is, too: on a busy machine a guest that
// measured it by itself had a clock that was fifteen times too fast.
#include <stdio.h>
#include <time.h>
#include <x86intrin.h>

static double now_s(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC_RAW, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(void) {
  const struct timespec pause = {0, 300000000};
  const double begin_s = now_s();
  const unsigned long long begin = __rdtsc();
  nanosleep(&pause, NULL);
  printf("%.0f\n", (double)(__rdtsc() - begin) / (now_s() - begin_s) / 1000);
  return 0;
}
