// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace takt::machines {

/// Carries bytes between machines by topic; what is sent may be lost unless the topic promises more. Sending may take
/// tens of milliseconds: never in a job. Topics are made before begin() and the first message; send() on one thread at
/// a time for each.
class Wire {
 public:
  virtual ~Wire() = default;
  enum class Promise : uint8_t {
    none,
    newest,  ///< the newest message comes again until it has arrived, also to who joins late
    all,     ///< each one comes again until it has arrived where somebody listens
  };
  struct Topic {
    std::string name;
    Promise promise = Promise::none;
  };
  virtual size_t sends(const Topic& topic) = 0;  ///< its number for send()
  virtual size_t takes(const Topic& topic) = 0;  ///< its number for `each`
  virtual void send(size_t topic, std::span<const std::byte> bytes) = 0;
  /// From here on each(topic, bytes) for what comes, one call at a time, on threads of the wire: no message waits for
  /// another thread to wake up. The last call has ended when the wire is destroyed.
  using Each = std::function<void(size_t topic, std::span<const std::byte> bytes)>;
  virtual void begin(Each each) = 0;
};

struct WireOptions {
  std::string address;  ///< of this machine's interface; nothing is sent or heard elsewhere
  int domain = 0;       ///< 0..230: wires of different domains do not hear each other
  /// Folder of `takt keys` for this machine: only who has keys of the same authority is heard, and all is encrypted.
  /// Empty: anybody is heard, and anybody hears.
  std::filesystem::path keys = {};
  /// A line for people: who is not listened to. From the thread that takes, and from the destructor. May be empty.
  std::function<void(const std::string&)> say = {};
};

/// Over DDS (Cyclone). Throws std::runtime_error with the next step: it is not installed, or there is no such
/// interface.
std::unique_ptr<Wire> make_dds_wire(const WireOptions& options);

}  // namespace takt::machines
