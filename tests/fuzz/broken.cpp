// SPDX-License-Identifier: Apache-2.0
// A target that some inputs break, to test tests/fuzz/replay.cpp.
#include <cstdint>
#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view input(reinterpret_cast<const char*>(data), size);
  if (input == "trap") __builtin_trap();
  if (input == "exit") std::exit(0);
  return 0;
}
