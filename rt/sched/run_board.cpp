// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/run_board.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <stdexcept>

#include "rt/node.hpp"

namespace takt {

namespace {

constexpr size_t kPage = 4096;

}  // namespace

/// Makes records one after the other; without memory it only counts.
class RunBoard::Placer {
 public:
  explicit Placer(std::byte* memory) : memory_(memory) {}
  template <class T>
  T* make() {
    static_assert(alignof(T) == kCacheLine, "no two records share a cache line");
    T* record = memory_ == nullptr ? nullptr : ::new (memory_ + used_) T;
    used_ += sizeof(T);
    return record;
  }
  template <class T>
  void make(std::vector<T*>& at, size_t index) {
    at[index] = make<T>();
  }
  size_t to_next_page() { return used_ = (used_ + kPage - 1) / kPage * kPage; }

 private:
  std::byte* memory_;
  size_t used_ = 0;
};

RunBoard::RunBoard(const Plan& plan, size_t processes, std::span<const size_t> process_of)
    : mode_count_(std::max<size_t>(plan.modes.size(), 1)),
      safe_stop_mode_(plan.safe_stop),
      mode_rules_(plan.mode_rules),
      producers_(plan),
      processes_(processes),
      spare_signs_(processes),
      spare_orders_(processes) {
  size_t edges = 0, params = 0;
  for (const TaskPlan& task : plan.tasks) {
    first_edge_.push_back(edges);
    edges += task.edges.size();
    first_param_.push_back(params);
    params += task.node != nullptr ? task.node->params().size() : 0;
    task_names_.push_back(task.name);
    has_source_.push_back(task.device);
  }
  first_param_.push_back(params);
  kept_.resize(params);
  tasks_.resize(plan.tasks.size());
  grants_.resize(tasks_.size());
  commits_.resize(tasks_.size());
  mail_.resize(tasks_.size());
  logs_.resize(tasks_.size());
  sources_.resize(tasks_.size());
  source_facts_.resize(tasks_.size());
  edges_.resize(edges);
  ports_.resize(plan.ports.size());
  capacities_.resize(plan.ports.size());
  stop_words_.resize(1 + processes);
  mode_requests_.resize(processes);
  entered_requests_.resize(processes);
  bytes_ = lay_out(plan, process_of, nullptr);
  void* memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory == MAP_FAILED)
    throw std::runtime_error("shared memory of " + std::to_string(bytes_) + " bytes: " + std::strerror(errno));
  memory_ = static_cast<std::byte*>(memory);
  lay_out(plan, process_of, memory_);
  stop_ = std::make_unique<StopSignal>(stop_words_);
  modes_ = std::make_unique<Modes>(supervised_->modes, mode_requests_, entered_requests_);
}

RunBoard::~RunBoard() { munmap(memory_, bytes_); }

size_t RunBoard::lay_out(const Plan& plan, std::span<const size_t> process_of, std::byte* memory) {
  Placer placer(memory);
  shared_ = placer.make<Shared>();
  for (size_t t = 0; t < tasks_.size(); ++t) placer.make(commits_, t);
  areas_.assign(1, placer.to_next_page());
  supervised_ = placer.make<Supervised>();
  stop_words_[0] = memory != nullptr ? &supervised_->stop : nullptr;
  for (size_t process = 0; process < processes_.size(); ++process) placer.make(entered_requests_, process);
  for (size_t process = 0; process < processes_.size(); ++process) placer.make(spare_orders_, process);
  areas_.push_back(placer.to_next_page());
  const auto process_of_task = [&](size_t t) { return t < process_of.size() ? process_of[t] : 0; };
  for (size_t process = 0; process < processes_.size(); ++process) {
    placer.make(processes_, process);
    placer.make(stop_words_, 1 + process);
    placer.make(mode_requests_, process);
    placer.make(spare_signs_, process);
    for (size_t t = 0; t < tasks_.size(); ++t) {
      if (process_of_task(t) != process) continue;
      placer.make(tasks_, t);
      placer.make(grants_, t);
      placer.make(mail_, t);
      placer.make(logs_, t);
      placer.make(sources_, t);
      placer.make(source_facts_, t);
      for (size_t e = first_edge_[t]; e < first_edge_[t] + plan.tasks[t].edges.size(); ++e) placer.make(edges_, e);
      for (size_t i = first_param_[t]; i < first_param_[t + 1]; ++i) placer.make(kept_, i);
    }
    for (size_t p = 0; p < ports_.size(); ++p) {
      const size_t producer = producers_.find(p);
      if ((producer == kNone ? 0 : process_of_task(producer)) != process) continue;
      placer.make(ports_, p);
      placer.make(capacities_, p);
    }
    areas_.push_back(placer.to_next_page());
  }
  return areas_.back();
}

void RunBoard::keep_to(size_t process) {
  stop_->speak_as(1 + process);
  modes_->speak_as(process);
  for (size_t area = 0; area + 1 < areas_.size(); ++area)
    if (area != process + 1 && mprotect(memory_ + areas_[area], areas_[area + 1] - areas_[area], PROT_READ) != 0)
      throw std::runtime_error(std::string("the records of other processes cannot be protected: ") +
                               std::strerror(errno));
}

void RunBoard::safe_stop(int64_t from_ns, std::string_view reason) {
  if (safe_stop_mode_ != kNone) modes().request(static_cast<uint32_t>(safe_stop_mode_), from_ns, reason);
}

void RunBoard::set_grant(size_t t, const Grant& grant) {
  GrantRecord& record = *grants_[t];
  record.policy = grant.policy;
  record.verified = grant.verified;
  record.priority = grant.priority;
  record.runtime_ms = grant.runtime_ms;
  record.deadline_ms = grant.deadline_ms;
  record.cpus.fill(0);
  for (const int cpu : grant.cpus)
    if (cpu >= 0 && static_cast<size_t>(cpu) < record.cpus.size() * 64)
      record.cpus[static_cast<size_t>(cpu) / 64] |= uint64_t{1} << (cpu % 64);
  record.refused = BoundedText<512>(grant.refused);
}

Grant RunBoard::grant(size_t t) const {
  const GrantRecord& record = *grants_[t];
  Grant grant;
  grant.policy = record.policy;
  grant.verified = record.verified;
  grant.priority = record.priority;
  grant.runtime_ms = record.runtime_ms;
  grant.deadline_ms = record.deadline_ms;
  for (size_t cpu = 0; cpu < record.cpus.size() * 64; ++cpu)
    if ((record.cpus[cpu / 64] >> (cpu % 64)) & 1) grant.cpus.push_back(static_cast<int>(cpu));
  grant.refused = record.refused.text();
  return grant;
}

}  // namespace takt
