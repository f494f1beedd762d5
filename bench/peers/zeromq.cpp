// SPDX-License-Identifier: Apache-2.0
// ZeroMQ publish and subscribe: one PUB socket per node, one SUB socket per incoming edge; inproc or ipc.
#include <zmq.h>

#include "bench/peers/medium.hpp"
#include "bench/suite.hpp"

namespace takt::bench {
namespace {

constexpr int kNoLinger = 0;  // unsent messages must not hold up the end

/// One message in hand.
class Message {
 public:
  Message() { zmq_msg_init(&message_); }
  ~Message() { zmq_msg_close(&message_); }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  zmq_msg_t* get() { return &message_; }

 private:
  zmq_msg_t message_;
};

class ZeromqEnds final : public Ends {
 public:
  /// `context` is this node's own if `owned`, else shared by all.
  ZeromqEnds(const MediumPlan& plan, size_t node, const std::string& scheme, void* context, bool owned)
      : bytes_(plan.bytes), context_(context), owned_(owned) {
    if (node != plan.shape.sink()) {
      publisher_ = zmq_socket(context_, ZMQ_PUB);
      zmq_setsockopt(publisher_, ZMQ_LINGER, &kNoLinger, sizeof kNoLinger);
      if (zmq_bind(publisher_, address(scheme, plan.id, node).c_str()) != 0)
        throw CannotRun(std::string("ZeroMQ: ") + zmq_strerror(zmq_errno()));
    }
    if (const auto producer = plan.shape.trigger(node)) subscribe(address(scheme, plan.id, *producer));
    for (size_t producer : plan.shape.sides(node)) subscribe(address(scheme, plan.id, producer));
  }
  ~ZeromqEnds() override {
    for (auto& input : inputs_) zmq_close(input->socket);
    if (publisher_ != nullptr) zmq_close(publisher_);
    if (owned_) zmq_ctx_term(context_);
  }
  ZeromqEnds(const ZeromqEnds&) = delete;
  ZeromqEnds& operator=(const ZeromqEnds&) = delete;

  bool wait() override { return zmq_msg_recv(inputs_[0]->message.get(), inputs_[0]->socket, 0) >= 0; }
  size_t take_sides() override {
    size_t fresh = 0;
    for (size_t i = 1; i < inputs_.size(); ++i)
      fresh += zmq_msg_recv(inputs_[i]->message.get(), inputs_[i]->socket, ZMQ_DONTWAIT) >= 0;
    return fresh;
  }
  void prepare() override { zmq_msg_init_size(&next_, bytes_); }
  void publish() override {
    if (zmq_msg_send(&next_, publisher_, 0) < 0) zmq_msg_close(&next_);
  }

 private:
  struct Input {
    void* socket = nullptr;
    Message message;
  };
  static std::string address(const std::string& scheme, const std::string& id, size_t node) {
    return scheme + id + "_" + std::to_string(node);
  }
  void subscribe(const std::string& address) {
    auto input = std::make_unique<Input>();
    input->socket = zmq_socket(context_, ZMQ_SUB);
    const int patience_ms = static_cast<int>(kPatienceNs / 1'000'000);
    zmq_setsockopt(input->socket, ZMQ_RCVTIMEO, &patience_ms, sizeof patience_ms);
    zmq_setsockopt(input->socket, ZMQ_LINGER, &kNoLinger, sizeof kNoLinger);
    zmq_setsockopt(input->socket, ZMQ_SUBSCRIBE, "", 0);
    if (zmq_connect(input->socket, address.c_str()) != 0)
      throw CannotRun(std::string("ZeroMQ: ") + zmq_strerror(zmq_errno()));
    inputs_.push_back(std::move(input));
  }

  const size_t bytes_;
  void* context_;
  const bool owned_;
  void* publisher_ = nullptr;
  std::vector<std::unique_ptr<Input>> inputs_;  ///< the trigger first
  zmq_msg_t next_{};
};

class ZeromqIpc final : public Medium {
 public:
  explicit ZeromqIpc(const MediumPlan& plan) : plan_(plan) {}
  /// Abstract socket names: nothing is left behind in the file system.
  std::unique_ptr<Ends> open(size_t node) override {
    return std::make_unique<ZeromqEnds>(plan_, node, "ipc://@takt-bench-", zmq_ctx_new(), true);
  }

 private:
  const MediumPlan plan_;
};

class ZeromqInproc final : public Medium {
 public:
  explicit ZeromqInproc(const MediumPlan& plan) : plan_(plan), context_(zmq_ctx_new()) {}
  ~ZeromqInproc() override { zmq_ctx_term(context_); }
  ZeromqInproc(const ZeromqInproc&) = delete;
  ZeromqInproc& operator=(const ZeromqInproc&) = delete;
  std::unique_ptr<Ends> open(size_t node) override {
    return std::make_unique<ZeromqEnds>(plan_, node, "inproc://", context_, false);
  }

 private:
  const MediumPlan plan_;
  void* context_;
};

}  // namespace

std::unique_ptr<Medium> make_zeromq_ipc(const MediumPlan& plan) { return std::make_unique<ZeromqIpc>(plan); }
std::unique_ptr<Medium> make_zeromq_inproc(const MediumPlan& plan) { return std::make_unique<ZeromqInproc>(plan); }

}  // namespace takt::bench
