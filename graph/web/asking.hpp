// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>

#include "graph/web/hub.hpp"
#include "rt/own_thread.hpp"

namespace takt::web {

/// Questions to the run, which may take seconds, on a thread beside the server's:
///
///   asking.ask(session, question, [](Json answer) { ... });       // the server's thread; does not wait
///   asking.deliver([](uint64_t session) { return lives(session); });   // later, after `wake`: calls what is due
class Asking {
 public:
  using Then = std::function<void(Json answer)>;
  Asking(std::function<Json(const Json&)> answer, std::function<void()> wake);
  ~Asking() { end(); }
  Asking(const Asking&) = delete;
  Asking& operator=(const Asking&) = delete;

  /// Answers that too many wait already if so.
  void ask(uint64_t session, Json question, Then then);
  void deliver(const std::function<bool(uint64_t session)>& lives);
  /// No more answers come. Waits for the one under way.
  void end();

 private:
  struct Asked {
    uint64_t session;
    Json question, answer;
    Then then;
  };
  static constexpr size_t kMostWaiting = 32;
  void work();

  const std::function<Json(const Json&)> answer_;
  const std::function<void()> wake_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Asked> asked_, answered_;
  bool ending_ = false;
  OwnThread thread_;
};

}  // namespace takt::web
