// SPDX-License-Identifier: Apache-2.0
// A scan of 181 beams from a job of the server to a job of the client on one machine: over UDP, over the session bus
// (where there is one), and as many bytes through a bare UDP socket to a thread that waits in recv (reference). All
// take turns message by message, in an order drawn anew; whoever waits for the message looks for it without sleeping.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <functional>
#include <memory>
#include <random>
#include <thread>

#include "bench/instants.hpp"
#include "bench/suite.hpp"
#include "hal/semantic_link/client.hpp"
#include "hal/semantic_link/dbus_port.hpp"
#include "hal/semantic_link/link_device.hpp"
#include "hal/semantic_link/server.hpp"
#include "hal/semantic_link/udp_port.hpp"
#include "rt/msg/laser_scan.hpp"

namespace takt::bench {

std::vector<Row> run_semantic_link(const Options& options);

namespace {

using namespace semantic_link;

constexpr int kPerRound = 100;
constexpr int64_t kStep_ns = 5'000'000, kLongest_ns = 1'000'000'000;

/// Looks until `arrived`, for a second at most; us since `begin_ns`.
template <class Arrived>
double wait_for(int64_t begin_ns, const Arrived& arrived) {
  while (!arrived())
    if (now_ns() - begin_ns > kLongest_ns) throw CannotRun("semantic_link: a message did not arrive within a second");
  return static_cast<double>(now_ns() - begin_ns) * 1e-3;
}

class Contestant {
 public:
  explicit Contestant(std::string contestants_name) : name(std::move(contestants_name)) {}
  Contestant(const Contestant&) = delete;
  Contestant& operator=(const Contestant&) = delete;
  virtual ~Contestant() = default;
  /// us
  virtual double hop() = 0;
  const std::string name;
  Samples samples;
};

class BareSocket final : public Contestant {
 public:
  explicit BareSocket(size_t bytes) : Contestant("bare_socket"), bytes_(bytes) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* raw = reinterpret_cast<sockaddr*>(&address);
    if (bind(in_, raw, size) != 0 || getsockname(in_, raw, &size) != 0 || connect(out_, raw, size) != 0)
      throw CannotRun("semantic_link: no UDP socket on the loopback");
    thread_ = std::thread([this] {
      std::vector<uint8_t> into(2000);
      while (recv(in_, into.data(), into.size(), 0) > 1) arrived_.fetch_add(1);
    });
  }
  ~BareSocket() override {
    const uint8_t end = 0;
    static_cast<void>(!send(out_, &end, 1, 0));
    thread_.join();
    close(in_);
    close(out_);
  }
  double hop() override {
    const int64_t begin = now_ns();
    static_cast<void>(!send(out_, bytes_.data(), bytes_.size(), 0));
    ++sent_;
    return wait_for(begin, [&] { return arrived_.load() >= sent_; });
  }

 private:
  std::vector<uint8_t> bytes_;
  int in_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), out_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  uint64_t sent_ = 0;
  std::atomic<uint64_t> arrived_{0};
  std::thread thread_;
};

class Link final : public Contestant {
 public:
  Link(const std::string& contestants_name, std::unique_ptr<DatagramPort> server_port,
       const std::function<std::unique_ptr<DatagramPort>()>& client_port)
      : Contestant(contestants_name), scan_(info_of(Kind::scan)) {
    scan_.as<LaserScan>().range_m.resize(181);
    auto server = std::make_unique<Server>(std::move(server_port), Key{}, clock_);
    Exchange& exchange = *server->add_robot("ace");
    service_ =
        std::make_unique<LinkDevice>(std::make_shared<LinkRunner>("server", std::move(server), clock_), exchange);
    if (const auto opened = service_->open(); !opened) throw CannotRun(opened.error().text());
    auto client = std::make_unique<Client>(client_port(), Key{}, "ace", clock_);
    Exchange& others = client->exchange();
    link_ = std::make_unique<LinkDevice>(std::make_shared<LinkRunner>("client", std::move(client), clock_), others);
    for (LinkDevice* device : {service_.get(), link_.get()})
      if (const auto started = device->start(0); !started) throw CannotRun(started.error().text());
    wait_for(now_ns(), [&] {
      service_->read(), link_->read();
      return service_->attached() && link_->attached();
    });
    sleep_until(now_ns() + 2 * kAlive_ns);  // the clocks are known at both ends
  }
  double hop() override {
    const int64_t begin = now_ns();
    service_->give(Kind::scan, scan_.get(), begin);
    service_->flush();
    return wait_for(begin, [&] { return link_->take(Kind::scan) != nullptr; });
  }

 private:
  MonotonicClock clock_;
  Placed scan_;
  std::unique_ptr<LinkDevice> service_, link_;
};

std::unique_ptr<Link> udp() {
  auto port = UdpPort::of_server("server", {});
  if (const auto opened = port->open(); !opened) throw CannotRun(opened.error().text());
  const UdpAddress address = port->address();
  return std::make_unique<Link>("udp", std::move(port), [&] { return UdpPort::of_client("client", address); });
}

std::unique_ptr<Link> dbus() {
  const DbusAddress address{"session", "io.takt.bench" + std::to_string(getpid())};
  return std::make_unique<Link>("dbus", DbusPort::of_server("server", address),
                                [&] { return DbusPort::of_client("client", address); });
}

}  // namespace

std::vector<Row> run_semantic_link(const Options& options) {
  std::vector<std::unique_ptr<Contestant>> all;
  all.push_back(std::make_unique<BareSocket>(most_bytes(info_of(Kind::odometry)) + 4 * 181 + kOverhead));
  all.push_back(udp());
  std::string no_bus;
  try {
    all.push_back(dbus());
  } catch (const CannotRun& why) {
    no_bus = why.what();
    std::fprintf(stderr, "without D-Bus (dbus-run-session -- takt bench semantic_link brings one): %s\n", why.what());
  }
  std::vector<Pairs> pairs(all.size());
  std::vector<size_t> order(all.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937 random(1);
  for (int round = 0; round < options.rounds_or(40); ++round) {
    std::vector<Samples> here(all.size());
    for (int i = 0; i < kPerRound; ++i) {
      std::shuffle(order.begin(), order.end(), random);
      for (const size_t c : order) {
        sleep_until(now_ns() + kStep_ns);
        here[c].add(all[c]->hop());
      }
    }
    for (size_t c = 0; c < all.size(); ++c) {
      all[c]->samples.add(here[c].values());
      pairs[c].add_a(*here[0].quantile(0.5));
      pairs[c].add_b(*here[c].quantile(0.5));
    }
  }
  std::vector<Row> rows;
  for (size_t c = 0; c < all.size(); ++c) {
    Row row{"semantic_link/scan/" + all[c]->name,
            "us",
            *all[c]->samples.quantile(0.5),
            all[c]->samples,
            {},
            {},
            {},
            "ordinary threads"};
    if (c == 0) rows.push_back(std::move(row));
    else add_pair(rows, std::move(row), "bare_socket", pairs[c]);
  }
  if (!no_bus.empty()) rows.push_back({"semantic_link/scan/dbus", "us", 0, {}, {}, {}, {}, no_bus});
  return rows;
}

}  // namespace takt::bench
