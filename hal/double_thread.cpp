// SPDX-License-Identifier: Apache-2.0
#include "hal/double_thread.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace takt {
namespace {

constexpr int64_t kLongestSleep_ns = 50'000'000;

}  // namespace

DoubleThread::DoubleThread(std::string id, std::unique_ptr<DeviceDouble> device, FailureSchedule failures,
                           const Clock& clock, std::function<void(int64_t epoch_ns)> on_start)
    : id_(std::move(id)),
      device_(std::move(device)),
      failures_(std::move(failures)),
      clock_(clock),
      on_start_(std::move(on_start)) {}

DoubleThread::~DoubleThread() {
  quit_.store(true);
  if (thread_.joinable()) thread_.join();
}

void DoubleThread::start(int64_t epoch_ns) {
  if (thread_.joinable()) return;
  failures_.begin(epoch_ns);
  on_start_(epoch_ns);
  thread_ = std::thread([this, epoch_ns] { work(epoch_ns); });
}

void DoubleThread::keep_up() { priority_.follow(); }

int64_t DoubleThread::late_ns() {
  // What is due and not done counts as well: a driver that reads before it gets older data.
  return std::max({int64_t{0}, clock_.now_ns() - due_ns_.load(), late_ns_.exchange(0)});
}

void DoubleThread::work(int64_t epoch_ns) {
  pthread_setname_np(pthread_self(), ("double:" + id_).substr(0, 15).c_str());
  Misbehaviour told = Misbehaviour::none;
  for (int64_t next_ns = epoch_ns; !quit_.load();) {
    due_ns_.store(next_ns);
    const int64_t now_ns = clock_.now_ns();
    if (now_ns < next_ns) {
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(next_ns - now_ns, kLongestSleep_ns)));
      continue;
    }
    priority_.keep(clock_);
    const Misbehaviour wanted = failures_.at(now_ns).value_or(Misbehaviour::none);
    if (wanted != told) device_->misbehave(told = wanted);
    device_->run_to(now_ns);
    const int64_t late_ns = clock_.now_ns() - next_ns;
    for (int64_t told_ns = late_ns_.load(); told_ns < late_ns && !late_ns_.compare_exchange_weak(told_ns, late_ns);) {
    }
    // In steps from the epoch on; those that were slept through are not made up for.
    const int64_t step_ns = device_->step_ns();
    next_ns = epoch_ns + (clock_.now_ns() - epoch_ns) / step_ns * step_ns + step_ns;
  }
}

}  // namespace takt
