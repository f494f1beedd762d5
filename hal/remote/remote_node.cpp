// SPDX-License-Identifier: Apache-2.0
#include "hal/remote/remote_node.hpp"

#include <cstring>
#include <utility>

namespace takt {

RemoteNode::RemoteNode(std::vector<Port> ports, std::unique_ptr<RemoteSource> source)
    : ports_(std::move(ports)), source_(std::move(source)) {
  for (const Port& port : ports_) outputs_.emplace_back(this, port.name, *port.type, port.doc);
}

void RemoteNode::setup(Setup& setup) {
  for (Any& output : outputs_) output.reserve(source_->capacity(output.name()));
  open_in_setup(setup);
}

void RemoteNode::run(Job& job) {
  if (!running(job)) return job.no_result();
  bool sent = false;
  for (size_t i = 0; i < outputs_.size(); ++i) sent = hand_on(source_->inbox(i), outputs_[i], job.release_ns()) || sent;
  const ReadStatus there = source_->status(job.release_ns());
  accept(there == ReadStatus::ok && !outputs_.empty() && !sent ? ReadStatus::no_data : there, job);
}

bool RemoteNode::hand_on(Inbox& inbox, Any& output, int64_t release_ns) {
  const Inbox::Message* const arrived = inbox.next(release_ns);
  if (arrived == nullptr) return false;
  void* const message = output.loan();
  if (message == nullptr) return false;  // it stays the next one
  std::memcpy(message, arrived->memory.get(), inbox.message_bytes());
  output.send(arrived->stamp_ns);
  inbox.taken();
  return true;
}

}  // namespace takt
