// SPDX-License-Identifier: Apache-2.0
// Both ends on their threads and the real clock, over the loopback. Nothing here judges a time; what must come is
// waited for, however long the machine takes.
#include <doctest/doctest.h>
#include <poll.h>

#include "hal/semantic_link/client.hpp"
#include "hal/semantic_link/link_device.hpp"
#include "hal/semantic_link/server.hpp"
#include "hal/semantic_link/udp_port.hpp"
#include "rt/msg/laser_scan.hpp"
#include "tests/conformance/link_messages.hpp"

using namespace takt;
using namespace takt::semantic_link;

namespace {

template <class Done>
bool wait_until(const Done& done) {
  for (int tries = 0; tries < 20'000; ++tries) {
    if (done()) return true;
    poll(nullptr, 0, 1);
  }
  return false;
}

}  // namespace

TEST_CASE("two robots share a server's thread; messages pass between threads, and a leave is heard at once") {
  const MonotonicClock clock;
  auto port = UdpPort::of_server("service", {});
  REQUIRE(port->open().has_value());
  const UdpAddress address = port->address();
  auto server = std::make_unique<Server>(std::move(port), Key{}, clock);
  Exchange *ace = server->add_robot("ace"), *eve = server->add_robot("eve");
  const auto runner = std::make_shared<LinkRunner>("service", std::move(server), clock);
  LinkDevice ace_device(runner, *ace), eve_device(runner, *eve);
  auto client = std::make_unique<Client>(UdpPort::of_client("link", address), Key{}, "eve", clock);
  Exchange& exchange = client->exchange();
  LinkDevice link(std::make_shared<LinkRunner>("link", std::move(client), clock), exchange);
  for (LinkDevice* device : {&ace_device, &eve_device, &link}) {
    REQUIRE(device->open().has_value());
    REQUIRE(device->start(0).has_value());
  }
  const auto attached = [](LinkDevice& device) {
    device.read();
    return device.attached();
  };
  REQUIRE(wait_until([&] { return attached(eve_device) && attached(link); }));
  CHECK_FALSE(attached(ace_device));
  Placed scan(info_of(Kind::scan)), task(info_of(Kind::task));
  uint32_t number = 0;
  const Parcel* parcel = nullptr;
  CHECK(wait_until([&] {  // the client may know no common time yet: then one is not enough
    test::fill(Kind::scan, ++number, scan.get());
    eve_device.give(Kind::scan, scan.get(), clock.now_ns());
    eve_device.flush();
    return (parcel = link.take(Kind::scan)) != nullptr;
  }));
  REQUIRE(parcel != nullptr);
  Placed came(info_of(Kind::scan));
  REQUIRE(LinkDevice::unpack(Kind::scan, *parcel, came.get()));
  CHECK(came.as<LaserScan>().scan_number <= number);
  CHECK(came.as<LaserScan>().range_m.size == 181);
  CHECK(parcel->stamp_ns <= clock.now_ns());
  test::fill(Kind::task, 4, task.get());
  link.give(Kind::task, task.get(), clock.now_ns());
  link.flush();
  CHECK(wait_until([&] { return eve_device.take(Kind::task) != nullptr; }));  // a task lasts: it is said again
  link.stop();
  CHECK(wait_until([&] { return !attached(eve_device); }));
  std::array<char, 400> text;
  const std::string line(text.data(), eve_device.describe(text));
  CHECK(line.starts_with("not attached: no client; sent "));
}

TEST_CASE("a port that is taken is a failing device, and is opened by the thread once it is free") {
  const MonotonicClock clock;
  auto first = UdpPort::of_server("first", {});
  REQUIRE(first->open().has_value());
  const UdpAddress address = first->address();
  auto server = std::make_unique<Server>(UdpPort::of_server("second", address), Key{}, clock);
  Exchange* ace = server->add_robot("ace");
  LinkDevice device(std::make_shared<LinkRunner>("second", std::move(server), clock), *ace);
  const auto opened = device.open();
  REQUIRE_FALSE(opened.has_value());
  CHECK_FALSE(opened.error().bad_input);
  CHECK(opened.error().text().find(address.text()) != std::string::npos);
  CHECK_FALSE(device.start(0).has_value());
  CHECK(device.read() == ReadStatus::disconnected);
  CHECK_FALSE(device.restart(0));
  first->close();
  CHECK(wait_until([&] { return device.restart(0); }));
  CHECK(device.read() != ReadStatus::disconnected);
}
