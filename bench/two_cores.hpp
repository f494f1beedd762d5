// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sched.h>

#include <string>

namespace takt::bench {

/// While it lives the calling thread, and what it starts, keep to two CPUs of two physical cores: of one core's two
/// hardware threads the second is worth a quarter of the first. Where the system tells of no two such CPUs, or refuses,
/// everything stays as it was.
class TwoCores {
 public:
  TwoCores();
  ~TwoCores();
  TwoCores(const TwoCores&) = delete;
  TwoCores& operator=(const TwoCores&) = delete;
  /// "CPUs 0 and 2", or "any CPUs".
  const std::string& text() const { return text_; }

 private:
  cpu_set_t before_{};
  bool moved_ = false;
  std::string text_ = "any CPUs";
};

}  // namespace takt::bench
