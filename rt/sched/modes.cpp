// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/modes.hpp"

#include <optional>

namespace takt {
namespace {

constexpr uint64_t kNumbers = 1 << 15;

uint64_t with_check(uint64_t what, int64_t from_ns) {
  const uint64_t mixed = (what ^ static_cast<uint64_t>(from_ns) * 0x9e37'79b9'7f4a'7c15) * 0xd6e8'feb8'6659'fd93;
  return what << 32 | mixed >> 32;
}

/// Nothing: there is none, it is being written, or nobody asked for what stands there.
std::optional<ModeEntry> valid(const ModeRequests::Request& request, uint64_t word) {
  const int64_t from_ns = request.from_ns.load(std::memory_order_acquire);
  const uint64_t what = word >> 32;
  if (word == 0 || word != with_check(what, from_ns)) return std::nullopt;
  return ModeEntry{static_cast<uint32_t>(what & 0xffff), from_ns, ModeOrigin(what >> 16 & 1)};
}

std::optional<ModeEntry> valid(const ModeRequests::Request& request) {
  return valid(request, request.word.load(std::memory_order_acquire));
}

bool earlier(const ModeEntry& a, const ModeEntry& b) { return a.from_ns < b.from_ns; }

}  // namespace

template <class Visitor>
void Modes::for_each_unmerged(const Visitor& visit) const {
  // Before the requests: one that is entered meanwhile is seen as well here, and never missed by both.
  const int64_t merged_until_ns = log_.newest_ns();
  for (const ModeRequests* asked : requests_) {
    const uint64_t count = asked->count.load(std::memory_order_acquire);
    for (uint64_t i = count; i > 0 && count - i < ModeRequests::kKept; --i) {
      const auto change = valid(asked->requests[(i - 1) % ModeRequests::kKept]);
      if (!change) continue;
      if (change->from_ns <= merged_until_ns) break;
      visit(*change);
    }
  }
}

Modes::Unmerged Modes::unmerged() const {
  Unmerged all;
  for_each_unmerged([&](const ModeEntry& change) {
    if (all.count == all.changes.size()) return;
    const auto end = all.changes.begin() + static_cast<std::ptrdiff_t>(all.count);
    const auto place = std::upper_bound(all.changes.begin(), end, change, earlier);
    std::move_backward(place, end, end + 1);
    *place = change;
    ++all.count;
  });
  return all;
}

TAKT_HOT uint32_t Modes::at(int64_t release_ns) const {
  std::optional<ModeEntry> newest;
  for_each_unmerged([&](const ModeEntry& change) {
    if (change.from_ns <= release_ns && (!newest || change.from_ns >= newest->from_ns)) newest = change;
  });
  return newest ? newest->mode : log_.at(release_ns);
}

ModeInForce Modes::in_force() const {
  const Unmerged asked = unmerged();
  ModeInForce now = log_.in_force();
  for (size_t i = 0; i < asked.count; ++i) {
    const ModeEntry& change = asked.changes[i];
    now = {change.mode, change.origin, change.origin == ModeOrigin::rule ? now.before : change.mode};
  }
  return now;
}

bool Modes::request(uint32_t mode, int64_t from_ns, std::string_view reason, bool by_hand) {
  if (own_ == nullptr) {
    if (any_news()) enter_all(std::unique_lock(gathering_));
    return log_.request(mode, from_ns, reason, by_hand);
  }
  if (const ModeInForce now = in_force(); now.mode == mode && now.origin == ModeOrigin::other) return true;
  return (!by_hand || log_.has_room()) && ask(mode, from_ns, reason, ModeOrigin::other);
}

bool Modes::request_by_rule(uint32_t mode, int64_t from_ns, std::string_view reason) {
  if (own_ == nullptr) {
    if (any_news()) enter_all(std::unique_lock(gathering_));
    return log_.request_by_rule(mode, from_ns, reason);
  }
  if (newest() == mode) return true;
  return log_.has_room() && ask(mode, from_ns, reason, ModeOrigin::rule);
}

bool Modes::ask(uint32_t mode, int64_t from_ns, std::string_view reason, ModeOrigin origin) {
  const Unmerged asked = unmerged();
  // After whatever is known, so that the order in which they are entered does not matter.
  const int64_t newest_ns = asked.count > 0 ? asked.changes[asked.count - 1].from_ns : log_.newest_ns();
  from_ns = std::max(from_ns, newest_ns + 1);
  const uint64_t number = own_->count.fetch_add(1, std::memory_order_acq_rel);
  ModeRequests::Request& request = own_->requests[number % ModeRequests::kKept];
  request.word.store(0);
  request.reason = BoundedText<120>(reason);
  request.from_ns.store(from_ns, std::memory_order_release);
  const uint64_t what = mode | static_cast<uint64_t>(origin) << 16 | number % kNumbers << 17;
  request.word.store(with_check(what, from_ns), std::memory_order_release);
  return true;
}

uint64_t Modes::news(size_t process, size_t request) const {
  const uint64_t word = requests_[process]->requests[request].word.load(std::memory_order_acquire);
  return word == entered_[process]->words[request].load(std::memory_order_relaxed) ? 0 : word;
}

bool Modes::any_news() const {
  for (size_t process = 0; process < requests_.size(); ++process)
    for (size_t i = 0; i < ModeRequests::kKept; ++i)
      if (news(process, i) != 0) return true;
  return false;
}

void Modes::gather() {
  if (any_news()) enter_all(std::unique_lock(gathering_, std::try_to_lock));
}

void Modes::enter_all(std::unique_lock<std::mutex> turn) {
  if (!turn) return;
  struct New : ModeEntry {
    BoundedText<120> reason;
  };
  std::vector<New> all;
  for (size_t process = 0; process < requests_.size(); ++process)
    for (size_t i = 0; i < ModeRequests::kKept; ++i) {
      const uint64_t word = news(process, i);
      const ModeRequests::Request& request = requests_[process]->requests[i];
      if (word == 0) continue;
      if (const auto change = valid(request, word)) all.push_back({*change, request.reason});
      entered_[process]->words[i].store(word);
    }
  std::stable_sort(all.begin(), all.end(), earlier);
  for (const New& change : all) {
    // A rule that did not know of a later change would undo it. Whoever still wants its mode asks again.
    if (change.origin == ModeOrigin::rule && change.from_ns <= log_.newest_ns()) continue;
    if (change.origin == ModeOrigin::rule) log_.enter(change, change.reason.text());
    else log_.request(change.mode, change.from_ns, change.reason.text());
  }
}

}  // namespace takt
