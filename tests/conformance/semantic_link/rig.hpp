// SPDX-License-Identifier: Apache-2.0
// A semantic_service and a semantic_link with a line between them, job by job on virtual time. The client's clock is
// ahead of the server's by kAhead_ns.
#pragma once
#include <doctest/doctest.h>
#include <poll.h>

#include <functional>
#include <map>
#include <string>

#include "hal/semantic_link/client.hpp"
#include "hal/semantic_link/client_node.hpp"
#include "hal/semantic_link/dbus_port.hpp"
#include "hal/semantic_link/server.hpp"
#include "hal/semantic_link/service_node.hpp"
#include "hal/semantic_link/udp_port.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/sched/port_access.hpp"
#include "tests/conformance/link_messages.hpp"
#include "tests/conformance/link_network.hpp"
#include "tests/nanoseconds.hpp"

namespace takt::test {

using semantic_link::index_of, semantic_link::info_of, semantic_link::Kind, semantic_link::MessageKind;

constexpr int64_t kLinkPeriod_ns = 20 * kMs, kAhead_ns = 123'456'789'000;

/// Makes the ports of the two ends, the server's first.
struct Line {
  std::function<std::unique_ptr<DatagramPort>()> server, client;
  bool instant = false;  ///< what is sent is there
};

inline Line memory_line(MemoryNetwork& network) {
  return {[&] { return network.server(); }, [&] { return network.client(); }, true};
}
inline Line udp_line() {
  auto address = std::make_shared<semantic_link::UdpAddress>();
  return {[address]() -> std::unique_ptr<DatagramPort> {
            auto port = semantic_link::UdpPort::of_server("service", *address);
            REQUIRE(port->open().has_value());
            *address = port->address();
            return port;
          },
          [address] { return semantic_link::UdpPort::of_client("link", *address); }};
}
inline Line dbus_line(const std::string& bus) {
  const semantic_link::DbusAddress address{bus, "io.takt.test"};
  return {[address] { return semantic_link::DbusPort::of_server("service", address); },
          [address] { return semantic_link::DbusPort::of_client("link", address); }};
}

/// A message of any kind as it lies in a pool.
class Chunk {
 public:
  explicit Chunk(const MessageKind& info)
      : info_(info), memory_(aligned_bytes(sizeof(MessageHeader) + info.type->bytes(info.capacity))) {
    place();
  }
  void place() { info_.type->place(::new (memory_.get()) MessageHeader + 1, info_.capacity); }
  MessageHeader* header() { return reinterpret_cast<MessageHeader*>(memory_.get()); }
  void* message() { return header() + 1; }
  std::vector<std::byte> bytes() {
    std::vector<std::byte> bytes;
    REQUIRE(semantic_link::write_message(info_, message(), bytes));
    return bytes;
  }

