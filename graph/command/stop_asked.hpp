// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <csignal>

namespace takt::command {

/// While it lives, the first SIGINT, SIGTERM or SIGHUP is only noted; a second one ends the process. One at a time.
class StopAsked {
 public:
  StopAsked() {
    asked_ = 0;
    struct sigaction action {};
    action.sa_handler = [](int) { asked_ = 1; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    for (size_t i = 0; i < kCount; ++i) sigaction(kSignals[i], &action, &before_[i]);
    if (before_[2].sa_handler == SIG_IGN) sigaction(SIGHUP, &before_[2], nullptr);  // nohup
  }
  ~StopAsked() {
    for (size_t i = 0; i < kCount; ++i) sigaction(kSignals[i], &before_[i], nullptr);
  }
  StopAsked(const StopAsked&) = delete;
  StopAsked& operator=(const StopAsked&) = delete;
  static bool asked() { return asked_ != 0; }

 private:
  static constexpr size_t kCount = 3;
  static constexpr int kSignals[kCount]{SIGINT, SIGTERM, SIGHUP};
  inline static volatile std::sig_atomic_t asked_ = 0;
  struct sigaction before_[kCount] {};
};

}  // namespace takt::command
