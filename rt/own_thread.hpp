// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <pthread.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <stop_token>

#include "rt/memory/sanitized.hpp"

namespace takt {

/// A thread of the runtime's own, with a small stack. Where memory is locked, every stack is resident as a whole;
/// threads that run jobs, and those of devices and libraries, have 2 MB (prepare_process_memory()).
///
///     OwnThread thread([this](const std::stop_token& end) { while (!end.stop_requested()) look(); });
class OwnThread {
 public:
  /// For loops of the runtime that call no code of nodes, devices or drawing.
#if defined(TAKT_SANITIZED)
  static constexpr size_t kStack = 2 << 20;  // frames are many times as large
#else
  static constexpr size_t kStack = 256 << 10;
#endif

  OwnThread() = default;
  /// Throws std::system_error if there are too many threads. An exception that leaves `work` ends the process.
  explicit OwnThread(std::function<void()> work, size_t stack_bytes = kStack);
  explicit OwnThread(const std::function<void(const std::stop_token&)>& work, size_t stack_bytes = kStack);
  OwnThread(OwnThread&& other) noexcept;
  OwnThread& operator=(OwnThread&& other) noexcept;
  /// Asks it to end, and waits for that.
  ~OwnThread();
  void request_stop() { end_.request_stop(); }
  bool joinable() const { return thread_.has_value(); }
  /// Waits for its end. Once.
  void join();

 private:
  void stop();
  std::optional<pthread_t> thread_;
  std::stop_source end_{std::nostopstate};
};

}  // namespace takt
