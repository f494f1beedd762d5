// SPDX-License-Identifier: Apache-2.0
// The thin node: what it sends for rectified, raw and unusable pairs, and at a lower quality level.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "nodes/stereo/calibration_file.hpp"
#include "nodes/stereo/rectify.hpp"
#include "rt/msg/disparity.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/node.hpp"
#include "rt/sched/port_access.hpp"
#include "tests/temporary_folder.hpp"

namespace takt {
void register_stereo(NodeTypes& types);
}

using namespace takt;

namespace {

struct Free {
  void operator()(void* p) const { std::free(p); }
};

/// One message in its chunk, as a transport would hold it.
struct Chunk {
  std::unique_ptr<void, Free> memory;
  Chunk(const MessageType& type, const Capacity& capacity) {
    const size_t bytes = (sizeof(MessageHeader) + type.bytes(capacity) + 63) / 64 * 64;
    memory.reset(std::aligned_alloc(64, bytes));
    new (memory.get()) MessageHeader;
    type.place(header() + 1, capacity);
  }
  MessageHeader* header() const { return static_cast<MessageHeader*>(memory.get()); }
  template <class T>
  T& as() const {
    return *reinterpret_cast<T*>(header() + 1);
  }
};

struct OneChunkWriter final : Writer {
  Chunk chunk;
  using Writer::Writer;
  explicit OneChunkWriter(const OutputPort& port) : chunk(port.type(), port.capacity()) {}
  MessageHeader* loan() override { return chunk.header(); }
  void publish(int64_t, int64_t, int64_t) override {}
  void discard() override {}
  bool repeat(int64_t, int64_t) override { return false; }
  WriterStatistics statistics() const override { return {}; }
};

/// The node with a 96 x 40 colour pair of noise in which the right image is the left one shifted by 12 px.
class Bench {
 public:
  static constexpr int kWidth = 96, kHeight = 40, kShift = 12;
  /// With another number of channels the images are left empty.
  explicit Bench(const std::vector<std::pair<const char*, ParamValue>>& params = {}, uint32_t channels = 3)
      : capacity_{kWidth, kHeight, channels, 0}, input_(MessageType::of<StereoPair>(), capacity_) {
    register_stereo(types_);
    node_ = types_.find("stereo")->make();
    for (const auto& [name, value] : params)
      for (ParamBase* p : node_->params())
        if (p->name() == name) REQUIRE(p->set(value).has_value());
    PortAccess::connect(*node_->inputs()[0], capacity_);
    for (OutputPort* out : node_->outputs()) PortAccess::mark_read(*out);
    StereoPair& pair = input_.as<StereoPair>();
    pair.width = kWidth;
    pair.height = kHeight;
    pair.channels = static_cast<int32_t>(channels);
    pair.frame_number = 5;
    pair.camera = {100, 48, 20, 0.24};
    pair.left.resize(kWidth * kHeight * channels);
    pair.right.resize(kWidth * kHeight * channels);
    if (channels != 3) return;
    uint32_t state = 1;
    for (uint8_t& v : pair.left.items()) v = static_cast<uint8_t>((state = state * 1664525 + 1013904223) >> 24);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int c = 0; c < 3; ++c) pair.right_view().at(x, y, c) = pair.left_view().at((x + kShift) % kWidth, y, c);
  }

  void setup() {
    Setup setup{clock_, ".", ".", 0, Rate{15, 1}};
    node_->setup(setup);
    node_->end_setup();
    for (OutputPort* out : node_->outputs()) {
      writers_.push_back(std::make_unique<OneChunkWriter>(*out));
      PortAccess::attach(*out, writers_.back().get());
    }
  }

  /// As `takt set` does between two jobs; false where the parameter cannot change any more.
  bool set(std::string_view name, const ParamValue& value) {
    for (ParamBase* p : node_->params())
      if (p->name() == name) return p->live() && p->set(value).has_value();
    return false;
  }

