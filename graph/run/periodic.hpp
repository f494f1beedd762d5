// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <functional>

#include "rt/own_thread.hpp"

namespace takt::command {

/// Calls `look` again and again from a thread of its own while it lives.
class Periodic {
 public:
  Periodic(std::chrono::nanoseconds period, std::function<void()> look);

 private:
  OwnThread thread_;
};

}  // namespace takt::command
