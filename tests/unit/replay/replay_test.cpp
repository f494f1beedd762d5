// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "hal/replay/replay_camera.hpp"
#include "tests/conformance/stereo_camera.hpp"
#include "tests/has.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::replay;
using test::has;
namespace fs = std::filesystem;

namespace {

const char* const kCalibration =
    "P0: 70 0 15.5 0 0 70 11.5 0 0 0 1 0\n"
    "P1: 70 0 15.5 -7 0 70 11.5 0 0 0 1 0\n";

/// A recording of small random images in the KITTI layout.
struct Recording : takt::test::TemporaryFolder {
  explicit Recording(int frames = 4, int channels = 1) {
    uint32_t state = 1;
    for (const char* side : {"image_l", "image_r"}) {
      fs::create_directory(path / side);
      for (int k = 0; k < frames; ++k) {
        cv::Mat image(24, 32, channels == 1 ? CV_8UC1 : CV_8UC3);
        for (size_t i = 0; i < image.total() * image.elemSize(); ++i) {
          state = state * 1664525u + 1013904223u;
          image.data[i] = static_cast<uint8_t>(state >> 24);
        }
        cv::imwrite((path / side / ("00000" + std::to_string(k) + ".png")).string(), image);
      }
    }
    write("calib.txt", kCalibration);
  }
  ReplayCameraSettings settings() const {
    ReplayCameraSettings s;
    s.directory = path;
    s.rate = {10, 1};
    return s;
  }
  std::string error() const {
    VirtualClock clock;
    const auto opened = ReplayCamera("camera", settings(), clock).open();
    return opened ? "" : opened.error().text();
  }
};

}  // namespace

TEST_CASE("replay conforms") {
  const Recording recording;
  const auto make = [&](const Clock& clock) -> std::unique_ptr<StereoCamera> {
    return std::make_unique<ReplayCamera>("camera", recording.settings(), clock);
  };
  test::check_stereo_camera(make);
  test::check_free_running_camera(make);
  const Recording longer(12);
  VirtualClock clock;
  ReplayCamera camera("camera", longer.settings(), clock);
  test::check_streaming_camera(camera, clock, [&](int64_t at_ns) { clock.advance_to(at_ns); });
  const Recording colour(4, 3);
  test::check_stereo_camera([&](const Clock& clock) -> std::unique_ptr<StereoCamera> {
    return std::make_unique<ReplayCamera>("camera", colour.settings(), clock);
  });
}

