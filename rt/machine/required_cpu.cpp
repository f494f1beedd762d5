// SPDX-License-Identifier: Apache-2.0
// In every program: a processor older than the build's floor (TAKT_CPU) ends it with a sentence in place of SIGILL.
// This file alone is compiled for any x86-64, and its check runs before all other initialisation.
#ifdef TAKT_REQUIRES_CPU
#if defined(__aarch64__)
#include <asm/hwcap.h>
#include <sys/auxv.h>
#endif
#include <unistd.h>

#include <cstring>

namespace {

void require(bool has, const char* feature) {
  if (has) return;
#if defined(__aarch64__)
  const char* const fix =
      ", which the build asks for\n  fix: none; kernels need the cryptographic extension of ARMv8\n";
#else
  const char* const fix =
      ", which the build asks for\n  fix: build for any x86-64, in a folder without a build: "
      "cmake -S . -B build/release -G Ninja -DCMAKE_BUILD_TYPE=Release -DTAKT_CPU=x86-64\n";
#endif
  const char* const texts[] = {"takt: this processor lacks ", feature, fix};
  for (const char* text : texts) static_cast<void>(!::write(STDERR_FILENO, text, std::strlen(text)));
  ::_exit(3);
}

}  // namespace

extern "C" __attribute__((constructor(101))) void takt_require_cpu();  // the name by which the linker takes it along

void takt_require_cpu() {
#if defined(__aarch64__)
  require((getauxval(AT_HWCAP) & HWCAP_AES) != 0 && (getauxval(AT_HWCAP) & HWCAP_PMULL) != 0, "AES and PMULL");
#else
  __builtin_cpu_init();
  require(__builtin_cpu_supports("ssse3"), "SSSE3");
  require(__builtin_cpu_supports("sse4.2"), "SSE4.2");
  require(__builtin_cpu_supports("popcnt"), "POPCNT");
  require(__builtin_cpu_supports("aes"), "AES");
  require(__builtin_cpu_supports("pclmul"), "PCLMULQDQ");
#endif
}
#endif
