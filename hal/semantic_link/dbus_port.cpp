// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/dbus_port.hpp"

#include <sdbus-c++/sdbus-c++.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>
#include <deque>
#include <map>
#include <vector>

namespace takt::semantic_link {
namespace {

constexpr const char *kPath = "/io/takt/semantic_link", *kInterface = "io.takt.SemanticLink", *kMethod = "Datagram";
constexpr size_t kMostPeers = 64;  // whose proxies are kept
constexpr Peer kNobody = static_cast<Peer>(UINT64_MAX);

/// ":1.42", as busses name their connections.
Peer peer_of(std::string_view sender) {
  uint32_t high = 0, low = 0;
  const char *at = sender.data(), *end = at + sender.size();
  if (at == end || *at != ':') return kNobody;
  const auto first = std::from_chars(at + 1, end, high);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '.') return kNobody;
  const auto second = std::from_chars(first.ptr + 1, end, low);
  if (second.ec != std::errc() || second.ptr != end) return kNobody;
  return static_cast<Peer>(uint64_t{high} << 32 | low);
}

std::string name_of(Peer peer) {
  const auto number = static_cast<uint64_t>(peer);
  return ":" + std::to_string(number >> 32) + "." + std::to_string(number & UINT32_MAX);
}

std::unique_ptr<sdbus::IConnection> connect(const std::string& bus) {
  if (bus == "session") return sdbus::createSessionBusConnection();
  if (bus == "system") return sdbus::createSystemBusConnection();
  return sdbus::createSessionBusConnectionWithAddress(bus);
}

}  // namespace

bool valid(const DbusAddress& address) {
  const std::string& name = address.service;
  const bool characters = std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
  });
  const bool words = !name.empty() && name.front() != '.' && name.back() != '.' &&
                     name.find("..") == std::string::npos && name.find('.') != std::string::npos && name.size() <= 255;
  return characters && words &&
         (address.bus == "session" || address.bus == "system" || address.bus.find('=') != std::string::npos);
}

struct DbusPort::Bus {
  struct Datagram {
    Peer from;
    uint32_t size;
    std::vector<uint64_t> words;
  };
  std::unique_ptr<sdbus::IConnection> connection;
  std::unique_ptr<sdbus::IObject> object;
  std::map<Peer, std::unique_ptr<sdbus::IProxy>> proxies;
  std::deque<Datagram> arrived;

  sdbus::IProxy& proxy(Peer peer, const std::string& service) {
    if (proxies.size() >= kMostPeers && !proxies.contains(peer)) proxies.clear();
    auto& slot = proxies[peer];
    if (!slot) slot = sdbus::createProxy(*connection, peer == Peer::server ? service : name_of(peer), kPath);
    return *slot;
  }
};

DbusPort::DbusPort(std::string id, DbusAddress address, bool server)
    : id_(std::move(id)), address_(std::move(address)), server_(server) {}
DbusPort::~DbusPort() = default;

std::unique_ptr<DbusPort> DbusPort::of_server(std::string id, DbusAddress address) {
  return std::unique_ptr<DbusPort>(new DbusPort(std::move(id), std::move(address), true));
}
std::unique_ptr<DbusPort> DbusPort::of_client(std::string id, DbusAddress address) {
  return std::unique_ptr<DbusPort>(new DbusPort(std::move(id), std::move(address), false));
}

DeviceResult DbusPort::open() {
  if (bus_) return {};
  auto bus = std::make_unique<Bus>();
  try {
    bus->connection = connect(address_.bus);
  } catch (const sdbus::Error& error) {
    return device_failure(
        id_, "bus `" + address_.bus + "`: " + error.getMessage(),
        "start one (`dbus-run-session -- takt run ...`), name another with `bus`, or use driver: udp");
  }
  try {
    bus->object = sdbus::createObject(*bus->connection, kPath);
    // Words of eight bytes, as the library writes an array element by element.
    bus->object->registerMethod(
        kInterface, kMethod, "uat", "",
        [&arrived = bus->arrived](sdbus::MethodCall call) {
          Bus::Datagram& datagram = arrived.emplace_back();
          call >> datagram.size >> datagram.words;
          datagram.from = peer_of(call.getSender());
        },
        [] {
          sdbus::Flags flags;
          flags.set(sdbus::Flags::METHOD_NO_REPLY);
          return flags;
        }());
    bus->object->finishRegistration();
    if (server_) bus->connection->requestName(address_.service);
  } catch (const sdbus::Error& error) {
    return device_failure(id_, "bus `" + address_.bus + "`, name " + address_.service + ": " + error.getMessage(),
                          "is the name taken (`busctl list`), or not allowed to this user on this bus?");
  }
  bus_ = std::move(bus);
  return {};
}

void DbusPort::close() { bus_.reset(); }

Arrival DbusPort::receive(std::span<uint8_t> into) {
  if (!bus_) return {Arrival::What::gone, 0, {}};
  try {
    while (bus_->arrived.empty())
      if (!bus_->connection->processPendingRequest()) return {};
  } catch (const sdbus::Error&) {
    return {Arrival::What::gone, 0, {}};
  }
  const Bus::Datagram datagram = std::move(bus_->arrived.front());
  bus_->arrived.pop_front();
  const size_t size = std::min<size_t>(datagram.size, datagram.words.size() * sizeof(uint64_t));
  if (size > 0) std::memcpy(into.data(), datagram.words.data(), std::min(size, into.size()));
  return {Arrival::What::datagram, size, datagram.from};
}

void DbusPort::send(Peer to, std::span<const uint8_t> bytes) {
  if (!bus_ || to == kNobody) return;
  std::vector<uint64_t> words((bytes.size() + sizeof(uint64_t) - 1) / sizeof(uint64_t));
  std::memcpy(words.data(), bytes.data(), bytes.size());
  try {
    auto call = bus_->proxy(to, address_.service).createMethodCall(kInterface, kMethod);
    call.dontExpectReply();
    call << static_cast<uint32_t>(bytes.size()) << words;
    call.send(0);
  } catch (const sdbus::Error&) {
    // As a datagram that is lost; a bus that has ended is told by receive().
  }
}

pollfd DbusPort::wait() const {
  if (!bus_) return {-1, 0, 0};
  try {
    const auto wanted = bus_->connection->getEventLoopPollData();
    return {wanted.fd, wanted.events, 0};
  } catch (const sdbus::Error&) {
    return {-1, 0, 0};
  }
}

}  // namespace takt::semantic_link
