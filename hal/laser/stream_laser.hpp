// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "hal/device_thread.hpp"
#include "hal/laser/laser_session.hpp"
#include "hal/newest.hpp"
#include "hal/stream/byte_stream.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// A laser scanner at the end of a byte stream: brings a session and a line together.
///
/// A thread of its own, named after the device, does what the session wants, stamps bytes as they come, and opens a
/// lost line again, every 250 ms; read() takes the newest sweep from it and never waits. The thread is an ordinary one
/// until a real-time thread reads; then it takes the lowest real-time priority. It ends within 250 ms of stop(). With a
/// virtual clock there is no thread: step() does its work, and read() steps.
class StreamLaser final : public LaserScanner {
 public:
  StreamLaser(std::string id, std::unique_ptr<ByteStream> stream, std::unique_ptr<LaserSession> session,
              const Transform& sensor_in_robot, const Clock& clock);
  ~StreamLaser() override { close(); }

  /// Claims the line; the device itself may still be silent then.
  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override;
  int64_t starts_within_ns() const override { return session_->starts_within_ns(); }
  /// True once the thread has the line again.
  bool restart(int64_t now_ns) override;
  DeclaredCalls declared_calls() const override;
  ScanFormat format() const override;
  ScanReading read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) override;

  SourceCounts counts() const override;
  /// Any thread.
  const char* trouble() const override { return trouble_.load(std::memory_order_relaxed); }

  /// Does what is due now, all in all less than 1 ms but for a pause between bytes where the device needs it. Only
  /// where there is no thread. Returns when it is to be called again, unless bytes come.
  int64_t step();

 private:
  struct Delivery {
    ReceivedScan scan;
    bool repeated = false;
  };
  void work();
  void receive();
  int64_t obey();
  void send(const LineOrder& order);
  void lose_line();
  void deliver(const ReceivedScan& scan);

  std::string id_;
  std::unique_ptr<ByteStream> stream_;
  std::unique_ptr<LaserSession> session_;
  Transform sensor_in_robot_;
  const Clock& clock_;
  bool open_ = false, started_ = false;

  // Of the thread; after its end, of whoever stopped it.
  bool has_line_ = false;
  int64_t open_again_ns_ = 0;
  std::vector<float> previous_range_m_;

  // Between the threads.
  Newest<Delivery> newest_;
  std::atomic<bool> connected_{false}, quit_{false};
  DevicePriority priority_;
  std::atomic<uint64_t> received_{0}, missing_{0}, damaged_{0}, resyncs_{0};
  std::atomic<const char*> trouble_{""};
  uint64_t damage_seen_ = 0;  ///< damaged or resynchronised
  std::thread thread_;
};

}  // namespace takt
