// SPDX-License-Identifier: Apache-2.0
// Device kinds semantic_service and semantic_link. Each end opens its own port, which is no hardware.
#include <cmath>
#include <fstream>
#include <map>

#include "hal/devices.hpp"
#include "hal/semantic_link/client.hpp"
#include "hal/semantic_link/client_node.hpp"
#include "hal/semantic_link/dbus_port.hpp"
#include "hal/semantic_link/server.hpp"
#include "hal/semantic_link/service_node.hpp"
#include "hal/semantic_link/udp_port.hpp"
#include "rt/file/input_file.hpp"

namespace takt {
namespace {

using namespace hal;
using namespace semantic_link;

/// Where a link goes, of whichever driver, and the key of its checks.
struct Place {
  std::string name;  ///< the same for ends of the same port
  std::unique_ptr<DatagramPort> port;
  Key key{};
};

/// 32 hexadecimal digits in a file of their own.
Key read_key(Settings& settings) {
  Key key{};
  const auto file = settings.path("key", false);
  if (file.empty()) return key;
  if (const std::string why = why_unreadable(file, kLargestText); !why.empty()) {
    settings.fail(file.string() + ": " + why, "name the file of the key");
    return key;
  }
  std::ifstream in(file);
  std::string digits;
  in >> digits;
  const bool right =
      digits.size() == 2 * key.size() && digits.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  if (!right)
    settings.fail(file.string() + " holds no key of 32 hexadecimal digits",
                  "make one: head -c 16 /dev/urandom | od -An -tx1 | tr -d ' \\n' > " + file.string());
  for (size_t i = 0; right && i < key.size(); ++i)
    key[i] = static_cast<uint8_t>(std::stoul(digits.substr(2 * i, 2), nullptr, 16));
  return key;
}

Place udp_place(const DeviceConfig& config, Settings& settings, bool server) {
  const std::string text = settings.text("address", "127.0.0.1:4700");
  const auto address = parse_udp_address(text);
  if (!address || address->port == 0) {
    settings.fail("`address` is `" + text + "`", "write numbers and port, such as 127.0.0.1:4700");
    return {};
  }
  if (!address->loopback() && !settings.has("key"))
    settings.fail("`address` " + text + " is beyond this machine, and there is no `key`",
                  "anybody there could drive the robot: give both ends a `key` (a file with 32 hexadecimal digits)");
  return {address->text(), server ? UdpPort::of_server(config.id, *address) : UdpPort::of_client(config.id, *address),
          read_key(settings)};
}

Place dbus_place(const DeviceConfig& config, Settings& settings, bool server) {
  DbusAddress address{settings.text("bus", "session"), settings.text("service", "io.takt.semantic")};
  if (!valid(address))
    settings.fail("`bus` is `" + address.bus + "`, `service` is `" + address.service + "`",
                  "bus: session, system or an address such as unix:path=/run/bus; service: words with dots between");
  std::string name = address.bus + " " + address.service;
  return {
      std::move(name),
      server ? DbusPort::of_server(config.id, std::move(address)) : DbusPort::of_client(config.id, std::move(address)),
      {}};
}

Place place_of(const DeviceConfig& config, Settings& settings, bool server) {
  return config.driver == "udp" ? udp_place(config, settings, server) : dbus_place(config, settings, server);
}

std::string robot_of(Settings& settings) {
  std::string robot = settings.text("robot", "");
  if (robot.empty() || robot.size() >= sizeof(Hello::robot))
    settings.fail("`robot` is `" + robot + "`", "name the robot in 1 to 31 characters, at both ends the same");
  return robot;
}

int64_t time_of(Settings& settings, const char* name, double fallback_s) {
  const double seconds = settings.quantity(name, Dimension::time, fallback_s);
  if (!(seconds > 0 && seconds <= 60))
    settings.fail("`" + std::string(name) + "` is not in 0s..60s", "give a time above 0s");
  return std::llround(std::min(seconds, 60.0) * 1e9);
}

template <class NodeClass>
NodeResult opened(std::shared_ptr<LinkRunner> runner, Exchange& exchange, int64_t time_ns) {
  auto device = std::make_unique<LinkDevice>(std::move(runner), exchange);
  if (const auto result = device->open(); !result) return tl::unexpected(result.error());
  return std::make_unique<NodeClass>(std::move(device), time_ns);
}

/// The servers of one process, one per address: services at the same one share it, each with a robot of its own.
class SemanticServers {
 public:
  /// Errors are left in `settings`, or are those of the port.
  tl::expected<std::unique_ptr<DeviceNode>, DeviceError> make_service(const DeviceConfig& config, Settings& settings,
                                                                      const Clock& clock);