  /// True if the job had a result.
  bool run(int level = 0, bool is_new = true) {
    Held held;
    held.header = input_.header();
    held.sequence = 1;
    held.stamp_ns = 777;
    PortAccess::held(*node_->inputs()[0])[0] = held;
    PortAccess::set_held(*node_->inputs()[0], 1, false, is_new ? 0 : 1);
    for (OutputPort* out : node_->outputs()) PortAccess::reset(*out);
    Job job(clock_, 0, 0, 1000, level, "full");
    node_->run(job);
    notice_ = job.result_notice();
    return !job.without_result();
  }
  /// What the last job said of its results.
  const std::optional<ResultNotice>& notice() const { return notice_; }

  StereoPair& pair() { return input_.as<StereoPair>(); }
  bool sent(size_t i) const {
    return PortAccess::sent(*node_->outputs()[i]) && PortAccess::stamp_ns(*node_->outputs()[i]) == 777;
  }
  template <class T>
  T& output(size_t i) {
    return writers_[i]->chunk.as<T>();
  }

 private:
  Capacity capacity_;
  VirtualClock clock_;
  NodeTypes types_;
  std::unique_ptr<Node> node_;
  Chunk input_;
  std::optional<ResultNotice> notice_;
  std::vector<std::unique_ptr<OneChunkWriter>> writers_;
};

}  // namespace

TEST_CASE("a rectified pair gives its copy, the disparity and a cloud, all with its stamp") {
  Bench bench({{"disparities", int64_t{32}}, {"cloud_step", int64_t{3}}});
  bench.setup();
  REQUIRE(bench.run());
  for (size_t i = 0; i < 3; ++i) CHECK(bench.sent(i));
  const auto& rectified = bench.output<StereoPair>(0);
  CHECK(rectified.frame_number == 5);
  CHECK(rectified.camera.focal_px == 100);
  CHECK(rectified.right[100] == bench.pair().right[100]);
  const auto& map = bench.output<DisparityMap>(1);
  CHECK(map.disparities == 32);
  for (int y = 0; y < Bench::kHeight; ++y)
    for (int x = Bench::kShift + 8; x < Bench::kWidth - 8; ++x) REQUIRE(map.view().at(x, y) == Bench::kShift);
  const auto& cloud = bench.output<PointCloud>(2);
  CHECK(cloud.points.size > 0);
  CHECK(cloud.points.size == cloud.colours.size);
  CHECK(cloud.points.size <= 32 * 14);
  bool at_two_metres = false;  // 100 px * 0.24 m / 12 px
  for (const Point& p : cloud.points.items()) at_two_metres = at_two_metres || p.z == doctest::Approx(2.0);
  CHECK(at_two_metres);
}

TEST_CASE("a lower level matches at half resolution: even disparities of the same scene") {
  Bench bench({{"disparities", int64_t{33}}});
  bench.setup();
  REQUIRE(bench.run(1));
  const auto& map = bench.output<DisparityMap>(1);
  int right = 0, all = 0;
  for (int y = 0; y < Bench::kHeight; ++y)
    for (int x = 40; x < 80; ++x, ++all) {
      REQUIRE((map.view().at(x, y) == -1 || map.view().at(x, y) % 2 == 0));
      right += map.view().at(x, y) == Bench::kShift;
    }
  CHECK(right > all * 9 / 10);
}

TEST_CASE("`search` narrows the range between two jobs, at both levels, and gives it back") {
  Bench bench({{"disparities", int64_t{32}}});
  bench.setup();
  const auto largest = [&](int level) {
    REQUIRE(bench.run(level));
    const auto& map = bench.output<DisparityMap>(1);
    int most = -1;
    for (const int16_t d : map.disparity.items()) most = std::max(most, int{d});
    return std::pair(map.disparities, most);
  };
  CHECK(largest(0).first == 32);
  CHECK(bench.set("search", int64_t{10}));
  for (const int level : {0, 1}) {
    CHECK(largest(level).first == 10);
    CHECK(largest(level).second < 10);
  }
  CHECK(bench.set("search", int64_t{500}));  // not beyond what memory was taken for
  CHECK(largest(0).first == 32);
  CHECK(largest(0).second >= Bench::kShift);
}

