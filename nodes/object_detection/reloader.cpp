// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/reloader.hpp"

#include <exception>
#include <utility>

namespace takt::object_detection {

Reloader::Reloader(std::function<std::unique_ptr<Detector>(const std::string&)> build) : build_(std::move(build)) {
  revision_.reserve(kLongestRevision);
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

Reloader::~Reloader() {
  thread_.request_stop();
  become(kSpent);
}

void Reloader::become(uint32_t state) {
  state_.store(state, std::memory_order_release);
  state_.notify_all();
}

void Reloader::ask(std::string_view revision) {
  revision_.assign(revision.substr(0, kLongestRevision));
  become(kAsked);
}

void Reloader::wait() const {
  while (!built()) state_.wait(kAsked, std::memory_order_acquire);
}

bool Reloader::exchange(std::unique_ptr<Detector>& in_use) {
  const bool there = detector_ != nullptr;
  if (there) detector_.swap(in_use);
  become(kSpent);
  return there;
}

void Reloader::serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    uint32_t state = state_.load(std::memory_order_acquire);
    if (state == kAsked) {
      detector_.reset();
      error_.clear();
      try {
        detector_ = build_(revision_);
      } catch (const std::exception& error) {
        error_ = error.what();
      }
      state_.compare_exchange_strong(state, kBuilt, std::memory_order_acq_rel);
      state_.notify_all();
    } else if (state == kSpent) {
      detector_.reset();
      state_.compare_exchange_strong(state, kIdle, std::memory_order_acq_rel);
    } else {
      state_.wait(state, std::memory_order_acquire);
    }
  }
}

}  // namespace takt::object_detection
