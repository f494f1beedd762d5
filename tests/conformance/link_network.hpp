// SPDX-License-Identifier: Apache-2.0
// Ports for the semantic link without sockets, and what networks do to datagrams.
#pragma once
#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "hal/semantic_link/datagram_port.hpp"
#include "rt/time/clock.hpp"

namespace takt::test {

using semantic_link::Arrival, semantic_link::DatagramPort, semantic_link::Peer;
using Bytes = std::vector<uint8_t>;

/// Carries what is sent at once, in order, once. Peer 1 is the server.
class MemoryNetwork {
 public:
  static constexpr Peer kServer = static_cast<Peer>(1);
  struct Sent {
    Peer from, to;
    Bytes bytes;
  };
  /// Everything that was sent, for who wants to send it again.
  std::vector<Sent> history;
  size_t largest = 1400;

  std::unique_ptr<DatagramPort> server() { return std::make_unique<Port>(*this, kServer); }
  std::unique_ptr<DatagramPort> client() { return std::make_unique<Port>(*this, static_cast<Peer>(next_peer_++)); }
  void deliver(Peer from, Peer to, const Bytes& bytes) { boxes_[to].push_back({from, to, bytes}); }

 private:
  class Port final : public DatagramPort {
   public:
    Port(MemoryNetwork& network, Peer self) : network_(network), self_(self) {}
    DeviceResult open() override {
      network_.boxes_[self_].clear();
      return {};
    }
    void close() override { network_.boxes_.erase(self_); }
    Arrival receive(std::span<uint8_t> into) override {
      auto& box = network_.boxes_[self_];
      if (box.empty()) return {};
      const Sent sent = std::move(box.front());
      box.pop_front();
      std::copy_n(sent.bytes.begin(), std::min(sent.bytes.size(), into.size()), into.begin());
      return {Arrival::What::datagram, sent.bytes.size(), sent.from};
    }
    void send(Peer to, std::span<const uint8_t> bytes) override {
      const Peer there = to == Peer::server ? kServer : to;
      network_.history.push_back({self_, there, Bytes(bytes.begin(), bytes.end())});
      if (network_.boxes_.contains(there)) network_.deliver(self_, there, network_.history.back().bytes);
    }
    size_t largest() const override { return network_.largest; }
    pollfd wait() const override { return {-1, 0, 0}; }

   private:
    MemoryNetwork& network_;
    Peer self_;
  };
  std::map<Peer, std::deque<Sent>> boxes_;
  uint64_t next_peer_ = 2;
};

struct Impairment {
  double loss = 0, duplicate = 0;
  int64_t most_delay_ns = 0;  ///< each datagram's own, so that one overtakes another
  uint64_t seed = 1;
};

/// Loses, doubles and delays what goes out, by its clock.
class ImpairedPort final : public DatagramPort {
 public:
  ImpairedPort(std::unique_ptr<DatagramPort> inner, const Impairment& impairment, const Clock& clock)
      : inner_(std::move(inner)), impairment_(impairment), clock_(clock), random_(impairment.seed) {}
  DeviceResult open() override { return inner_->open(); }
  void close() override { inner_->close(); }
  Arrival receive(std::span<uint8_t> into) override {
    pass_on();
    return inner_->receive(into);
  }
  void send(Peer to, std::span<const uint8_t> bytes) override {
    std::uniform_real_distribution<double> chance(0, 1);
    const int copies = chance(random_) < impairment_.duplicate ? 2 : 1;
    for (int i = 0; i < copies; ++i) {
      const double delay = chance(random_) * static_cast<double>(impairment_.most_delay_ns);
      if (chance(random_) >= impairment_.loss)
        waiting_.insert({clock_.now_ns() + static_cast<int64_t>(delay), {to, Bytes(bytes.begin(), bytes.end())}});
    }
    pass_on();
  }
  size_t largest() const override { return inner_->largest(); }
  pollfd wait() const override { return inner_->wait(); }

 private:
  void pass_on() {
    while (!waiting_.empty() && waiting_.begin()->first <= clock_.now_ns()) {
      inner_->send(waiting_.begin()->second.first, waiting_.begin()->second.second);
      waiting_.erase(waiting_.begin());
    }
  }
  std::unique_ptr<DatagramPort> inner_;
  Impairment impairment_;
  const Clock& clock_;
  std::mt19937_64 random_;
  std::multimap<int64_t, std::pair<Peer, Bytes>> waiting_;
};

/// What has gone one way.
struct Traffic {
  uint64_t sent = 0, arrived = 0;
};

/// Counts what goes through a port of the kernel or of a bus, which takes a moment.
class CountedPort final : public DatagramPort {
 public:
  CountedPort(std::unique_ptr<DatagramPort> inner, Traffic& out, Traffic& in)
      : inner_(std::move(inner)), out_(out), in_(in) {}
  DeviceResult open() override { return inner_->open(); }
  void close() override { inner_->close(); }
  Arrival receive(std::span<uint8_t> into) override {
    const Arrival arrival = inner_->receive(into);
    in_.arrived += arrival.what == Arrival::What::datagram ? 1 : 0;
    return arrival;
  }
  void send(Peer to, std::span<const uint8_t> bytes) override {
    ++out_.sent;
    inner_->send(to, bytes);
  }
  size_t largest() const override { return inner_->largest(); }
  pollfd wait() const override { return inner_->wait(); }

 private:
  std::unique_ptr<DatagramPort> inner_;
  Traffic &out_, &in_;
};

}  // namespace takt::test