 private:
  const MessageKind& info_;
  AlignedBytes memory_;
};

/// One message that went through a port.
struct Passed {
  int64_t stamp_ns = 0;
  std::vector<std::byte> bytes;
};

/// Runs the jobs of one node; what it is given and what it sends are chunks by the name of their port.
class NodeBench {
 public:
  NodeBench(std::unique_ptr<DeviceNode> node, const VirtualClock& clock) : node_(std::move(node)), clock_(clock) {
    for (InputPort* port : node_->inputs())
      if (port->name() != "stop") PortAccess::connect(*port, {});
    Setup setup{clock, ".", {}, 1, Rate{50, 1}};
    node_->setup(setup);
    for (OutputPort* port : node_->outputs()) writers_.push_back(std::make_unique<ChunkWriter>(*port));
    node_->start(clock.now_ns());
  }
  ~NodeBench() { node_->finish(); }
  NodeBench(const NodeBench&) = delete;
  NodeBench& operator=(const NodeBench&) = delete;
  /// For the next job only.
  void latch(Kind kind, Chunk& chunk, int64_t stamp_ns) {
    for (InputPort* port : node_->inputs()) {
      if (port->name() != info_of(kind).name) continue;
      PortAccess::held(*port)[0] = {chunk.header(), ++latched_, stamp_ns, 0, 0};
      PortAccess::set_held(*port, 1, false, latched_ - 1);
    }
  }
  void run() {
    for (OutputPort* port : node_->outputs()) PortAccess::reset(*port);
    Job job(clock_, jobs_++, clock_.now_ns(), clock_.now_ns() + kLinkPeriod_ns, 0, "full");
    node_->run(job);
    for (InputPort* port : node_->inputs()) PortAccess::set_held(*port, 0, false, latched_);
    if (job.source_report()) state_ = job.source_report()->state;
  }
  /// What the last job sent there; null if nothing.
  template <class T>
  const T* sent(std::string_view name) const {
    const OutputPort* port = output(name);
    if (!PortAccess::sent(*port)) return nullptr;
    for (const auto& writer : writers_)
      if (&writer->port == port) return reinterpret_cast<const T*>(writer->memory.get() + sizeof(MessageHeader));
    return nullptr;
  }
  int64_t stamp_ns(std::string_view name) const { return PortAccess::stamp_ns(*output(name)); }
  std::string line() const {
    const auto* text = sent<TextStatus>("link");
    return text == nullptr ? "" : std::string(text->text.data(), text->text.size);
  }
  SourceState state() const { return state_; }

 private:
  struct ChunkWriter final : Writer {
    explicit ChunkWriter(OutputPort& output)
        : port(output), memory(aligned_bytes(sizeof(MessageHeader) + output.type().bytes(output.capacity()))) {
      PortAccess::attach(port, this);
      PortAccess::mark_read(port);
    }
    MessageHeader* loan() override {
      auto* header = ::new (memory.get()) MessageHeader;
      port.type().place(header + 1, port.capacity());
      return header;
    }
    void publish(int64_t, int64_t, int64_t) override {}
    void discard() override {}
    bool repeat(int64_t, int64_t) override { return false; }
    WriterStatistics statistics() const override { return {}; }
    OutputPort& port;
    AlignedBytes memory;
  };
  OutputPort* output(std::string_view name) const {
    for (OutputPort* port : node_->outputs())
      if (port->name() == name) return port;
    FAIL("no output " << name);
    return nullptr;
  }

  std::unique_ptr<DeviceNode> node_;
  const VirtualClock& clock_;
  std::vector<std::unique_ptr<ChunkWriter>> writers_;
  uint64_t jobs_ = 0, latched_ = 0;
  SourceState state_ = SourceState::unattended;
};

/// What feeds the service. It is told the instant of a job and what the client wants; messages go to `give`.
class Feed {
 public:
  using Give = std::function<void(Kind kind, Chunk& chunk, int64_t stamp_ns)>;
  virtual ~Feed() = default;
  virtual void job(int64_t now_ns, const VelocityCommand& wanted, const Give& give) = 0;
};

class LinkRig {
 public:
  LinkRig(Line line, const Impairment& impairment, Feed& feed)
      : line_(std::move(line)), impairment_(impairment), feed_(feed) {
    start_service();
    start_client("ace");
  }
  void start_service() {
    service_.reset();
    auto end = std::make_unique<semantic_link::Server>(port(line_.server(), to_client_, to_server_, service_clock_),
                                                       semantic_link::Key{}, service_clock_);
    server_ = end.get();
    auto& exchange = *end->add_robot("ace");
    service_ = bench<semantic_link::ServiceNode>(std::move(end), exchange, service_clock_);
  }
  void start_client(const char* robot) {
    client_.reset();
    auto end = std::make_unique<semantic_link::Client>(port(line_.client(), to_server_, to_client_, client_clock_),
                                                       semantic_link::Key{}, robot, client_clock_);
    client_end_ = end.get();
    auto& exchange = end->exchange();
    client_ = bench<semantic_link::ClientNode>(std::move(end), exchange, client_clock_);
  }
  /// Jobs of both, of the client only while it `lives`. `in_client` may latch what the client is to say.
  void run_for(int64_t ns, bool lives = true, const std::function<void(NodeBench&)>& in_client = {}) {
    for (const int64_t end_ns = now_ns() + ns; now_ns() < end_ns;) {
      service_clock_.advance_to(now_ns() + kLinkPeriod_ns);
      client_clock_.advance_to(now_ns() + kAhead_ns);
      feed_.job(now_ns(), wanted_, [&](Kind kind, Chunk& chunk, int64_t stamp_ns) {
        given[kind].push_back({stamp_ns, chunk.bytes()});
        service_->latch(kind, chunk, stamp_ns);
      });
      service_->run();
      if (const auto* velocity = service_->sent<VelocityCommand>("velocity"))
        wanted_.speed_m_s = velocity->speed_m_s, wanted_.turn_rad_s = velocity->turn_rad_s;
      settle(lives);
      if (!lives) continue;
      if (in_client) in_client(*client_);
      client_->run();
      take(*service_, semantic_link::Way::to_server);
      take(*client_, semantic_link::Way::to_client);
      settle(lives);
    }
  }
  int64_t now_ns() const { return service_clock_.now_ns(); }
  double commanded_m_s() const { return wanted_.speed_m_s; }
  bool attached() const { return service_->line().starts_with("attached") && client_->line().starts_with("attached"); }
  const NodeBench& service() const { return *service_; }
  const NodeBench& client() const { return *client_; }

