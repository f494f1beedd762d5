// SPDX-License-Identifier: Apache-2.0
#include <linux/perf_event.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <vector>

#include "rt/trace/switch_source.hpp"

namespace takt::trace {
namespace {

constexpr size_t kPages = 8;  // of records per thread, a power of two; an unprivileged user has 516 KiB in all

/// The switches of one thread, as the kernel records them.
class ThreadSwitches {
 public:
  explicit ThreadSwitches(int32_t thread) : thread_(thread) {
    perf_event_attr attributes{};
    attributes.size = sizeof attributes;
    attributes.type = PERF_TYPE_SOFTWARE;
    attributes.config = PERF_COUNT_SW_DUMMY;
    attributes.sample_type = PERF_SAMPLE_TID | PERF_SAMPLE_TIME | PERF_SAMPLE_CPU;
    attributes.sample_id_all = 1;
    attributes.context_switch = 1;
    attributes.task = 1;  // a thread that ends is switched from after its event is gone: its end is told instead
    attributes.exclude_kernel = 1;  // what perf_event_paranoid 2 asks for
    attributes.use_clockid = 1;
    attributes.clockid = CLOCK_MONOTONIC;
    fd_ = static_cast<int>(syscall(SYS_perf_event_open, &attributes, thread, -1, -1, PERF_FLAG_FD_CLOEXEC));
    if (fd_ < 0) return;
    const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
    bytes_ = page * kPages;
    void* memory = mmap(nullptr, page + bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
    if (memory == MAP_FAILED) return;
    control_ = static_cast<perf_event_mmap_page*>(memory);
    records_ = static_cast<std::byte*>(memory) + page;
  }
  ~ThreadSwitches() {
    if (control_ != nullptr)
      munmap(control_, static_cast<size_t>(records_ - reinterpret_cast<std::byte*>(control_)) + bytes_);
    if (fd_ >= 0) close(fd_);
  }
  ThreadSwitches(const ThreadSwitches&) = delete;
  ThreadSwitches& operator=(const ThreadSwitches&) = delete;

  bool opened() const { return control_ != nullptr; }
  int32_t thread() const { return thread_; }

  void drain(Switches& into, uint64_t& lost) {
    const uint64_t head = __atomic_load_n(&control_->data_head, __ATOMIC_ACQUIRE);
    uint64_t tail = control_->data_tail;
    while (tail < head) {
      perf_event_header header{};
      copy(tail, &header, sizeof header);
      if (header.size < sizeof header) break;
      if (header.type == PERF_RECORD_SWITCH || header.type == PERF_RECORD_EXIT) take(tail, header, into);
      if (header.type == PERF_RECORD_LOST) {
        uint64_t id_and_count[2] = {};
        copy(tail + sizeof header, id_and_count, sizeof id_and_count);
        lost += id_and_count[1];
      }
      tail += header.size;
    }
    __atomic_store_n(&control_->data_tail, tail, __ATOMIC_RELEASE);
  }

  void finish(int64_t now_ns, Switches& into) {
    if (running_since_ == 0) return;
    add(now_ns, Slice::End::open, last_cpu_, into);
  }

 private:
  /// The end of a record, which says who and when (sample_id_all), in the order of the sample_type bits.
  struct Identity {
    uint32_t process, thread;
    uint64_t time;
    uint32_t cpu, reserved;
  };

  void copy(uint64_t at, void* into, size_t size) const {
    auto* out = static_cast<std::byte*>(into);
    for (size_t i = 0; i < size; ++i) out[i] = records_[(at + i) % bytes_];
  }

  void take(uint64_t at, const perf_event_header& header, Switches& into) {
    Identity identity{};
    if (header.size < sizeof header + sizeof identity) return;
    copy(at + header.size - sizeof identity, &identity, sizeof identity);
    const auto now = static_cast<int64_t>(identity.time);
    last_cpu_ = static_cast<int32_t>(identity.cpu);
    const bool ends = header.type == PERF_RECORD_EXIT || (header.misc & PERF_RECORD_MISC_SWITCH_OUT) != 0;
    if (!ends) {
      running_since_ = now;
    } else if (running_since_ != 0) {
      const bool preempted = (header.misc & PERF_RECORD_MISC_SWITCH_OUT_PREEMPT) != 0;
      add(now, preempted ? Slice::End::preempted : Slice::End::asleep, last_cpu_, into);
      running_since_ = 0;
    }
  }

  void add(int64_t to_ns, Slice::End end, int32_t cpu, Switches& into) const {
    Slice slice;
    slice.from_ns = running_since_;
    slice.to_ns = to_ns;
    slice.thread = thread_;
    slice.cpu = cpu;
    slice.name = into.name("");
    slice.end = end;
    into.slices.push_back(slice);
  }

  int32_t thread_;
  int fd_ = -1;
  size_t bytes_ = 0;
  perf_event_mmap_page* control_ = nullptr;
  const std::byte* records_ = nullptr;
  int64_t running_since_ = 0;
  int32_t last_cpu_ = -1;
};

class PerfSource final : public SwitchSource {
 public:
  Source kind() const override { return Source::perf; }
  void follow(std::span<const int32_t> threads) override {
    for (const int32_t thread : threads) {
      auto opened = std::make_unique<ThreadSwitches>(thread);
      if (opened->opened()) threads_.push_back(std::move(opened));
      else ++lost_;  // all of that thread's
    }
  }
  void drain(Switches& into) override {
    // A killed process's threads would hold their descriptors and pages for the rest of the run.
    std::erase_if(threads_, [&](const auto& thread) {
      const bool gone = kill(thread->thread(), 0) != 0 && errno == ESRCH;
      thread->drain(into, lost_);
      return gone;
    });
  }
  void finish(int64_t now_ns, Switches& into) override {
    for (const auto& thread : threads_) thread->finish(now_ns, into);
  }
  uint64_t lost() const override { return lost_; }

 private:
  std::vector<std::unique_ptr<ThreadSwitches>> threads_;
  uint64_t lost_ = 0;
};

}  // namespace

std::unique_ptr<SwitchSource> open_perf(std::string& why_not) {
  errno = 0;
  if (const ThreadSwitches trial(gettid()); !trial.opened()) {
    why_not = std::string("perf_event_open: ") + std::strerror(errno);
    return nullptr;
  }
  return std::make_unique<PerfSource>();
}

}  // namespace takt::trace
