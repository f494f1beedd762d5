// SPDX-License-Identifier: Apache-2.0
// What a task does with the outputs of a job that has ended: announces all, commits once, settles
// (shm/commit_ring.hpp). Over a transport without such steps the messages go out after the commit, one by one.
#include <algorithm>
#include <cstdio>

#include "rt/hot.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/sched/task.hpp"
#include "rt/trace/rings.hpp"

namespace takt {

TAKT_HOT void Task::publish(JobEnd& end, int64_t deadline_ns) {
  const bool withholds = plan_.on_miss == OnMiss::skip || plan_.on_miss == OnMiss::reuse_last;
  const int64_t earliest_ns = plan_.publish == PublishAt::let ? deadline_ns : 0;
  const CommitRing::Terms terms{earliest_ns, withholds ? deadline_ns : CommitRing::kNever};
  CommitRing::Filled out{end.finished_ns, CommitRing::kNever};
  std::fill(published_.begin(), published_.end(), false);
  std::fill(sent_stamps_ns_.begin(), sent_stamps_ns_.end(), kNothingSent);
  // A job that ends after its deadline has nothing to announce; one that comes too late only now takes it back.
  const bool whole = outputs_intact();
  if (!whole) out = {end.finished_ns, std::max(end.finished_ns, earliest_ns)};
  else if (end.finished_ns <= terms.latest_ns) out = commit(terms, Offer::made);
  for (size_t i = 0; i < writers_.size(); ++i) {
    if (!published_[i]) writers_[i]->discard();
    PortAccess::reset(*plan_.node->outputs()[i]);
  }
  end.late = out.visible_at_ns > deadline_ns;
  if (out.visible_at_ns == CommitRing::kNever && plan_.on_miss == OnMiss::reuse_last)
    out = commit({earliest_ns, CommitRing::kNever}, Offer::former);
  end.visible_at_ns = out.visible_at_ns == CommitRing::kNever ? out.published_ns : out.visible_at_ns;
  ended_.published_ns = out.published_ns;
  ended_.publish_took_ns = clock_.now_ns() - end.finished_ns;
  if (commits_.spoiled() != spoiled_told_) tell_spoiled();
}

bool Task::outputs_intact() {
  for (size_t i = 0; i < writers_.size(); ++i) {
    if (writers_[i]->intact()) continue;
    ended_.no_result = true;
    Fault fault = fault_now(Fault::damaged, ended_.index);
    const std::string_view port = plan_.node->outputs()[i]->name();
    std::snprintf(fault.what.characters.data(), fault.what.characters.size(),
                  "%s.%.*s: job %llu wrote past its message or over its structure; the outputs of the job are withheld",
                  plan_.name.c_str(), static_cast<int>(port.size()), port.data(),
                  static_cast<unsigned long long>(ended_.index));
    board_.faults().append(fault);
    return false;
  }
  return true;
}

CommitRing::Filled Task::commit(const CommitRing::Terms& terms, Offer offer) {
  const auto offered = [&](size_t i) { return offer == Offer::former || PortAccess::sent(*plan_.node->outputs()[i]); };
  bool any = false;
  for (size_t i = 0; i < writers_.size(); ++i) any = any || offered(i);
  if (!any) {
    const int64_t now_ns = clock_.now_ns();
    return {now_ns, terms.visible_at_ns(now_ns)};
  }
  const uint32_t commit = commits_.open(terms);
  for (size_t i = 0; i < writers_.size(); ++i)
    if (offered(i)) announce(i, commit, offer);
  pass(MessageStep::inside_commit);
  commits_.announced(commit);
  const int64_t now_ns = clock_.now_ns();
  pass(MessageStep::inside_commit);
  const CommitRing::Filled out = commits_.fill(commit, now_ns, clock_);
  for (size_t i = 0; i < writers_.size(); ++i) {
    reached(MessageStep::after_commit, plan_.ports[i]);
    if (offered(i)) settle_output(i, out, offer);
  }
  if (plan_.rings) board_.published().ring();
  return out;
}

void Task::pass(MessageStep step) const {
  for (const size_t port : plan_.ports) reached(step, port);
}

void Task::announce(size_t i, uint32_t commit, Offer offer) {
  OutputPort& output = *plan_.node->outputs()[i];
  Writer& writer = *writers_[i];
  // Before anybody can see it: whatever becomes of this process now, the message can be made again.
  if (trace::on()) trace_offer(i, offer == Offer::former);
  // Stored before it is out: a successor that has no other source goes on after it.
  board_.port(plan_.ports[i]).published.store(sequences_[i] + 1, std::memory_order_relaxed);
  if (offer == Offer::made) PortAccess::set_level(output, ended_.level);
  published_[i] = true;
  if (!writer.announces()) return;
  if (offer == Offer::former) published_[i] = writer.announce_again(commit, 0);
  else writer.announce(PortAccess::stamp_ns(output), commit, 0);
}

void Task::settle_output(size_t i, const CommitRing::Filled& out, Offer offer) {
  Writer& writer = *writers_[i];
  const bool visible = out.visible_at_ns != CommitRing::kNever;
  const int64_t stamp_ns = PortAccess::stamp_ns(*plan_.node->outputs()[i]);
  if (writer.announces()) writer.settle(out.published_ns, out.visible_at_ns);
  else if (visible && offer == Offer::made) writer.publish(stamp_ns, out.published_ns, out.visible_at_ns);
  else if (visible) published_[i] = writer.repeat(out.published_ns, out.visible_at_ns);
  published_[i] = published_[i] && visible;
  if (published_[i]) ++sequences_[i];
  else board_.port(plan_.ports[i]).published.store(sequences_[i], std::memory_order_relaxed);
  if (published_[i] && offer == Offer::made) sent_stamps_ns_[i] = stamp_ns;
  if (plan_.state_every_ns > 0 && i + 1 == writers_.size() && published_[i] && offer == Offer::made)
    state_slot_ = ended_.release_ns / plan_.state_every_ns;
}

void Task::tell_spoiled() {
  Fault fault = fault_now(Fault::spoiled, ended_.index);
  spoiled_told_ = commits_.spoiled();
  std::snprintf(
      fault.what.characters.data(), fault.what.characters.size(),
      "%s: the word that makes its outputs visible was overwritten by a stray store of some process (found %llu "
      "times); readers may have missed a message",
      plan_.name.c_str(), static_cast<unsigned long long>(spoiled_told_));
  board_.faults().append(fault);
}

}  // namespace takt
