// SPDX-License-Identifier: Apache-2.0
#include "rt/faults/load.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <chrono>

#include "rt/time/clock.hpp"

namespace takt::faults {
namespace {

constexpr auto kLongestWait = std::chrono::milliseconds(20);  // also how soon an epoch is noticed
constexpr uint64_t kPage = 4096;

bool raise_to_fixed() {
  sched_param parameter{};
  parameter.sched_priority = sched_get_priority_min(SCHED_FIFO);
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter) == 0;
}

}  // namespace

Loads::Loads(std::vector<LoadFault> faults, const std::atomic<int64_t>& epoch_ns, std::vector<LoadCount*> struck)
    : faults_(std::move(faults)), epoch_ns_(epoch_ns) {
  for (size_t f = 0; f < faults_.size(); ++f)
    for (uint32_t i = 0; i < (faults_[f].kind == LoadFault::Kind::cpu ? faults_[f].threads : 1); ++i)
      threads_.emplace_back([this, f, count = struck[f]] { run(faults_[f], *count); });
}

Loads::~Loads() {
  {
    const std::lock_guard lock(mutex_);
    ended_.store(true);
  }
  ending_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

int64_t Loads::now_since_epoch_ns() const {
  const int64_t epoch = epoch_ns_.load();
  return epoch == 0 ? INT64_MIN : MonotonicClock().now_ns() - epoch;
}

bool Loads::wait_until(int64_t since_epoch_ns) {
  std::unique_lock lock(mutex_);
  while (!ended_.load()) {
    const int64_t now = now_since_epoch_ns();
    if (now >= since_epoch_ns) return true;
    const std::chrono::nanoseconds left(now == INT64_MIN ? INT64_MAX : since_epoch_ns - now);
    ending_.wait_for(lock, std::min<std::chrono::nanoseconds>(left, kLongestWait));
  }
  return false;
}

void Loads::run(const LoadFault& fault, LoadCount& struck) {
  pthread_setname_np(pthread_self(), "fault-load");
  if (!wait_until(fault.from_ns)) return;
  if (fault.kind == LoadFault::Kind::cpu) spin(fault, struck);
  else hold(fault, struck);
}

void Loads::spin(const LoadFault& fault, LoadCount& struck) const {
  if (fault.fixed_priority && !raise_to_fixed()) return;
  struck.fetch_add(1);
  while (!ended_.load(std::memory_order_relaxed) && now_since_epoch_ns() < fault.to_ns) {
  }
}

void Loads::hold(const LoadFault& fault, LoadCount& struck) {
  void* memory = mmap(nullptr, fault.bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return;
  auto* bytes = static_cast<volatile unsigned char*>(memory);
  for (uint64_t at = 0; at < fault.bytes && !ended_.load(std::memory_order_relaxed); at += kPage) bytes[at] = 1;
  struck.fetch_add(1);
  wait_until(fault.to_ns);
  munmap(memory, fault.bytes);
}

}  // namespace takt::faults
