// SPDX-License-Identifier: Apache-2.0
// Writers and readers of DDS by the names of their topics and types, for samples that are CDR already.
//
//   Participant participant({.address = "10.0.0.1", .domain = 3}, "enclave=/;");
//   const size_t scan = participant.add_writer({"rt/scan", "sensor_msgs::msg::dds_::LaserScan_", {}, "typehash=...;"});
//   if (participant.readers_of(scan) > 0) participant.write(scan, cdr, taken_at_ns);
//
// A write may last tens of milliseconds: never in a job. One thread at a time, but for take(), which has its own.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace takt::dds {

using Guid = std::array<uint8_t, 16>;

struct Profile {
  bool reliable = false;
  bool transient_local = false;  ///< who joins late is given the last ones
  int depth = 1;                 ///< the newest so many are kept
};

struct Endpoint {
  std::string topic, type;
  Profile profile;
  std::string user_data;
};

class Participant {
 public:
  struct Options {
    std::string address = "127.0.0.1";  ///< of the interface; nothing is sent or heard elsewhere
    int domain = 0;                     ///< 0 to 232
  };
  /// `user_data`: what others are told of it. Throws std::runtime_error with the next step.
  Participant(const Options& options, const std::string& user_data);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// Its number for the functions below. Throws std::runtime_error.
  size_t add_writer(const Endpoint& endpoint);
  void remove_writer(size_t writer);
  /// How many readers listen to it at present.
  size_t readers_of(size_t writer) const;
  /// `at_ns`: since 1970, what readers see as the source timestamp. False: it was not sent, since a reliable reader is
  /// too slow.
  bool write(size_t writer, std::span<const std::byte> cdr, int64_t at_ns);
  Guid guid() const;
  Guid guid_of(size_t writer) const;

  /// Its number in take(); before the first take(). Throws std::runtime_error.
  size_t add_reader(const Endpoint& endpoint);
  /// Waits until something comes, at most so long; then each(reader, bytes, source timestamp) for all that is there.
  void take(int64_t patience_ns, const std::function<void(size_t, std::span<const std::byte>, int64_t)>& each);

 private:
  class Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace takt::dds