TEST_CASE("stamps are epoch + k / rate, or what times.txt says, then the data end") {
  const Recording recording;
  for (const bool times : {false, true}) {
    if (times) recording.write("times.txt", "100.0\n100.1\n100.25\n100.3\n");
    VirtualClock clock;
    ReplayCamera camera("camera", recording.settings(), clock);
    REQUIRE(camera.open().has_value());
    CHECK(camera.format().camera.baseline_m == doctest::Approx(0.1));
    CHECK(camera.format().camera.cv_px == 11.5);
    REQUIRE(camera.start(1'000).has_value());
    test::GuardedImage left(camera.format()), right(camera.format());
    std::vector<int64_t> stamps;
    for (int k = 0; k < 4; ++k) {
      camera.trigger(k * 1'000'000'000ll);
      const StereoFrame frame = camera.read(left.view(), right.view(), INT64_MAX);
      REQUIRE(frame.status == ReadStatus::ok);
      const cv::Mat file = cv::imread((recording.path / "image_r" / ("00000" + std::to_string(k) + ".png")).string(),
                                      cv::IMREAD_UNCHANGED);
      CHECK(right.view().at(31, 23) == file.at<uint8_t>(23, 31));
      stamps.push_back(frame.stamp_ns);
    }
    CHECK(stamps == (times ? std::vector<int64_t>{1'000, 100'001'000, 250'001'000, 300'001'000}
                           : std::vector<int64_t>{1'000, 100'001'000, 200'001'000, 300'001'000}));
    camera.trigger(5'000'000'000);
    CHECK(camera.read(left.view(), right.view(), INT64_MAX).status == ReadStatus::end_of_data);
    CHECK(camera.read(left.view(), right.view(), INT64_MAX).status == ReadStatus::end_of_data);
  }
}

TEST_CASE("frames that do not fit the memory limit are decoded on reading, with the same bytes") {
  const Recording recording;
  ReplayCameraSettings tight = recording.settings();
  tight.memory_limit = 0;
  VirtualClock clock;
  ReplayCamera held("camera", recording.settings(), clock), read_late("camera", tight, clock);
  REQUIRE(held.open().has_value());
  REQUIRE(read_late.open().has_value());
  REQUIRE(held.start(0).has_value());
  REQUIRE(read_late.start(0).has_value());
  test::GuardedImage a(held.format()), b(held.format()), right(held.format());
  for (int k = 0; k < 4; ++k) {
    held.trigger(k);
    read_late.trigger(k);
    CHECK(held.read(a.view(), right.view(), INT64_MAX).status == ReadStatus::ok);
    CHECK(read_late.read(b.view(), right.view(), INT64_MAX).status == ReadStatus::ok);
    CHECK(a.bytes == b.bytes);
  }
}

TEST_CASE("a directory in Middlebury's layout is a single pair") {
  const Recording recording;
  fs::copy_file(recording.path / "image_l/000000.png", recording.path / "im2.png");
  fs::copy_file(recording.path / "image_r/000000.png", recording.path / "im6.png");
  fs::remove_all(recording.path / "image_l");
  VirtualClock clock;
  ReplayCameraSettings settings = recording.settings();
  CHECK(has(ReplayCamera("camera", settings, clock).open().error().what, "`focal`"));
  settings.camera = {500, 0, 0, 0.16};
  settings.frames = 3;
  ReplayCamera camera("camera", settings, clock);
  REQUIRE(camera.open());
  CHECK(camera.frames() == 3);
  CHECK(camera.format().camera.focal_px == 500);
}

TEST_CASE("bad recordings are refused before start, with the file at fault") {
  {
    ReplayCameraSettings s;
    VirtualClock clock;
    CHECK_FALSE(ReplayCamera("camera", s, clock).open().has_value());
    s.directory = "/nonexistent/recording";
    const auto opened = ReplayCamera("camera", s, clock).open();
    REQUIRE_FALSE(opened.has_value());
    CHECK(opened.error().id == "camera");
    CHECK(has(opened.error().what, "/nonexistent/recording"));
  }
  {
    const Recording r;
    fs::remove(r.path / "image_r/000003.png");
    CHECK(has(r.error(), "image_l holds 4 images, image_r 3"));
    fs::remove_all(r.path / "image_r");
    CHECK(has(r.error(), "image_r"));
  }
  {
    const Recording r;
    fs::rename(r.path / "image_r/000002.png", r.path / "image_r/000002b.png");
    CHECK(has(r.error(), "000002b.png"));
  }
  {
    const Recording r;  // cut short: the pixels are missing
    fs::resize_file(r.path / "image_r/000002.png", fs::file_size(r.path / "image_r/000002.png") / 2);
    CHECK(has(r.error(), "image_r/000002.png: is a truncated PNG"));
  }
  {
    const Recording r;  // damaged inside: the end looks right
    std::fstream file(r.path / "image_l/000001.png", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(16);
    file.write("\xff\xff\xff\xff", 4);
    file.close();
    CHECK(has(r.error(), "image_l/000001.png"));
  }
  {
    const Recording r;
    r.write("image_l/000001.png", "no image");
    CHECK(has(r.error(), "image_l/000001.png: is no PNG"));
  }
  {
    const Recording r;
    cv::imwrite((r.path / "image_l/000001.png").string(), cv::Mat(10, 10, CV_8UC1, cv::Scalar(3)));
    CHECK(has(r.error(), "is 10 x 10, the first image is 32 x 24"));
  }
}

TEST_CASE("bad calibrations are refused with file and line") {
  const Recording r;
  r.write("calib.txt", "P0: 70 0 15.5 0 0 70 11.5 0 0 0 1 0\nP1: 70 0 nan -7 0 70 11.5 0 0 0 1 0\n");
  CHECK(has(r.error(), "calib.txt:2: value 3 of P1: is `nan`"));
  r.write("calib.txt", "P0: 70 0 abc\n");
  CHECK(has(r.error(), "calib.txt:1"));
  r.write("calib.txt", "P0: 70 0 15.5 0\n");
  CHECK(has(r.error(), "has 4 values, needs 12"));
  r.write("calib.txt", "P0: 70 0 15.5 0 0 70 11.5 0 0 0 1 0\n");
  CHECK(has(r.error(), "no row P1"));
  r.write("calib.txt", "P0: 70 0 15.5 0 0 70 11.5 0 0 0 1 0\nP1: 70 0 15.5 7 0 70 11.5 0 0 0 1 0\n");
  CHECK(has(r.error(), "swap left and right"));
  fs::remove(r.path / "calib.txt");
  CHECK(has(r.error(), "calib.txt"));
  r.write("calib.txt", kCalibration);
  r.write("times.txt", "0\n0.1\n0.05\n0.2\n");
  CHECK(has(r.error(), "times.txt:3"));
  r.write("times.txt", "0\n0.1\n");
  CHECK(has(r.error(), "2 times for 4 frames"));
}

TEST_CASE("a single pair is repeated") {
  const Recording r;
  ReplayCameraSettings s;
  s.left = r.path / "image_l/000000.png";
  s.right = r.path / "image_r/000000.png";
  s.frames = 3;
  VirtualClock clock;
  CHECK_FALSE(ReplayCamera("camera", s, clock).open().has_value());  // no calibration
  s.camera = {70, 0, 0, 0.1};
  ReplayCamera camera("camera", s, clock);
  REQUIRE(camera.open().has_value());
  CHECK(camera.format().camera.cu_px == 15.5);
  REQUIRE(camera.start(0).has_value());
  test::GuardedImage left(camera.format()), right(camera.format());
  for (uint32_t k = 0; k < 3; ++k) {
    camera.trigger(k);
    const StereoFrame frame = camera.read(left.view(), right.view(), INT64_MAX);
    CHECK(frame.status == ReadStatus::ok);
    CHECK(frame.frame_number == k);
  }
  camera.trigger(4);
  CHECK(camera.read(left.view(), right.view(), INT64_MAX).status == ReadStatus::end_of_data);
}
