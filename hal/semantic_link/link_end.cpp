// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/link_end.hpp"

#include <sys/random.h>

#include <random>

namespace takt::semantic_link {
namespace {

constexpr int64_t kOpenAgain_ns = 250'000'000;
constexpr int kMostDatagrams = 256;  // in one step, whatever the other side does

}  // namespace

LinkEnd::LinkEnd(std::unique_ptr<DatagramPort> port, const Key& key, const Clock& clock)
    : clock_(clock), port_(std::move(port)), key_(key), outlet_{*port_, key_}, bytes_(kLargestDatagram + 1) {}

DeviceResult LinkEnd::open() {
  if (open_) return {};
  const DeviceResult opened = port_->open();
  if (opened) set_open(true);
  return opened;
}

void LinkEnd::close() {
  port_->close();
  set_open(false);
}

int64_t LinkEnd::step() {
  const int64_t now_ns = clock_.now_ns();
  if (!open_ && now_ns >= open_again_ns_ && !open()) open_again_ns_ = now_ns + kOpenAgain_ns;
  for (int i = 0; open_ && i < kMostDatagrams && receive_one(now_ns);) ++i;
  return open_ ? send_due(clock_.now_ns()) : open_again_ns_;
}

bool LinkEnd::receive_one(int64_t now_ns) {
  const Arrival arrival = port_->receive(bytes_);
  if (arrival.what == Arrival::What::gone) {
    close();
    open_again_ns_ = now_ns + kOpenAgain_ns;
  }
  if (arrival.what != Arrival::What::datagram) return false;
  const auto packet = read_packet(std::span(bytes_).first(std::min(arrival.size, bytes_.size())), key_);
  if (packet) take(*packet, arrival.from, clock_.now_ns());
  else ++(packet.error() == Fault::check ? counts_.damaged : counts_.malformed);
  return true;
}

void LinkEnd::set_open(bool open) {
  open_ = open;
  port_changed(open);
}

uint64_t random_number() {
  uint64_t number = 0;
  if (getrandom(&number, sizeof number, 0) == sizeof number) return number;
  std::random_device device;
  return uint64_t{device()} << 32 | device();
}

}  // namespace takt::semantic_link
