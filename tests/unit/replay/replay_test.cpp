// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "hal/replay/frame_times.hpp"
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
    CHECK(has(r.error(), "image_l holds 4 images"));
    CHECK(has(r.error(), "image_r 3"));
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

TEST_CASE("images of more than 8 bits are scaled, or refused with the setting that helps") {
  const Recording r;
  const auto fill = [&](const std::string& end, unsigned brightest) {
    for (const char* side : {"image_l", "image_r"})
      for (int k = 0; k < 4; ++k) {
        fs::remove(r.path / side / ("00000" + std::to_string(k) + ".png"));
        cv::Mat1w image(24, 32, static_cast<uint16_t>(brightest));
        if (end == ".png") cv::imwrite((r.path / side / (std::to_string(k) + end)).string(), image);
        else {
          std::string text = "P5\n32 24\n1023\n";
          for (int i = 0; i < 24 * 32; ++i)
            text += {static_cast<char>(brightest >> 8U), static_cast<char>(brightest & 255U)};
          std::ofstream(r.path / side / (std::to_string(k) + end), std::ios::binary) << text;
        }
      }
  };
  const auto first_pixel = [&](int bits) {
    VirtualClock clock;
    auto settings = r.settings();
    settings.bits = bits;
    ReplayCamera camera("camera", settings, clock);
    const auto opened = camera.open();
    if (!opened) return opened.error().text();
    REQUIRE(camera.start(0).has_value());
    std::vector<uint8_t> left(24 * 32), right(24 * 32);
    camera.trigger(0);
    CHECK(camera.read({left.data(), 32, 24, 1}, {right.data(), 32, 24, 1}, 0).status == ReadStatus::ok);
    return std::to_string(left[0]);
  };
  fill(".pgm", 1020);
  CHECK(first_pixel(0) == "254");
  for (const char* side : {"image_l", "image_r"})
    for (int k = 0; k < 4; ++k) fs::remove(r.path / side / (std::to_string(k) + ".pgm"));
  fill(".png", 1020);
  CHECK(has(first_pixel(0), "brightest value 1020"));
  CHECK(has(first_pixel(0), "say `bits: 10`"));
  CHECK(first_pixel(10) == "254");
}

