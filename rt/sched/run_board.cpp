// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/run_board.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <stdexcept>

namespace takt {
namespace {

constexpr size_t kLine = 64;  // no two records share a cache line

template <class T>
constexpr size_t room_for(size_t count) {
  return (sizeof(T) * count + kLine - 1) / kLine * kLine;
}

}  // namespace

template <class T>
T* RunBoard::place(std::byte*& at, size_t count) {
  static_assert(alignof(T) <= kLine);
  T* first = reinterpret_cast<T*>(at);
  for (size_t i = 0; i < count; ++i) ::new (first + i) T;
  at += room_for<T>(count);
  return first;
}

RunBoard::RunBoard(const Plan& plan, size_t processes)
    : process_count_(processes), safe_stop_mode_(plan.safe_stop), mode_rules_(plan.mode_rules), producers_(plan) {
  size_t edges = 0;
  for (const TaskPlan& task : plan.tasks) {
    first_edge_.push_back(edges);
    edges += task.edges.size();
    task_names_.push_back(task.name);
    has_source_.push_back(task.device);
  }
  const size_t tasks = plan.tasks.size(), ports = plan.ports.size();
  bytes_ = room_for<Shared>(1) + room_for<TaskStatistics>(tasks) + room_for<EdgeStatistics>(edges) +
           room_for<PortStatistics>(ports) + room_for<GrantRecord>(tasks) + room_for<CommitRing>(tasks) +
           room_for<ParamMail>(tasks) + room_for<CapacityRecord>(ports) + room_for<ProcessRecord>(processes) +
           room_for<SourceRecord>(tasks) + room_for<SourceFacts>(tasks);
  void* memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED)
    throw std::runtime_error("shared memory of " + std::to_string(bytes_) + " bytes: " + std::strerror(errno));
  std::byte* at = memory_ = static_cast<std::byte*>(memory);
  shared_ = place<Shared>(at, 1);
  tasks_ = place<TaskStatistics>(at, tasks);
  edges_ = place<EdgeStatistics>(at, edges);
  ports_ = place<PortStatistics>(at, ports);
  grants_ = place<GrantRecord>(at, tasks);
  commits_ = place<CommitRing>(at, tasks);
  mail_ = place<ParamMail>(at, tasks);
  capacities_ = place<CapacityRecord>(at, ports);
  processes_ = place<ProcessRecord>(at, processes);
  sources_ = place<SourceRecord>(at, tasks);
  source_facts_ = place<SourceFacts>(at, tasks);
}

RunBoard::~RunBoard() { munmap(memory_, bytes_); }

void RunBoard::safe_stop(int64_t from_ns, std::string_view reason) {
  if (safe_stop_mode_ != kNone) modes().request(static_cast<uint32_t>(safe_stop_mode_), from_ns, reason);
}

void RunBoard::set_grant(size_t t, const Grant& grant) {
  GrantRecord& record = grants_[t];
  record.policy = grant.policy;
  record.verified = grant.verified;
  record.priority = grant.priority;
  record.runtime_ms = grant.runtime_ms;
  record.deadline_ms = grant.deadline_ms;
  record.cpus.fill(0);
  for (const int cpu : grant.cpus)
    if (cpu >= 0 && static_cast<size_t>(cpu) < record.cpus.size() * 64)
      record.cpus[static_cast<size_t>(cpu) / 64] |= uint64_t{1} << (cpu % 64);
  const size_t length = std::min(grant.refused.size(), record.refused.size() - 1);
  std::memcpy(record.refused.data(), grant.refused.data(), length);
  record.refused[length] = 0;
}

Grant RunBoard::grant(size_t t) const {
  const GrantRecord& record = grants_[t];
  Grant grant;
  grant.policy = record.policy;
  grant.verified = record.verified;
  grant.priority = record.priority;
  grant.runtime_ms = record.runtime_ms;
  grant.deadline_ms = record.deadline_ms;
  for (size_t cpu = 0; cpu < record.cpus.size() * 64; ++cpu)
    if ((record.cpus[cpu / 64] >> (cpu % 64)) & 1) grant.cpus.push_back(static_cast<int>(cpu));
  grant.refused = record.refused.data();
  return grant;
}

}  // namespace takt
