// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/way.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <map>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "rt/time/clock.hpp"

namespace takt::machines {
namespace {

constexpr uint32_t kWayMark = 0x31775454;  // "TTw1"
constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSmallFor_ns = 4000 * kMs, kTrainsFor_ns = 2000 * kMs, kLinger_ns = 1000 * kMs;
constexpr int64_t kSmallEvery_ns = 5 * kMs, kTrainEvery_ns = 50 * kMs, kAskEvery_ns = 100 * kMs;
constexpr int kTrain = 64, kTrainBytes = 1400, kEnoughOfTrain = kTrain / 2;
constexpr int64_t kDriftFor_s = 1;  ///< so old may the newest exchange of two machines of a graph be

enum WayKind : uint32_t { ask, small, back, train };

/// Both ends have the same byte order, as all machines that Takt runs on.
struct WayPacket {
  uint32_t magic = kWayMark, kind = ask, number = 0, received_kbit_s = 0;
  int64_t sent_ns = 0, received_there_ns = 0, sent_there_ns = 0;
};

class WaySocket {
 public:
  explicit WaySocket(const WayOptions& options) {
    sockaddr_storage own{}, peer{};
    const socklen_t size = addresses(options, own, peer);
    descriptor_ = socket(peer.ss_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const int room = 4 << 20;
    setsockopt(descriptor_, SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
    if (bind(descriptor_, reinterpret_cast<const sockaddr*>(&own), size) != 0)
      fail(fmt::format("port {} cannot be used: {}; give another --port, the same on both machines", options.port,
                       std::strerror(errno)));
    if (connect(descriptor_, reinterpret_cast<const sockaddr*>(&peer), size) != 0)
      fail(fmt::format("there is no way to {}: {}", options.address, std::strerror(errno)));
    six_ = peer.ss_family == AF_INET6;
  }
  ~WaySocket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  WaySocket(const WaySocket&) = delete;
  WaySocket& operator=(const WaySocket&) = delete;

  /// What cannot be sent is lost: nobody may listen there yet.
  void send(const WayPacket& packet, size_t bytes = sizeof(WayPacket)) const {
    std::array<std::byte, kTrainBytes> all{};
    std::memcpy(all.data(), &packet, sizeof packet);
    static_cast<void>(::send(descriptor_, all.data(), bytes, 0));
  }
  std::optional<WayPacket> receive(int64_t patience_ns) const {
    pollfd wait{descriptor_, POLLIN, 0};
    const timespec patience{patience_ns / 1'000'000'000, patience_ns % 1'000'000'000};
    if (ppoll(&wait, 1, &patience, nullptr) <= 0) return std::nullopt;
    std::array<std::byte, kTrainBytes> all;
    const ssize_t got = recv(descriptor_, all.data(), all.size(), MSG_DONTWAIT);
    WayPacket packet;
    if (got < static_cast<ssize_t>(sizeof packet)) return std::nullopt;
    std::memcpy(&packet, all.data(), sizeof packet);
    return packet.magic == kWayMark ? std::optional(packet) : std::nullopt;
  }
  int mtu() const {
    int bytes = 0;
    socklen_t size = sizeof bytes;
    getsockopt(descriptor_, six_ ? IPPROTO_IPV6 : IPPROTO_IP, six_ ? 24 /* IPV6_MTU */ : 14 /* IP_MTU */, &bytes,
               &size);
    return bytes;
  }

 private:
  [[noreturn]] void fail(const std::string& why) {
    close(std::exchange(descriptor_, -1));
    throw std::runtime_error(why);
  }
  static socklen_t addresses(const WayOptions& options, sockaddr_storage& own, sockaddr_storage& peer) {
    auto& four = reinterpret_cast<sockaddr_in&>(peer);
    if (inet_pton(AF_INET, options.address.c_str(), &four.sin_addr) == 1) {
      four.sin_family = own.ss_family = AF_INET;
      four.sin_port = reinterpret_cast<sockaddr_in&>(own).sin_port = htons(options.port);
      return sizeof four;
    }
    auto& six = reinterpret_cast<sockaddr_in6&>(peer);
    if (inet_pton(AF_INET6, options.address.c_str(), &six.sin6_addr) != 1)
      throw std::runtime_error(
          fmt::format("`{}` is no IP address; give the one of the other machine, such as 10.0.0.2", options.address));
    six.sin6_family = own.ss_family = AF_INET6;
    six.sin6_port = reinterpret_cast<sockaddr_in6&>(own).sin6_port = htons(options.port);
    return sizeof six;
  }

  int descriptor_ = -1;
  bool six_ = false;
};

class Measurement {
 public:
  explicit Measurement(const WayOptions& options) : options_(options), socket_(options) {}

  Way measure() {
    meet();
    const int64_t begin = clock_.now_ns();
    while (clock_.now_ns() < begin + kSmallFor_ns) send_small(), take_until(clock_.now_ns() + kSmallEvery_ns);
    const Way so_far = small_ones();
    while (clock_.now_ns() < begin + kSmallFor_ns + kTrainsFor_ns)
      send_train(), take_until(clock_.now_ns() + kTrainEvery_ns);
    // The other one may be a little behind, and learns here how its trains arrived.
    for (const int64_t end = clock_.now_ns() + kLinger_ns; clock_.now_ns() < end;
         take_until(clock_.now_ns() + kAskEvery_ns))
      socket_.send(packet(ask));
    Way way = so_far;
    way.receives_mbit_s = received_mbit_s();
    if (sent_kbit_s_ > 0) way.sends_mbit_s = sent_kbit_s_ / 1e3;
    way.mtu = socket_.mtu();
    return way;
  }

 private:
  struct Arriving {
    int64_t first_ns = 0, last_ns = 0;
    int count = 0;
  };

  void meet() {
    for (const int64_t until = clock_.now_ns() + options_.patience_ns; !heard_;
         take_until(clock_.now_ns() + kAskEvery_ns)) {
      if (clock_.now_ns() > until)
        throw std::runtime_error(
            fmt::format("{} does not answer; run `takt doctor --measure --peer` there at the same "
                        "time, with the address of this machine, and let UDP port {} through",
                        options_.address, options_.port));
      socket_.send(packet(ask));
    }
    socket_.send(packet(ask));
  }

  WayPacket packet(WayKind kind, uint32_t number = 0) const {
    WayPacket made;
    made.kind = kind, made.number = number, made.sent_ns = clock_.now_ns();
    made.received_kbit_s = static_cast<uint32_t>(received_mbit_s().value_or(0) * 1e3);
    return made;
  }
  void send_small() { socket_.send(packet(small, ++asked_)); }
  void send_train() {
    ++trains_;
    for (int i = 0; i < kTrain; ++i) socket_.send(packet(train, trains_), kTrainBytes);
  }

  void take_until(int64_t until_ns) {
    for (int64_t now = clock_.now_ns(); now < until_ns; now = clock_.now_ns())
      if (const auto came = socket_.receive(until_ns - now)) take(*came, clock_.now_ns());
  }
  void take(const WayPacket& came, int64_t now_ns) {
    heard_ = true;
    if (came.received_kbit_s > 0) sent_kbit_s_ = came.received_kbit_s;
    if (came.kind == small) {
      WayPacket answer = came;
      answer.kind = back, answer.received_there_ns = now_ns, answer.sent_there_ns = clock_.now_ns();
      socket_.send(answer);
    } else if (came.kind == back) {
      times_ns_.push_back((now_ns - came.sent_ns) - (came.sent_there_ns - came.received_there_ns));
      pair_.add({came.sent_ns, came.received_there_ns, came.sent_there_ns, now_ns});
    } else if (came.kind == train) {
      Arriving& one = arriving_[came.number];
      if (one.count++ == 0) one.first_ns = now_ns;
      one.last_ns = now_ns;
    }
  }

  Way small_ones() const {
    Way way;
    way.there_and_back = machine::Spread::of(times_ns_);
    way.lost = static_cast<int64_t>(asked_) - way.there_and_back.samples;
    if (const auto offset = pair_.offset(clock_.now_ns())) way.clock = *offset;
    return way;
  }
  /// The median: some trains wait for others.
  std::optional<double> received_mbit_s() const {
    std::vector<double> all;
    for (const auto& [number, one] : arriving_)
      if (one.count >= kEnoughOfTrain && one.last_ns > one.first_ns)
        all.push_back(train_mbit_s(one.count, kTrainBytes, one.last_ns - one.first_ns));
    if (all.empty()) return std::nullopt;
    const auto middle = all.begin() + static_cast<ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    return *middle;
  }

  const WayOptions options_;
  const WaySocket socket_;
  const MonotonicClock clock_;
  bool heard_ = false;
  uint32_t asked_ = 0, trains_ = 0, sent_kbit_s_ = 0;
  std::vector<int64_t> times_ns_;
  ClockPair pair_;
  std::map<uint32_t, Arriving> arriving_;
};

int64_t ms_above(double us) { return std::max<int64_t>(1, static_cast<int64_t>(std::ceil(us / 1e3))); }

}  // namespace

Way measure_way(const WayOptions& options) { return Measurement(options).measure(); }

double train_mbit_s(int count, int bytes, int64_t took_ns) {
  return 8e3 * static_cast<double>(count - 1) * bytes / static_cast<double>(took_ns);
}

std::string network_line(const Way& way) {
  const double error_us = static_cast<double>(way.clock.error_ns) / 1e3 + ClockPair::kDrift_ppm * kDriftFor_s;
  std::string line = fmt::format("network: {{latency: {}ms, clock_error: {}ms", ms_above(way.there_and_back.max_us),
                                 ms_above(error_us));
  if (way.sends_mbit_s && way.receives_mbit_s)
    line += fmt::format(", bandwidth: {}Mbit",
                        std::max<int64_t>(1, static_cast<int64_t>(std::min(*way.sends_mbit_s, *way.receives_mbit_s))));
  return line + "}";
}

}  // namespace takt::machines
