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

/// Carries bytes between machines by topic; what is sent may be lost unless the topic is reliable. Sending may take
/// tens of milliseconds: never in a job. Topics are made before the first message; send() on one thread, take() on
/// another.
class Wire {
 public:
  virtual ~Wire() = default;
  struct Topic {
    std::string name;
    bool reliable = false;  ///< the newest message comes again until it has arrived, also to who joins late
  };
  virtual size_t sends(const Topic& topic) = 0;  ///< its number for send()
  virtual size_t takes(const Topic& topic) = 0;  ///< its number in take()
  virtual void send(size_t topic, std::span<const std::byte> bytes) = 0;
  /// Waits until something comes, at most so long; then each(topic, bytes) for all that is there.
  virtual void take(int64_t patience_ns, const std::function<void(size_t, std::span<const std::byte>)>& each) = 0;
};

inline constexpr int kSocketBuffer = 4 << 20;  ///< bytes that are asked for; as much as net.core.rmem_max allows

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