  std::map<Kind, std::vector<Passed>> given, received;

 private:
  std::unique_ptr<DatagramPort> port(std::unique_ptr<DatagramPort> line, Traffic& out, Traffic& in,
                                     const Clock& clock) {
    to_client_ = to_server_ = {};  // what was under way to the end that was there before is gone
    ++impairment_.seed;
    return std::make_unique<ImpairedPort>(std::make_unique<CountedPort>(std::move(line), out, in), impairment_, clock);
  }
  template <class NodeClass>
  static std::unique_ptr<NodeBench> bench(std::unique_ptr<semantic_link::LinkEnd> end,
                                          semantic_link::Exchange& exchange, const VirtualClock& clock) {
    auto runner = std::make_shared<semantic_link::LinkRunner>("test", std::move(end), clock);
    return std::make_unique<NodeBench>(
        std::make_unique<NodeClass>(std::make_unique<semantic_link::LinkDevice>(std::move(runner), exchange),
                                    300 * kMs),
        clock);
  }
  void take(const NodeBench& bench, semantic_link::Way way) {
    for (const MessageKind& info : semantic_link::message_kinds()) {
      if (info.way != way || info.kind == Kind::velocity) continue;
      const void* message = bench.sent<std::byte>(info.name);
      if (message == nullptr) continue;
      std::vector<std::byte> bytes;
      REQUIRE(semantic_link::write_message(info, message, bytes));
      received[info.kind].push_back({bench.stamp_ns(info.name), bytes});
    }
  }
  /// A line of the kernel or of a bus takes a moment from end to end: both ends listen until it is over. What was sent
  /// to an end that is gone never arrives.
  void settle(bool lives) {
    const auto arrived = [&] { return to_server_.arrived + to_client_.arrived; };
    const auto under_way = [&] {
      return to_server_.arrived < to_server_.sent || (lives && to_client_.arrived < to_client_.sent);
    };
    uint64_t before = arrived();
    for (int idle_ms = 0; under_way(); before = arrived()) {
      server_->step();
      if (lives) client_end_->step();
      if (line_.instant && arrived() == before) return;
      if (arrived() != before) idle_ms = 0;
      else if (poll(nullptr, 0, 1), ++idle_ms == 50) to_server_ = to_client_ = {};
    }
  }

  Line line_;
  Impairment impairment_;
  Feed& feed_;
  VirtualClock service_clock_{7'000'000'000}, client_clock_{7'000'000'000 + kAhead_ns};
  Traffic to_server_, to_client_;
  semantic_link::LinkEnd *server_ = nullptr, *client_end_ = nullptr;
  std::unique_ptr<NodeBench> service_, client_;
  VelocityCommand wanted_;
};

}  // namespace takt::test
