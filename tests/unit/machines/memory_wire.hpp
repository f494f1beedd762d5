// SPDX-License-Identifier: Apache-2.0
// A network in memory for tests: what is sent by one machine may be lost on its way to the others.
#pragma once
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "graph/machines/wire.hpp"

namespace takt::test {

struct Network {
  struct End {
    std::vector<std::string> topics;
    machines::Wire::Each each;
  };
  std::mutex mutex;
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
        if (end->topics[i] == topic && end->each) end->each(i, bytes);
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
  void begin(Each each) override {
    const std::lock_guard lock(network_.mutex);
    end_.each = std::move(each);
  }

 private:
  Network& network_;
  Network::End end_;
  std::vector<std::string> sent_;
};

}  // namespace takt::test
