// SPDX-License-Identifier: Apache-2.0
#include "graph/web/hub.hpp"

#include <utility>

namespace takt::web {

void Hub::look(const View& view, double most_hz) {
  const std::lock_guard lock(mutex_);
  slots_[view].rates.insert(most_hz);
  ++wants_;
}

void Hub::leave(const View& view, double most_hz) {
  const std::lock_guard lock(mutex_);
  const auto slot = slots_.find(view);
  if (slot == slots_.end()) return;
  auto& rates = slot->second.rates;
  if (const auto one = rates.find(most_hz); one != rates.end()) rates.erase(one);
  if (rates.empty()) slots_.erase(slot);
  ++wants_;
}

std::vector<Hub::Want> Hub::wanted() const {
  const std::lock_guard lock(mutex_);
  std::vector<Want> all;
  for (const auto& [view, slot] : slots_) all.push_back({view, *slot.rates.rbegin()});
  return all;
}

uint64_t Hub::wants() const {
  const std::lock_guard lock(mutex_);
  return wants_;
}

void Hub::put(const View& view, std::vector<Part> parts) {
  {
    const std::lock_guard lock(mutex_);
    const auto slot = slots_.find(view);
    if (slot == slots_.end()) return;  // who looked has left meanwhile
    slot->second.shown = {++versions_, std::move(parts)};
  }
  wake_();
}

std::optional<Hub::Shown> Hub::newer(const View& view, uint64_t seen) const {
  const std::lock_guard lock(mutex_);
  const auto slot = slots_.find(view);
  if (slot == slots_.end() || slot->second.shown.version <= seen) return std::nullopt;
  return slot->second.shown;
}

void Hub::set_graph(Json graph, std::vector<Channel> channels, std::string why) {
  {
    const std::lock_guard lock(mutex_);
    graph_ = std::move(graph);
    channels_ = std::move(channels);
    why_gone_ = std::move(why);
    if (!graph_.is_null()) events_ = Json::array();
    ++graph_version_;
  }
  wake_();
}

Json Hub::graph() const {
  const std::lock_guard lock(mutex_);
  return graph_;
}

std::vector<Channel> Hub::channels() const {
  const std::lock_guard lock(mutex_);
  return channels_;
}

std::string Hub::why_gone() const {
  const std::lock_guard lock(mutex_);
  return why_gone_;
}

uint64_t Hub::graph_version() const {
  const std::lock_guard lock(mutex_);
  return graph_version_;
}

void Hub::broadcast(Json news) {
  {
    const std::lock_guard lock(mutex_);
    for (const Json& event : news.value("events", Json::array())) events_.push_back(event);
    if (events_.size() > kEvents)
      events_.erase(events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(events_.size() - kEvents));
    news_.push_back(std::move(news));
    if (news_.size() > kEvents) news_.erase(news_.begin());  // nobody serves: the server is ending
  }
  wake_();
}

std::vector<Json> Hub::take_news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

Json Hub::events() const {
  const std::lock_guard lock(mutex_);
  return events_;
}

}  // namespace takt::web
