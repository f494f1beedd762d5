// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <span>
#include <string>

namespace takt::v4l2 {

/// The calls that a V4L2 driver makes of its device file: what stands between the driver and the kernel, or a double.
/// One thread.
class VideoDevice {
 public:
  VideoDevice() = default;
  VideoDevice(const VideoDevice&) = delete;
  VideoDevice& operator=(const VideoDevice&) = delete;
  virtual ~VideoDevice() = default;

  /// 0 or an errno. Its calls do not wait.
  virtual int open(const std::string& path) = 0;
  virtual void close() = 0;
  /// An ioctl: 0 or an errno. A signal does not interrupt it.
  virtual int control(unsigned long request, void* argument) = 0;
  /// A buffer of the driver; empty if it cannot be had.
  virtual std::span<const uint8_t> map(size_t bytes, uint32_t offset) = 0;
  virtual void unmap(std::span<const uint8_t> buffer) = 0;
  /// Until there is something to take, or the time is over: poll's `revents`.
  virtual short wait(int64_t timeout_ns) = 0;
  /// Whether a device that is opened again takes memory from the heap.
  virtual bool allocates() const { return false; }
};

/// A device file of this machine.
class KernelVideoDevice final : public VideoDevice {
 public:
  ~KernelVideoDevice() override { close(); }
  int open(const std::string& path) override;
  void close() override;
  int control(unsigned long request, void* argument) override;
  std::span<const uint8_t> map(size_t bytes, uint32_t offset) override;
  void unmap(std::span<const uint8_t> buffer) override;
  short wait(int64_t timeout_ns) override;

 private:
  int descriptor_ = -1;
};

}  // namespace takt::v4l2