TEST_CASE("level 2 searches half of the range, and level 0 all of it again") {
  Bench bench({{"disparities", int64_t{33}}});
  bench.setup();
  const auto found = [&](int level) {
    REQUIRE(bench.run(level));
    const auto& map = bench.output<DisparityMap>(1);
    int right = 0, all = 0;
    for (int y = 0; y < Bench::kHeight; ++y)
      for (int x = 40; x < 80; ++x, ++all) {
        REQUIRE(map.view().at(x, y) < map.disparities);
        right += map.view().at(x, y) == Bench::kShift;
      }
    return std::pair(map.disparities, right > all * 9 / 10);
  };
  CHECK(found(0) == std::pair(33, true));
  CHECK(found(2) == std::pair(17, true));
  CHECK(found(1) == std::pair(33, true));
  CHECK(bench.set("search", int64_t{16}));
  CHECK(found(2) == std::pair(8, false));  // the scene lies nearer
  CHECK(found(0) == std::pair(16, true));
}

TEST_CASE("nothing new, another size, or a raw pair without calibration: no result, nothing sent") {
  Bench bench({{"disparities", int64_t{16}}});
  bench.setup();
  CHECK_FALSE(bench.run(0, false));
  CHECK_FALSE(bench.notice());
  bench.pair().camera = {};
  CHECK_FALSE(bench.run());
  REQUIRE(bench.notice());
  CHECK(bench.notice()->wrong);
  CHECK(std::string(bench.notice()->why.text()).find("`calibration` is not set") != std::string::npos);
  CHECK_FALSE(bench.run());
  CHECK_FALSE(bench.notice());  // once is enough
  bench.pair().camera.focal_px = 100;
  bench.pair().width = 95;
  CHECK_FALSE(bench.run());
  for (size_t i = 0; i < 3; ++i) CHECK_FALSE(bench.sent(i));
  Bench fresh;
  fresh.setup();
  fresh.pair().width = 95;
  CHECK_FALSE(fresh.run());
  REQUIRE(fresh.notice());
  CHECK(std::string(fresh.notice()->why.text()) ==
        "a pair of 95 x 40 px and 3 channels is not matched; those of 96 x 40, 3 are");
}

TEST_CASE("a raw mosaic becomes a rectified colour pair, and is matched as one") {
  const takt::test::TemporaryFolder folder;
  stereo::StereoCalibration cameras;
  cameras.width = Bench::kWidth;
  cameras.height = Bench::kHeight;
  cameras.left_matrix = cameras.right_matrix = {100, 0, 48, 0, 100, 20, 0, 0, 1};
  cameras.left_distortion = cameras.right_distortion = {-0.05, 0, 0, 0, 0};
  cameras.translation_m = {-0.24, 0, 0};
  const std::string file = folder.path / "rig.yaml";
  stereo::write_calibration(file, cameras, "");
  Bench bench({{"disparities", int64_t{32}}, {"calibration", file}, {"bayer", std::string("gbrg")}}, 1);
  bench.setup();
  StereoPair& pair = bench.pair();
  pair.camera = {};
  uint32_t state = 1;
  for (uint8_t& v : pair.left.items()) v = static_cast<uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  for (int y = 0; y < Bench::kHeight; ++y)
    for (int x = 0; x < Bench::kWidth; ++x)
      pair.right_view().at(x, y) = pair.left_view().at((x + Bench::kShift) % Bench::kWidth, y);
  REQUIRE(bench.run());
  const auto& rectified = bench.output<StereoPair>(0);
  CHECK(rectified.channels == 3);
  CHECK(rectified.camera.baseline_m == doctest::Approx(0.24));
  std::vector<uint8_t> left(Bench::kWidth * Bench::kHeight * 3), right = left;
  stereo::Rectifier rectifier(cameras, stereo::BayerPattern::gbrg);
  REQUIRE(rectifier.rectify(std::as_const(pair).left_view(), std::as_const(pair).right_view(),
                            {left.data(), Bench::kWidth, Bench::kHeight, 3},
                            {right.data(), Bench::kWidth, Bench::kHeight, 3}));
  CHECK(std::equal(left.begin(), left.end(), rectified.left.data()));
  CHECK(std::equal(right.begin(), right.end(), rectified.right.data()));
  CHECK(bench.sent(1));
  pair.camera.focal_px = 100;  // one channel and rectified: nothing that this node was set up for
  CHECK_FALSE(bench.run());
}

