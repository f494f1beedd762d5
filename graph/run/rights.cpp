// SPDX-License-Identifier: Apache-2.0
#include "graph/run/rights.hpp"

#include <linux/capability.h>
#include <pthread.h>
#include <unistd.h>

#include <chrono>
#include <thread>
#include <utility>

#include "rt/capability.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

constexpr int64_t kAtWork_ns = 500'000'000;
constexpr uint64_t kNice = uint64_t{1} << CAP_SYS_NICE, kLock = uint64_t{1} << CAP_IPC_LOCK;

nlohmann::ordered_json counted(const RunRights::Process& process) {
  size_t real_time = 0, lock_memory = 0, others = 0;
  const std::vector<ThreadRights> threads = thread_rights(process.pid);
  for (const ThreadRights& thread : threads) {
    real_time += (thread.capabilities & kNice) != 0;
    lock_memory += (thread.capabilities & kLock) != 0;
    others += (thread.capabilities & ~(kNice | kLock)) != 0;
  }
  return {{"process", process.name},
          {"threads", threads.size()},
          {"real_time", real_time},
          {"lock_memory", lock_memory},
          {"others", others}};
}

}  // namespace

RunRights::RunRights(RunBoard& board, std::vector<Process> processes)
    : thread_([this, &board, processes = std::move(processes)](const std::stop_token& end) {
        pthread_setname_np(pthread_self(), "takt-rights");
        const MonotonicClock clock;
        const auto at_work = [&] {
          const int64_t epoch_ns = board.epoch_ns().load();
          return epoch_ns != 0 && clock.now_ns() >= epoch_ns + kAtWork_ns;
        };
        while (!end.stop_requested() && !at_work()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
        if (end.stop_requested()) return;
        read_ = nlohmann::ordered_json::array();
        for (const Process& process : processes) {
          // With what this thread was given it sees all others (hidepid); itself it is not to count.
          if (process.pid == getpid()) keep_rights(Rights::none);
          read_.push_back(counted(process));
        }
      }) {}

nlohmann::ordered_json RunRights::told() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  return read_;
}

}  // namespace takt::command