TEST_CASE("times in s, ms, us, ns or as dates give the same stamps, and the unit is reported") {
  const test::TemporaryFolder folder;
  const std::vector<int64_t> expected{0, 100'000'000, 200'000'000, 350'000'000};
  const auto stamps = [&](const std::string& text) {
    const auto times = read_frame_times("camera", folder.write("times.txt", text), 4);
    REQUIRE(times.has_value());
    CHECK(times->stamp_ns == expected);
    return times->note;
  };
  CHECK(stamps("0.0\n0.1\n0.2\n0.35\n").empty());
  CHECK(stamps("1.7e9\n1700000000.1\n1700000000.2\n1700000000.35\n").empty());
  CHECK(has(stamps("7000\n7100\n7200\n7350\n"), "4 times are read as ms"));
  CHECK(has(stamps("0\n100000\n200000\n350000\n"), "read as us"));
  CHECK(has(
      stamps(
          "#timestamp [ns],filename\n1403636579763555584,a.png\n1403636579863555584,b.png\n1403636579963555584,c.png\n"
          "1403636580113555584,d.png\n"),
      "read as ns"));
  CHECK(stamps("2011-09-26 23:59:59.900000000\n2011-09-27 00:00:00.000000000\n2011-09-27 00:00:00.100000000\n"
               "2011-09-27T00:00:00.250000000\n")
            .empty());
  const auto doubted = read_frame_times("camera", folder.write("times.txt", "0\n3\n6\n9\n"), 4);
  REQUIRE(doubted.has_value());
  CHECK(has(doubted->note, "unusual"));
  CHECK(doubted->stamp_ns.back() == 9'000'000'000);
}

TEST_CASE("frames are read in the order of their numbers; files that are no images are reported") {
  const Recording r(12);
  for (const char* side : {"image_l", "image_r"})
    for (int k = 0; k < 12; ++k)
      fs::rename(r.path / side / ("00000" + std::to_string(k) + ".png"), r.path / side / (std::to_string(k) + ".png"));
  r.write("image_l/notes.txt", "a note");
  const auto files = list_directory("camera", r.path);
  REQUIRE(files.has_value());
  for (size_t k = 0; k < 12; ++k) CHECK(files->left[k].stem() == std::to_string(k));
  REQUIRE(files->left_out.size() == 1);
  CHECK(has(files->left_out[0], "notes.txt"));
}

namespace {

/// Folders of two small images each, by names.
struct Foreign : takt::test::TemporaryFolder {
  void images(const std::string& folder, const std::vector<std::string>& names) const {
    fs::create_directories(path / folder);
    for (const std::string& name : names) cv::imwrite((path / folder / name).string(), cv::Mat1b(8, 10, uint8_t{7}));
  }
  StereoFiles files(const fs::path& folder) const {
    auto listed = list_directory("camera", folder);
    REQUIRE_MESSAGE(listed.has_value(), (listed ? "" : listed.error().text()));
    return std::move(*listed);
  }
};

bool reports(const StereoFiles& files, const std::string& words) {
  return std::any_of(files.left_out.begin(), files.left_out.end(), [&](const auto& left) { return has(left, words); });
}

}  // namespace

TEST_CASE("KITTI odometry: grey images, else colour; what is not read is reported") {
  const Foreign r;
  r.images("image_2", {"000000.png", "000001.png"});
  r.images("image_3", {"000000.png", "000001.png"});
  r.write("calib.txt",
          "P0: 1 0 5 0 0 1 4 0 0 0 1 0\nP1: 1 0 5 -1 0 1 4 0 0 0 1 0\n"
          "P2: 10 0 5 6 0 10 4 0 0 0 1 0\nP3: 10 0 5 1 0 10 4 0 0 0 1 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  r.write("times.txt", "0.000000e+00\n1.037875e-01\n");
  fs::create_directory(r.path / "velodyne");
  const StereoFiles colour = r.files(r.path);
  CHECK(colour.left[1].parent_path().filename() == "image_2");
  CHECK(colour.camera.focal_px == 10);
  CHECK(colour.camera.baseline_m == doctest::Approx(0.5));
  CHECK(colour.stamp_ns == std::vector<int64_t>{0, 103'787'500});
  CHECK(reports(colour, "as KITTI odometry; not read: velodyne"));
  r.images("image_0", {"000000.png"});
  r.images("image_1", {"000000.png"});
  r.write("times.txt", "0\n");
  const StereoFiles grey = r.files(r.path);
  CHECK(grey.camera.baseline_m == doctest::Approx(1));
  CHECK(reports(grey, "not read: image_2, image_3, velodyne"));
}

TEST_CASE("KITTI raw: the calibration of the day, times as dates") {
  const Foreign r;
  for (const char* camera : {"image_00", "image_01"}) {
    r.images(std::string("drive/") + camera + "/data", {"0000000000.png", "0000000001.png"});
    r.write(std::string("drive/") + camera + "/timestamps.txt",
            "2011-09-26 14:02:22.000000000\n2011-09-26 14:02:22.103800000\n");
  }
  fs::create_directory(r.path / "drive/oxts");
  CHECK(has(list_directory("camera", r.path / "drive").error().what, "calib_cam_to_cam.txt: cannot be opened"));
  r.write("calib_cam_to_cam.txt",
          "calib_time: 09-Jan-2012 13:57:47\nP_rect_00: 20 0 5 0 0 20 4 0 0 0 1 0\n"
          "P_rect_01: 20 0 5 -10 0 20 4 0 0 0 1 0\n");
  const StereoFiles files = r.files(r.path / "drive");
  CHECK(files.camera.baseline_m == doctest::Approx(0.5));
  CHECK(files.stamp_ns == std::vector<int64_t>{0, 103'800'000});
  CHECK(reports(files, "as KITTI raw; not read: oxts"));
}

TEST_CASE("EuRoC: times from the names, images without a partner are counted, nothing is rectified") {
  const Foreign r;
  r.images("mav0/cam0/data", {"1403636579763555584.png", "1403636579813555456.png", "1403636579863555584.png"});
  r.images("mav0/cam1/data", {"1403636579763555584.png", "1403636579863555584.png"});
  fs::create_directory(r.path / "mav0/imu0");
  for (const fs::path& folder : {r.path, r.path / "mav0"}) {
    const StereoFiles files = r.files(folder);
    CHECK(files.stamp_ns == std::vector<int64_t>{0, 100'000'000});
    CHECK_FALSE(files.rectified);
    CHECK(reports(files, "as EuRoC; not read: imu0"));
    CHECK(reports(files, "1 images of one camera are left out"));
    CHECK(reports(files, "cam0/sensor.yaml"));
  }
  VirtualClock clock;
  ReplayCameraSettings settings;
  settings.directory = r.path;
  ReplayCamera camera("camera", settings, clock);
  REQUIRE(camera.open().has_value());
  CHECK_FALSE(camera.format().rectified);
  CHECK(camera.format().camera.focal_px == 0);
  CHECK(camera.left_out().size() == 3);
}

TEST_CASE("Middlebury 2014: calib.txt brings the camera; TUM RGB-D and folders of no form are refused with words") {
  const Foreign r;
  r.images("", {"im0.png", "im1.png"});
  r.write("calib.txt",
          "cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\n"
          "cam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]\ndoffs=131.111\nbaseline=193.001\nwidth=10\n");
  VirtualClock clock;
  ReplayCameraSettings settings;
  settings.directory = r.path;
  ReplayCamera camera("camera", settings, clock);
  REQUIRE(camera.open().has_value());
  CHECK(camera.format().camera.focal_px == 3997.684);
  CHECK(camera.format().camera.cv_px == 1011.728);
  CHECK(camera.format().camera.baseline_m == doctest::Approx(0.193001));
  REQUIRE(camera.left_out().size() == 1);
  CHECK(has(camera.left_out()[0], "doffs=131.111"));
  const Foreign tum;
  tum.write("rgb.txt", "");
  tum.write("depth.txt", "");
  CHECK(has(list_directory("camera", tum.path).error().text(), "TUM RGB-D"));
  const Foreign none;
  CHECK(has(list_directory("camera", none.path).error().text(), "mav0/cam0/data"));
}
