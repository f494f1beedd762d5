// SPDX-License-Identifier: Apache-2.0
#include "graph/run/periodic.hpp"

#include <condition_variable>
#include <mutex>
#include <utility>

#include "rt/capability.hpp"

namespace takt::command {

Periodic::Periodic(std::chrono::nanoseconds period, std::function<void()> look)
    : thread_([period, look = std::move(look)](const std::stop_token& stop) {
        keep_rights(Rights::none);
        std::mutex mutex;
        std::condition_variable_any ending;
        std::unique_lock lock(mutex);
        while (!stop.stop_requested()) {
          look();
          ending.wait_for(lock, stop, period, [] { return false; });
        }
      }) {}

}  // namespace takt::command
