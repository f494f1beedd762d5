// SPDX-License-Identifier: Apache-2.0
#include "hal/camera/video_device.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace takt::v4l2 {

int KernelVideoDevice::open(const std::string& path) {
  close();
  descriptor_ = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  return descriptor_ >= 0 ? 0 : errno;
}

void KernelVideoDevice::close() {
  if (const int descriptor = std::exchange(descriptor_, -1); descriptor >= 0) ::close(descriptor);
}

int KernelVideoDevice::control(unsigned long request, void* argument) {
  int result;
  do result = ioctl(descriptor_, request, argument);
  while (result < 0 && errno == EINTR);
  return result < 0 ? errno : 0;
}

std::span<const uint8_t> KernelVideoDevice::map(size_t bytes, uint32_t offset) {
  void* address = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, offset);
  if (address == MAP_FAILED) return {};
  return {static_cast<const uint8_t*>(address), bytes};
}

void KernelVideoDevice::unmap(std::span<const uint8_t> buffer) {
  munmap(const_cast<uint8_t*>(buffer.data()), buffer.size());
}

short KernelVideoDevice::wait(int64_t timeout_ns) {
  pollfd poll{descriptor_, POLLIN, 0};
  const timespec timeout{timeout_ns / 1'000'000'000, timeout_ns % 1'000'000'000};
  return ppoll(&poll, 1, &timeout, nullptr) > 0 ? poll.revents : static_cast<short>(0);
}

}  // namespace takt::v4l2
