// SPDX-License-Identifier: Apache-2.0
#include "hal/laser/stream_laser.hpp"

#include <poll.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>

namespace takt {
namespace {

constexpr int64_t kOpenAgain_ns = 250'000'000, kLongestWait_ns = 100'000'000;
constexpr int kMostReads = 16, kMostOrders = 16;  // in one step, whatever the other side does
/// Fewer echoes than this, and a sweep that equals the one before may be an empty hall.
constexpr ptrdiff_t kEchoesThatDiffer = 10;

void wait_for_bytes(int descriptor, int64_t wait_ns) {
  pollfd bytes{descriptor, POLLIN, 0};
  const timespec time{0, static_cast<long>(std::clamp<int64_t>(wait_ns, 0, kLongestWait_ns))};
  ppoll(&bytes, descriptor >= 0 ? 1 : 0, &time, nullptr);
}

/// Values scatter by millimetres from sweep to sweep: equal ones are the same measurement once more.
bool same_measurement(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0 &&
         std::count_if(a.begin(), a.end(), [](float range) { return range > 0; }) >= kEchoesThatDiffer;
}

}  // namespace

StreamLaser::StreamLaser(std::string id, std::unique_ptr<ByteStream> stream, std::unique_ptr<LaserSession> session,
                         const Transform& sensor_in_robot, const Clock& clock)
    : id_(std::move(id)),
      stream_(std::move(stream)),
      session_(std::move(session)),
      sensor_in_robot_(sensor_in_robot),
      clock_(clock) {}

DeviceResult StreamLaser::open() {
  if (open_) return {};
  if (const auto opened = stream_->open(); !opened) return opened;
  const uint32_t beams = session_->format().beams;
  newest_.for_each([&](Delivery& slot) { slot.scan.range_m.assign(beams, 0.0f); });
  previous_range_m_.assign(beams, 0.0f);
  open_ = true;
  return {};
}

void StreamLaser::close() {
  stop();
  stream_->close();
  open_ = has_line_ = false;
}

DeviceResult StreamLaser::start(int64_t) {
  if (!open_) return device_error(id_, "start before open", "call open() first");
  if (started_) return {};
  newest_.take();
  session_->begin(clock_.now_ns());
  has_line_ = true;
  connected_.store(true);
  damage_seen_ = damaged_.load() + resyncs_.load();
  started_ = true;
  if (clock_.is_virtual()) return {};
  quit_.store(false);
  thread_ = std::thread([this] { work(); });
  return {};
}

void StreamLaser::stop() {
  if (!started_) return;
  started_ = false;
  if (thread_.joinable()) {
    quit_.store(true);
    thread_.join();
  }
  if (has_line_) send(session_->farewell());
}

bool StreamLaser::restart(int64_t) { return connected_.load(std::memory_order_acquire); }

DeclaredCalls StreamLaser::declared_calls() const {
  if (!clock_.is_virtual()) return {};
  return {bit(JobCall::file) | bit(JobCall::socket) | bit(JobCall::wait) | bit(JobCall::malloc),
          "with a virtual clock the line is read by the job itself"};
}

SourceCounts StreamLaser::counts() const {
  return {received_.load(), damaged_.load(), resyncs_.load(), missing_.load(), 0};
}

ScanFormat StreamLaser::format() const {
  ScanFormat format = session_->format();
  format.sensor_in_robot = sensor_in_robot_;
  return format;
}

ScanReading StreamLaser::read(std::span<float> range_m, int64_t wanted_ns, int64_t deadline_ns) {
  ScanReading reading;
  if (!started_ || wanted_ns > deadline_ns) return reading;
  if (clock_.is_virtual()) step();
  else priority_.follow();
  const uint64_t damaged = damaged_.load(std::memory_order_relaxed) + resyncs_.load(std::memory_order_relaxed);
  if (const Delivery* newest = newest_.take()) {
    const std::vector<float>& range = newest->scan.range_m;
    std::copy_n(range.begin(), std::min(range.size(), range_m.size()), range_m.begin());
    reading = {range_m.size() < range.size() ? ReadStatus::partial : ReadStatus::ok, newest->scan.stamp_ns,
               newest->scan.scan_number, newest->repeated};
  } else if (!connected_.load(std::memory_order_acquire)) {
    reading.status = ReadStatus::disconnected;
  } else if (damaged != damage_seen_) {
    reading.status = ReadStatus::partial;
  }
  damage_seen_ = damaged;
  return reading;
}

void StreamLaser::work() {
  pthread_setname_np(pthread_self(), ("laser:" + id_).substr(0, 15).c_str());
  while (!quit_.load()) {
    priority_.keep(clock_);
    const int64_t until_ns = step();
    wait_for_bytes(has_line_ ? stream_->descriptor() : -1, until_ns - clock_.now_ns());
  }
}

int64_t StreamLaser::step() {
  if (!has_line_) {
    const int64_t now_ns = clock_.now_ns();
    if (now_ns < open_again_ns_) return open_again_ns_;
    if (!stream_->open()) return open_again_ns_ = now_ns + kOpenAgain_ns;
    has_line_ = true;
    session_->begin(now_ns);
    connected_.store(true, std::memory_order_release);
  }
  receive();
  const int64_t until_ns = has_line_ ? obey() : open_again_ns_;
  received_.store(session_->sweeps(), std::memory_order_relaxed);
  missing_.store(session_->missing(), std::memory_order_relaxed);
  damaged_.store(session_->damaged(), std::memory_order_relaxed);
  resyncs_.store(session_->resyncs(), std::memory_order_relaxed);
  trouble_.store(has_line_ ? session_->trouble() : "the line is gone", std::memory_order_relaxed);
  return until_ns;
}

void StreamLaser::receive() {
  std::array<uint8_t, 4096> bytes;
  for (int reads = 0; reads < kMostReads; ++reads) {
    const auto got = stream_->read(bytes);
    if (!got) return lose_line();
    if (*got == 0) return;
    if (const ReceivedScan* scan = session_->receive(std::span(bytes).first(*got), clock_.now_ns())) deliver(*scan);
  }
}

/// Until when the session wants nothing.
int64_t StreamLaser::obey() {
  for (int orders = 0; orders < kMostOrders; ++orders) {
    const LineOrder order = session_->next(clock_.now_ns());
    switch (order.kind) {
      case LineOrder::Kind::wait: return order.until_ns;
      case LineOrder::Kind::send: send(order); break;
      case LineOrder::Kind::set_baud:
        stream_->set_baud(order.baud);
        session_->line_has(stream_->baud());
        break;
      case LineOrder::Kind::reopen: lose_line(); return open_again_ns_;
    }
  }
  return clock_.now_ns();
}

/// What the line does not take now is lost; the session repeats what was not answered.
void StreamLaser::send(const LineOrder& order) {
  const bool apart = order.gap_ns > 0 && !clock_.is_virtual();
  const size_t at_once = apart ? 1 : order.bytes.size();
  for (auto rest = order.bytes; !rest.empty(); rest = rest.subspan(at_once)) {
    stream_->write(rest.first(at_once));
    if (apart) std::this_thread::sleep_for(std::chrono::nanoseconds(order.gap_ns));
  }
}

void StreamLaser::lose_line() {
  stream_->close();
  has_line_ = false;
  open_again_ns_ = clock_.now_ns() + kOpenAgain_ns;
  connected_.store(false, std::memory_order_release);
}

void StreamLaser::deliver(const ReceivedScan& scan) {
  Delivery& draft = newest_.draft();
  draft.scan.stamp_ns = scan.stamp_ns;
  draft.scan.scan_number = scan.scan_number;
  draft.scan.range_m = scan.range_m;
  draft.repeated = same_measurement(scan.range_m, previous_range_m_);
  previous_range_m_ = scan.range_m;
  newest_.publish();
}

}  // namespace takt
