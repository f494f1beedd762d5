// SPDX-License-Identifier: Apache-2.0
#include "graph/run/told_lines.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <new>
#include <sstream>

namespace takt::command {

struct ToldLines::Memory {
  std::atomic<uint32_t> used;
  char text[(1U << 16U) - sizeof(std::atomic<uint32_t>)];
};

ToldLines::ToldLines() {
  void* const memory = mmap(nullptr, sizeof(Memory), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  memory_ = ::new (memory) Memory{};
}

ToldLines::~ToldLines() { munmap(memory_, sizeof(Memory)); }

void ToldLines::tell(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  const size_t at = memory_->used.fetch_add(static_cast<uint32_t>(std::min(text.size(), sizeof(Memory))));
  if (at < sizeof(memory_->text))
    std::memcpy(memory_->text + at, text.data(), std::min(text.size(), sizeof(memory_->text) - at));
  mprotect(memory_, sizeof(Memory), PROT_READ);
}

std::vector<std::string> ToldLines::lines() const {
  std::istringstream text(std::string(memory_->text, std::min<size_t>(memory_->used.load(), sizeof(memory_->text))));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);)
    if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
  return lines;
}

}  // namespace takt::command
