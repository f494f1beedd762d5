// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>

#include "rt/memory/sanitized.hpp"

namespace takt {

/// A thread of the runtime's own, with a small stack. Where memory is locked, the stacks of other threads are resident
/// as a whole (prepare_process_memory()): those that run jobs, and those of devices and libraries, have 2 MB. Of this
/// one only what it uses is, unless it says that it must not wait for a page.
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

  enum class Stack : uint8_t { as_used, resident };

  OwnThread() = default;
  /// Throws std::system_error if there are too many threads. An exception that leaves `work` ends the process.
  explicit OwnThread(std::function<void()> work, size_t stack_bytes = kStack, Stack stack = Stack::as_used);
  explicit OwnThread(const std::function<void(const std::stop_token&)>& work);
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
  std::span<std::byte> stack_;  ///< its own; empty: the library's
};

}  // namespace takt
