// SPDX-License-Identifier: Apache-2.0
#include "hal/can/port.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

namespace takt::can {
namespace {

static_assert(sizeof(canfd_frame) + 1 == sizeof(Reception::packet));

constexpr std::string_view kUnix = "unix:";
constexpr size_t kMostFilters = 32;

int64_t to_ns(const timespec& t) { return int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec; }

template <class T>
bool set(int descriptor, int level, int option, const T& value) {
  return setsockopt(descriptor, level, option, &value, sizeof(value)) == 0;
}

PortStatus status_of(int error) {
  switch (error) {
    case EAGAIN: return PortStatus::nothing;
    case ENETDOWN: return PortStatus::down;
    default: return PortStatus::gone;
  }
}

}  // namespace

int Port::open(std::span<const uint32_t> ids) {
  if (is_open()) return 0;
  const bool is_unix = interface_.starts_with(kUnix);
  const int error = is_unix ? open_unix(std::string_view(interface_).substr(kUnix.size())) : open_can(ids);
  if (error != 0) close();
  socket_overflows_ = 0;
  emptied_ns_ = clock_.now_ns();
  return error;
}

int Port::open_can(std::span<const uint32_t> ids) {
  if (interface_.size() >= IFNAMSIZ) return ENODEV;
  descriptor_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (descriptor_ < 0) return errno;
  std::array<can_filter, kMostFilters> filters{};
  const size_t count = std::min(ids.size(), kMostFilters);
  for (size_t i = 0; i < count; ++i) filters[i] = {ids[i], CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG};
  const can_err_mask_t every_error = CAN_ERR_MASK;
  if ((count > 0 && setsockopt(descriptor_, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                               static_cast<socklen_t>(count * sizeof(can_filter))) != 0) ||
      !set(descriptor_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, every_error) ||
      (fd_ && !set(descriptor_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, 1)) ||
      !set(descriptor_, SOL_SOCKET, SO_TIMESTAMPNS, 1) || !set(descriptor_, SOL_SOCKET, SO_RXQ_OVFL, 1)) {
    return errno;
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface_.c_str()));
  if (address.can_ifindex == 0) return errno;
  return bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 ? 0 : errno;
}

int Port::open_unix(std::string_view path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) return ENAMETOOLONG;
  std::copy(path.begin(), path.end(), address.sun_path);
  // Sequenced packets: a frame stays a frame, and the end of the other side is told.
  const int descriptor = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return errno;
  const auto* where = reinterpret_cast<const sockaddr*>(&address);
  if (end_ == End::host) {
    descriptor_ = descriptor;
    if (connect(descriptor, where, sizeof(address)) != 0) return errno;
    return set(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, 1) ? 0 : errno;
  }
  listener_ = descriptor;
  unlink(address.sun_path);  // of a double that did not end in order
  return bind(descriptor, where, sizeof(address)) == 0 && listen(descriptor, 1) == 0 ? 0 : errno;
}

void Port::close() {
  for (int* descriptor : {&descriptor_, &listener_}) {
    if (*descriptor >= 0) ::close(*descriptor);
    *descriptor = -1;
  }
}

void Port::accept_host() {
  descriptor_ = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (descriptor_ >= 0) set(descriptor_, SOL_SOCKET, SO_TIMESTAMPNS, 1);
}

int64_t Port::stamp_of(int64_t realtime_ns) const {
  const int64_t now_ns = clock_.now_ns();
  if (clock_.is_virtual()) return now_ns;
  // The kernel stamps in CLOCK_REALTIME, which may have been set since: the frame cannot be older than the last look
  // into the empty queue, nor younger than now.
  timespec realtime;
  clock_gettime(CLOCK_REALTIME, &realtime);
  return std::clamp(now_ns - (to_ns(realtime) - realtime_ns), std::min(emptied_ns_, now_ns), now_ns);
}

Reception Port::receive() {
  Reception reception;
  if (descriptor_ < 0 && listener_ >= 0) accept_host();
  if (descriptor_ < 0) {
    reception.status = listener_ >= 0 ? PortStatus::nothing : PortStatus::gone;
    return reception;
  }
  auto& bytes = reception.packet;
  alignas(cmsghdr) std::array<uint8_t, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(uint32_t))> control;
  iovec part{bytes.data(), bytes.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const int64_t looked_ns = clock_.now_ns();
  ssize_t count;
  do count = recvmsg(descriptor_, &message, MSG_DONTWAIT);
  while (count < 0 && errno == EINTR);
  if (count <= 0) {
    reception.status = count == 0 ? PortStatus::gone : status_of(errno);
    if (reception.status == PortStatus::nothing) emptied_ns_ = looked_ns;
    if (reception.status != PortStatus::gone || listener_ < 0) return reception;
    ::close(descriptor_);  // the host has gone; the next one may come
    descriptor_ = -1;
    reception.status = PortStatus::nothing;
    return reception;
  }
  reception.stamp_ns = clock_.now_ns();
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SO_RXQ_OVFL) {
      const uint32_t before = socket_overflows_;
      std::memcpy(&socket_overflows_, CMSG_DATA(c), sizeof(socket_overflows_));
      overflows_ += socket_overflows_ - before;
    }
    if (c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp;
    std::memcpy(&stamp, CMSG_DATA(c), sizeof(stamp));
    reception.stamp_ns = stamp_of(to_ns(stamp));
  }
  reception.packet_bytes = static_cast<size_t>(count);
  const auto frame = from_wire({bytes.data(), reception.packet_bytes});
  reception.status = frame ? PortStatus::ok : PortStatus::malformed;
  if (frame) reception.frame = *frame;
  return reception;
}

PortStatus Port::send(const Frame& frame) {
  if (descriptor_ < 0) return listener_ >= 0 ? PortStatus::full : PortStatus::gone;
  const WireFrame wire = to_wire(frame);
  ssize_t count;
  do count = ::send(descriptor_, wire.data(), wire.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  while (count < 0 && errno == EINTR);
  if (count >= 0) return PortStatus::ok;
  if (errno == EAGAIN || errno == ENOBUFS) return PortStatus::full;
  return status_of(errno);
}

std::string advice(const std::string& interface, int error) {
  if (interface.starts_with(kUnix)) return "start the double that listens there";
  switch (error) {
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
      return "this kernel has no CAN: load can_raw (modprobe can_raw), or give `interface: unix:PATH` of a double";
    case ENODEV: return "plug the adapter in, or name another interface: ip -br link show type can";
    default: return "set the interface up: ip link set " + interface + " up type can bitrate 500000 restart-ms 100";
  }
}

}  // namespace takt::can