TEST_CASE("rows that differ are told once, with the figure, if they are watched") {
  for (const bool watched : {true, false}) {
    Bench bench({{"disparities", int64_t{32}}, {"row_check", watched}});
    bench.setup();
    StereoPair& pair = bench.pair();
    const auto texture = [](int x, int y) {
      double sum = 0;
      for (int i = 1; i < 9; ++i) sum += std::sin(0.4 * x * std::cos(i) + 0.4 * y * std::sin(i) + i * i);
      return static_cast<uint8_t>(128 + 15 * sum);
    };
    const auto fill = [&](int down) {
      for (int y = 0; y < Bench::kHeight; ++y)
        for (int x = 0; x < Bench::kWidth; ++x)
          for (int c = 0; c < 3; ++c) {
            pair.left_view().at(x, y, c) = texture(x, y);
            pair.right_view().at(x, y, c) = texture(x + Bench::kShift, y - down);
          }
    };
    const auto notices = [&](int jobs) {
      std::vector<ResultNotice> all;
      for (int i = 0; i < jobs; ++i) {
        REQUIRE(bench.run());
        if (bench.notice()) all.push_back(*bench.notice());
      }
      return all;
    };
    fill(0);
    CHECK(notices(30).empty());
    fill(2);
    const auto told = notices(300);
    if (!watched) {
      CHECK(told.empty());
      continue;
    }
    REQUIRE(told.size() >= 1);
    CHECK(told.size() <= 2);  // doubtful perhaps on the way, then wrong
    CHECK(told.back().wrong);
    CHECK(std::string(told.back().why.text()).find(" px (median of ") != std::string::npos);
  }
}

TEST_CASE("settings that cannot work stop the start") {
  CHECK_THROWS_AS(Bench({{"bayer", std::string("rggb")}, {"calibration", std::string("any.yaml")}}).setup(),
                  SetupError);
  CHECK_THROWS_AS(Bench({{"bayer", std::string("rggb")}}, 1).setup(), SetupError);
  CHECK_THROWS_AS(Bench({{"n_square", int64_t{4}}}).setup(), SetupError);
  CHECK_THROWS_AS(Bench({{"calibration", std::string("no_such_file.yaml")}}).setup(), SetupError);
  CHECK_THROWS_AS(Bench({{"cost", std::string("ssd")}, {"c_max", int64_t{226}}}).setup(), SetupError);
}

TEST_CASE("sub-pixel fractions come with the disparities if they are asked for, by every matcher, at every level") {
  for (const char* selection : {"winner", "semi_global", "scanline"}) {
    const bool paths = std::string_view(selection) == "semi_global";
    Bench bench({{"disparities", int64_t{32}},
                 {"selection", std::string(selection)},
                 {"cost", std::string(paths ? "census" : "gradient")},
                 {"n_square", int64_t{paths ? 1 : 9}},
                 {"n_min", int64_t{1}},
                 {"subpixel", true}});
    bench.setup();
    for (const int level : {0, 1}) {
      CAPTURE(selection);
      REQUIRE(bench.run(level));
      const auto& map = bench.output<DisparityMap>(1);
      REQUIRE(map.fraction.size == map.disparity.size);
      int near = 0, all = 0;
      for (int y = 4; y < Bench::kHeight - 4; ++y)
        for (int x = 44; x < 76; ++x, ++all)
          near += std::abs(map.view().at(x, y) + (map.fraction_view().at(x, y) - 32) / 64.0 - Bench::kShift) < 0.6;
      CHECK(near > all * 9 / 10);
    }
  }
  Bench whole;
  whole.setup();
  REQUIRE(whole.run());
  CHECK(whole.output<DisparityMap>(1).fraction.size == 0);
}