 private:
  struct Shared {
    std::weak_ptr<semantic_link::LinkRunner> runner;
    semantic_link::Server* server = nullptr;
  };
  std::map<std::string, Shared> servers_;
};

NodeResult SemanticServers::make_service(const DeviceConfig& config, Settings& settings, const Clock& clock) {
  const std::string robot = robot_of(settings);
  const int64_t watchdog_ns = time_of(settings, "watchdog", 0.3);
  Place place = place_of(config, settings, true);
  if (settings.error()) return tl::unexpected(*settings.error());
  Shared& shared = servers_[config.driver + " " + place.name];
  auto runner = shared.runner.lock();
  if (!runner) {
    auto server = std::make_unique<Server>(std::move(place.port), place.key, clock);
    shared.server = server.get();
    runner = std::make_shared<LinkRunner>(config.id, std::move(server), clock);
    shared.runner = runner;
  }
  Exchange* exchange = shared.server->add_robot(robot);
  if (exchange == nullptr)
    return device_error(config.id, "`robot` " + robot + " is served at " + place.name + " already",
                        "give each service a robot of its own, or another address");
  return opened<ServiceNode>(std::move(runner), *exchange, watchdog_ns);
}

NodeResult make_link(const DeviceConfig& config, Settings& settings, Devices&, const Clock& clock) {
  const std::string robot = robot_of(settings);
  const int64_t lag_ns = time_of(settings, "lag", 0.2);
  Place place = place_of(config, settings, false);
  if (settings.error()) return tl::unexpected(*settings.error());
  auto client = std::make_unique<Client>(std::move(place.port), place.key, robot, clock);
  Exchange& exchange = client->exchange();
  return opened<ClientNode>(std::make_shared<LinkRunner>(config.id, std::move(client), clock), exchange, lag_ns);
}

NodeResult make_service(const DeviceConfig& config, Settings& settings, Devices& devices, const Clock& clock) {
  return devices.shared<SemanticServers>().make_service(config, settings, clock);
}

}  // namespace

void register_semantic_link(DeviceTypes& types) {
  using enum SettingKind;
  types.add({"semantic_service",
             "a robot for a client elsewhere: takes what it sees, gives what it is to do",
             [] { return std::make_unique<semantic_link::ServiceNode>(nullptr, 0); },
             {},
             {
                 {"robot", "", text, true, "name of the robot, at both ends the same"},
                 {"watchdog", "", time, false, "without a velocity of the client for so long it is zero; 300ms"},
             }});
  types.add(
      "semantic_service", {"udp", "UDP, on this machine or beyond", make_service},
      {
          {"address", "udp", text, false, "numbers and port of the server; 127.0.0.1:4700"},
          {"key", "udp", path, false, "file with 32 hexadecimal digits, at both ends the same; needed beyond loopback"},
      });
  types.add("semantic_service", {"dbus", "a D-Bus, on this machine", make_service},
            {
                {"bus", "dbus", text, false, "session, system, or an address such as unix:path=/run/bus; session"},
                {"service", "dbus", text, false, "name of the server on the bus; io.takt.semantic"},
            });
  types.add({"semantic_link",
             "a robot elsewhere: gives what it sees, takes what it is to do",
             [] { return std::make_unique<semantic_link::ClientNode>(nullptr, 0); },
             {},
             {
                 {"robot", "", text, true, "name of the robot, at both ends the same"},
                 {"lag", "", time, false, "objects, scans and odometry that are older are not sent; 200ms"},
             }});
  types.add(
      "semantic_link", {"udp", "UDP, on this machine or beyond", make_link},
      {
          {"address", "udp", text, false, "numbers and port of the server; 127.0.0.1:4700"},
          {"key", "udp", path, false, "file with 32 hexadecimal digits, at both ends the same; needed beyond loopback"},
      });
  types.add("semantic_link", {"dbus", "a D-Bus, on this machine", make_link},
            {
                {"bus", "dbus", text, false, "session, system, or an address such as unix:path=/run/bus; session"},
                {"service", "dbus", text, false, "name of the server on the bus; io.takt.semantic"},
            });
}

}  // namespace takt
