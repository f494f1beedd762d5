// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "hal/camera/stereo_camera.hpp"
#include "hal/reads_files.hpp"
#include "hal/replay/stereo_files.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/time/clock.hpp"
#include "rt/time/rate.hpp"

namespace takt::replay {

struct ReplayCameraSettings {
  std::filesystem::path directory;    ///< KITTI layout; or
  std::filesystem::path left, right;  ///< one rectified pair, delivered `frames` times
  CameraModel camera;                 ///< of the single pair
  int64_t frames = 1;
  int shrink = 1;                        ///< 1..16: images become smaller by this factor, the camera model with them
  int channels = 0;                      ///< 0: as the files; 1 or 3: converted
  int bits = 0;                          ///< of images of more than 8 bits; 0: as the file says (read_image())
  Rate rate{15, 1};                      ///< where no times.txt tells the stamps
  uint64_t memory_limit = 512ull << 20;  ///< decoded frames up to this size are held in memory from open() on
};

/// Recorded stereo pairs as a camera. Frame k has the stamp epoch + its recorded time (times.txt) or epoch + k / rate.
/// trigger(t) asks for the next frame and is its exposure's instant only as a release: frames are never skipped, each
/// trigger delivers the next one with its recorded stamp. Nobody triggers: a frame is delivered once the clock has
/// reached its stamp. After the last frame: end_of_data.
class ReplayCamera final : public StereoCamera, public ReadsFiles {
 public:
  ReplayCamera(std::string id, ReplayCameraSettings settings, const Clock& clock);
  ~ReplayCamera() override;

  DeviceResult open() override;
  void close() override;
  DeviceResult start(int64_t epoch_ns) override;
  void stop() override { started_ = false; }
  DeclaredCalls declared_calls() const override;
  /// Of a frame for each job: by how much the jobs fall behind the recording.
  StampLaw stamp_law(const JobTimes& jobs) const override;
  StereoFormat format() const override { return format_; }
  void trigger(int64_t at_ns) override;
  StereoFrame read(ImageView<uint8_t> left, ImageView<uint8_t> right, int64_t deadline_ns) override;
  int64_t frames() const { return frames_; }
  std::vector<std::string> left_out() const override { return files_.left_out; }

 private:
  struct Store;
  DeviceResult find_files();
  DeviceResult decode_all();
  int64_t stamp_of(int64_t frame) const;

  std::string id_;
  ReplayCameraSettings settings_;
  const Clock& clock_;
  StereoFiles files_;
  StereoFormat format_;
  std::unique_ptr<Store> store_;
  int64_t frames_ = 0, next_ = 0, epoch_ns_ = 0;
  bool started_ = false, has_trigger_ = false, ever_triggered_ = false;
  int64_t triggered_ns_ = 0;
};

}  // namespace takt::replay
