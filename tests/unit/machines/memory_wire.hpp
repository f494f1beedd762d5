// SPDX-License-Identifier: Apache-2.0
// A network in memory for tests: what is sent by one machine may be lost on its way to the others.
#pragma once
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "graph/machines/wire.hpp"

namespace takt::test {

struct Network {
  using Bytes = std::vector<std::byte>;
  struct End {
    std::vector<std::string> topics;
    std::deque<std::pair<size_t, Bytes>> arrived;
  };
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<End*> ends;
  std::function<bool(const std::string& topic)> loses = [](const std::string&) { return false; };

  void lose(std::function<bool(const std::string& topic)> which) {
    const std::lock_guard lock(mutex);
    loses = std::move(which);
  }
  void carry(const std::string& topic, std::span<const std::byte> bytes) {
    const std::lock_guard lock(mutex);
    if (loses(topic)) return;
    for (End* end : ends)
      for (size_t i = 0; i < end->topics.size(); ++i)
        if (end->topics[i] == topic) end->arrived.emplace_back(i, Bytes(bytes.begin(), bytes.end()));
    changed.notify_all();
  }
};

class MemoryWire final : public machines::Wire {
 public:
  explicit MemoryWire(Network& network) : network_(network) {
    const std::lock_guard lock(network_.mutex);
    network_.ends.push_back(&end_);
  }
  ~MemoryWire() override {
    const std::lock_guard lock(network_.mutex);
    std::erase(network_.ends, &end_);
  }
  size_t sends(const Topic& topic) override { return sent_.push_back(topic.name), sent_.size() - 1; }
  size_t takes(const Topic& topic) override {
    const std::lock_guard lock(network_.mutex);
    return end_.topics.push_back(topic.name), end_.topics.size() - 1;
  }
  void send(size_t topic, std::span<const std::byte> bytes) override { network_.carry(sent_[topic], bytes); }
  void take(int64_t patience_ns, const std::function<void(size_t, std::span<const std::byte>)>& each) override {
    std::deque<std::pair<size_t, Network::Bytes>> all;
    {
      std::unique_lock lock(network_.mutex);
      network_.changed.wait_for(lock, std::chrono::nanoseconds(patience_ns), [&] { return !end_.arrived.empty(); });
      all.swap(end_.arrived);
    }
    for (const auto& [topic, bytes] : all) each(topic, bytes);
  }

 private:
  Network& network_;
  Network::End end_;
  std::vector<std::string> sent_;
};

}  // namespace takt::test
