// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/worker_threads.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace takt {

struct WorkerThreads::Ends {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<char> ended;
};

WorkerThreads::WorkerThreads() : ends_(std::make_shared<Ends>()) {}

WorkerThreads::~WorkerThreads() {
  for (std::thread& thread : threads_)
    if (thread.joinable()) thread.join();
}

void WorkerThreads::start(std::function<void()> work) {
  const size_t place = threads_.size();
  {
    const std::lock_guard lock(ends_->mutex);
    ends_->ended.push_back(0);
  }
  threads_.emplace_back([work = std::move(work), ends = ends_, place] {
    work();
    {
      const std::lock_guard lock(ends->mutex);
      ends->ended[place] = 1;
    }
    ends->changed.notify_all();
  });
}

size_t WorkerThreads::join(const std::function<bool(const std::vector<size_t>&)>& hopeless) {
  std::vector<size_t> at_work;
  const auto look = [&] {
    at_work.clear();
    for (size_t i = 0; i < ends_->ended.size(); ++i)
      if (!ends_->ended[i]) at_work.push_back(i);
    return at_work.empty() || hopeless(at_work);
  };
  {
    std::unique_lock lock(ends_->mutex);
    while (!look()) ends_->changed.wait_for(lock, std::chrono::milliseconds(250));
  }
  for (const size_t i : at_work) threads_[i].detach();
  for (std::thread& thread : threads_)
    if (thread.joinable()) thread.join();
  return at_work.size();
}

}  // namespace takt
