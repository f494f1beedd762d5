// SPDX-License-Identifier: Apache-2.0
#include "rt/faults/faulty_writer.hpp"

#include <algorithm>
#include <utility>

#include "rt/faults/damage.hpp"
#include "rt/msg/scalar.hpp"
#include "rt/shm/commit_ring.hpp"

namespace takt::faults {
namespace {

constexpr size_t kMostListed = 64;

void add(std::atomic<uint64_t>& counter, uint64_t by = 1) { counter.fetch_add(by, std::memory_order_relaxed); }

}  // namespace

KeptMessage::KeptMessage(const PortPlan& port)
    : type_(port.type), memory_(aligned_bytes(port.type->bytes(port.capacity))) {
  type_->place(memory_.get(), port.capacity);
}

void KeptMessage::keep(const void* message, int64_t stamp_ns) {
  copy_used(*type_, message, memory_.get());
  stamp_ns_ = stamp_ns;
  full_ = true;
}

void KeptMessage::write_to(void* message) const { copy_used(*type_, memory_.get(), message); }

Hoard::Hoard(std::unique_ptr<Reader> reader, uint32_t chunks)
    : reader_(std::move(reader)), listed_(kMostListed), held_(chunks) {}

void Hoard::grab() {
  const size_t listed = reader_->list(kForever, listed_);
  for (size_t i = listed; i-- > 0 && count_ < held_.size();) {
    if (listed_[i].sequence <= newest_) continue;
    newest_ = listed_[i].sequence;
    if (const Held held = reader_->take(newest_)) held_[count_++] = held;
  }
}

void Hoard::let_go() {
  while (count_ > 0) reader_->release(held_[--count_]);
}

FaultyWriter::FaultyWriter(std::unique_ptr<Writer> inner, std::vector<Strike> strikes, const Clock& clock,
                           const std::atomic<int64_t>& epoch_ns, std::atomic<uint64_t>& offered)
    : inner_(std::move(inner)), strikes_(std::move(strikes)), clock_(clock), epoch_ns_(epoch_ns), offered_(offered) {}

FaultyWriter::~FaultyWriter() {
  for (Strike& strike : strikes_) strike.hoard.let_go();
}

bool FaultyWriter::covers(const Strike& strike, int64_t now_ns) const {
  const int64_t epoch = epoch_ns_.load(std::memory_order_relaxed);
  return epoch != 0 && strike.fault.covers(now_ns - epoch);
}

void FaultyWriter::hoard(int64_t now_ns) {
  for (Strike& strike : strikes_) {
    if (strike.fault.kind != MessageFaultKind::exhaust) continue;
    if (covers(strike, now_ns)) strike.hoard.grab();
    else strike.hoard.let_go();
  }
}

MessageHeader* FaultyWriter::loan() {
  const int64_t now = clock_.now_ns();
  hoard(now);
  MessageHeader* const chunk = inner_->loan();
  if (chunk != nullptr) return loaned_ = chunk;
  if (loaned_ != nullptr) return nullptr;  // the job has its chunk: no strike of ours
  for (Strike& strike : strikes_)
    if (strike.fault.kind == MessageFaultKind::exhaust && covers(strike, now)) add(strike.count->struck);
  return nullptr;
}

void FaultyWriter::publish(int64_t stamp_ns, int64_t published_ns, int64_t visible_at_ns) {
  if (loaned_ == nullptr) return;
  strike_and_send({.stamp_ns = stamp_ns, .published_ns = published_ns, .visible_at_ns = visible_at_ns});
  conclude(true);
  hoard(published_ns);
}

void FaultyWriter::announce(int64_t stamp_ns, uint32_t commit, int64_t delay_ns) {
  if (loaned_ == nullptr) return;
  strike_and_send({.stamp_ns = stamp_ns, .published_ns = clock_.now_ns(), .visible_at_ns = delay_ns, .commit = commit});
}

void FaultyWriter::settle(int64_t published_ns, int64_t visible_at_ns) {
  inner_->settle(published_ns, visible_at_ns);
  conclude(visible_at_ns != CommitRing::kNever);
  hoard(published_ns);
}

void FaultyWriter::strike_and_send(Draft draft) {
  offers_ = true;
  for (Strike& strike : strikes_)
    if (!draft.withheld) apply(strike, draft);
  send(draft);
}

void FaultyWriter::conclude(bool visible) {
  if (visible && offers_) add(offered_);
  for (Strike& strike : strikes_) {
    const Strike::Doing doing = std::exchange(strike.doing, {});
    // What was held back is gone once it is out; what a withdrawn job had held back it had not made.
    const bool kept_now = strike.fault.kind == MessageFaultKind::reorder && doing.struck > 0;
    if (visible ? doing.gave_kept : kept_now) strike.kept.forget();
    if (!visible) continue;
    add(strike.count->struck, doing.struck);
    add(strike.count->withheld, doing.withheld);
    add(strike.count->added, doing.added);
  }
  offers_ = false;
}

void FaultyWriter::apply(Strike& strike, Draft& draft) {
  const MessageFault& fault = strike.fault;
  const bool covered = covers(strike, draft.published_ns);
  if (fault.kind == MessageFaultKind::freeze && !covered) strike.kept.forget();
  const bool struck = covered && strikes(fault, number());
  if (fault.kind == MessageFaultKind::reorder) return swap(strike, draft, struck);
  if (!struck) return;
  const uint64_t seed = mixed(fault.seed, fault.port, ~number());
  const MessageType& type = *strike.type;
  switch (fault.kind) {
    case MessageFaultKind::drop: draft.withheld = true; break;
    case MessageFaultKind::delay: draft.visible_at_ns += fault.by_ns; break;
    case MessageFaultKind::duplicate: draft.twice = &strike; break;
    case MessageFaultKind::clock_step: draft.stamp_ns += fault.by_ns; break;
    case MessageFaultKind::freeze: return freeze(strike, draft);
    case MessageFaultKind::corrupt:
      if (!corrupt(type, loaned_ + 1, seed)) return;
      break;
    case MessageFaultKind::truncate:
      if (!truncate(type, loaned_ + 1, seed)) return;
      break;
    case MessageFaultKind::reorder:
    case MessageFaultKind::exhaust: return;  // strikes elsewhere
  }
  ++strike.doing.struck;
  if (fault.kind == MessageFaultKind::drop) ++strike.doing.withheld;
}

void FaultyWriter::freeze(Strike& strike, Draft& draft) {
  if (!strike.kept.full()) return strike.kept.keep(loaned_ + 1, draft.stamp_ns);
  strike.kept.write_to(loaned_ + 1);
  ++strike.doing.struck;
}

void FaultyWriter::swap(Strike& strike, Draft& draft, bool struck) {
  if (strike.kept.full()) {
    draft.released_after = &strike;
    return;
  }
  if (!struck) return;
  strike.kept.keep(loaned_ + 1, draft.stamp_ns);
  draft.withheld = true;
  ++strike.doing.struck;
  ++strike.doing.withheld;
}

void FaultyWriter::send(const Draft& draft) {
  MessageHeader* const loaned = loaned_;
  loaned_ = nullptr;
  if (draft.withheld) return inner_->discard();
  const int32_t level = loaned->level;
  put(draft, draft.stamp_ns);
  if (draft.twice != nullptr && put_again(draft)) ++draft.twice->doing.added;
  if (draft.released_after != nullptr) follow_up(*draft.released_after, draft, level);
}

void FaultyWriter::put(const Draft& draft, int64_t stamp_ns) {
  if (draft.commit != 0) inner_->announce(stamp_ns, draft.commit, draft.visible_at_ns);
  else inner_->publish(stamp_ns, draft.published_ns, draft.visible_at_ns);
}

bool FaultyWriter::put_again(const Draft& draft) {
  if (draft.commit != 0) return inner_->announce_again(draft.commit, draft.visible_at_ns);
  return inner_->repeat(draft.published_ns, draft.visible_at_ns);
}

void FaultyWriter::follow_up(Strike& strike, const Draft& draft, int32_t level) {
  strike.doing.gave_kept = true;
  MessageHeader* header = inner_->loan();
  if (header == nullptr) return;  // it stays withheld, and is counted so
  strike.kept.write_to(header + 1);
  header->level = level;
  put(draft, strike.kept.stamp_ns());
  ++strike.doing.added;
}

void FaultyWriter::discard() {
  loaned_ = nullptr;
  inner_->discard();
}

bool FaultyWriter::repeat(int64_t published_ns, int64_t visible_at_ns) {
  const bool repeated = strike_and_send_again({.published_ns = published_ns, .visible_at_ns = visible_at_ns});
  conclude(true);
  return repeated;
}

bool FaultyWriter::announce_again(uint32_t commit, int64_t delay_ns) {
  return strike_and_send_again({.published_ns = clock_.now_ns(), .visible_at_ns = delay_ns, .commit = commit});
}

bool FaultyWriter::strike_and_send_again(Draft draft) {
  // A message that is not the node's own work: the windows that keep messages away hold for it, too.
  Strike* dropped = nullptr;
  for (Strike& strike : strikes_) {
    if (!covers(strike, draft.published_ns) || !strikes(strike.fault, number())) continue;
    if (strike.fault.kind == MessageFaultKind::delay) draft.visible_at_ns += strike.fault.by_ns;
    if (strike.fault.kind == MessageFaultKind::drop) dropped = &strike;
  }
  const bool repeated = dropped == nullptr && put_again(draft);
  offers_ = repeated || dropped != nullptr;
  if (dropped == nullptr) return repeated;
  ++dropped->doing.struck;
  ++dropped->doing.withheld;
  return false;
}

}  // namespace takt::faults
