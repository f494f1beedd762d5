// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <memory>
#include <thread>
#include <vector>

namespace takt {

/// Threads of which some may never come back, because a node does not return. One thread at a time.
class WorkerThreads {
 public:
  WorkerThreads();
  ~WorkerThreads();
  WorkerThreads(const WorkerThreads&) = delete;
  WorkerThreads& operator=(const WorkerThreads&) = delete;

  /// What `work` uses must outlive it, even if join() gives it up.
  void start(std::function<void()> work);
  /// Waits until all threads have ended, or those that have not are hopeless, which is asked some ten times a second.
  /// Those are given up and go on by themselves until the process ends. Returns how many.
  size_t join(const std::function<bool(const std::vector<size_t>& at_work)>& hopeless);

 private:
  struct Ends;
  std::shared_ptr<Ends> ends_;  ///< also held by each thread
  std::vector<std::thread> threads_;
};

}  // namespace takt
