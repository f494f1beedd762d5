// SPDX-License-Identifier: Apache-2.0
// What recording costs where it costs most: two stereo cameras of 1280 x 960 Bayer pixels at 15 Hz, every byte kept, 20
// s.
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <random>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "rt/msg/image.hpp"
#include "rt/node.hpp"
#include "rt/record/mcap/file_sink.hpp"
#include "rt/record/recorder.hpp"
#include "rt/sched/executor.hpp"
#include "rt/trace/collector.hpp"

namespace takt::bench {

std::vector<Row> run_record(const Options& options);

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kRunNs = 20'000 * kMs;
constexpr Capacity kPair{1280, 960, 1, 0};
constexpr size_t kFrames = 8;

/// A scene of smooth brightness under a Bayer pattern, with the noise of a sensor (standard deviation 2 of 255).
using Frame = std::vector<uint8_t>;
Frame make_frame(std::mt19937& random) {
  Frame frame(kPair.pixels());
  std::normal_distribution<float> noise(0, 2);
  for (uint32_t y = 0; y < kPair.height; ++y)
    for (uint32_t x = 0; x < kPair.width; ++x) {
      const float scene = 90 + 40 * static_cast<float>((x / 97 + y / 61) % 3);
      const float gain = (x % 2 == y % 2) ? 1.0F : (y % 2 == 0 ? 0.8F : 0.6F);
      frame[size_t{y} * kPair.width + x] = static_cast<uint8_t>(scene * gain + noise(random));
    }
  return frame;
}

/// Copies ready frames out, as a driver does from the memory of its device.
class Camera final : public Node {
 public:
  explicit Camera(const std::array<Frame, kFrames>& frames) : frames_(frames) {}
  void setup(Setup&) override {}
  void run(Job& job) override {
    StereoPair* pair = pair_.loan();
    if (pair == nullptr) return;
    pair->width = static_cast<int32_t>(kPair.width);
    pair->height = static_cast<int32_t>(kPair.height);
    pair->channels = 1;
    for (Array<uint8_t>* side : {&pair->left, &pair->right}) {
      const Frame& frame = frames_[(job.index() + (side == &pair->left ? 0 : 3)) % kFrames];
      side->resize(static_cast<uint32_t>(frame.size()));
      std::memcpy(side->data(), frame.data(), frame.size());
    }
    pair_.send(job.release_ns());
  }

 private:
  Output<StereoPair> pair_{this, "pair", "raw"};
  const std::array<Frame, kFrames>& frames_;
};

struct Outcome {
  double lateness_p99_us = 0;
  uint64_t misses = 0;
  std::string granted;
  record::RecordResult written;
};

Plan two_cameras(std::array<Camera, 2>& cameras, Policy policy) {
  Plan plan;
  plan.policy = policy;
  for (size_t i = 0; i < cameras.size(); ++i) {
    PortPlan port;
    port.node = "camera" + std::to_string(i);
    port.port = "pair";
    port.type = &cameras[i].outputs()[0]->type();
    port.capacity = kPair;
    port.history = 6;
    port.held = port.readers = 1;
    TaskPlan task;
    task.name = port.node;
    task.node = &cameras[i];
    task.device = true;
    task.rate = Rate{15, 1};
    task.offset_ns = static_cast<int64_t>(i) * 20 * kMs;
    task.deadline_ns = 60 * kMs;
    task.budget_ns = 15 * kMs;
    task.ports = {i};
    plan.ports.push_back(port);
    plan.tasks.push_back(task);
  }
  return plan;
}

/// `file` empty: not recorded.
Outcome one_run(const std::array<Frame, kFrames>& frames, const std::filesystem::path& file) {
  std::array<Camera, 2> cameras{Camera(frames), Camera(frames)};
  const Plan plan = two_cameras(cameras, Policy::deadline);
  MonotonicClock clock;
  const auto transport = make_local_transport(plan.ports);
  RunBoard board(plan);
  std::optional<mcap::FileSink> sink;
  std::unique_ptr<record::Recorder> recorder;
  std::optional<trace::Rings> rings;
  std::optional<trace::Collector> collector;
  if (!file.empty()) {
    auto opened = mcap::FileSink::open(file);
    if (!opened) throw CannotRun(opened.error());
    sink.emplace(std::move(*opened));
    recorder =
        std::make_unique<record::Recorder>(plan, board, *transport, *sink, record::Head{}, record::Recorder::Options{});
    rings.emplace(plan.tasks.size() + 4);
    trace::Collector::Options heard;
    heard.best = trace::Source::none;
    heard.records_kept = 0;
    heard.listener = [&](int32_t thread, const trace::Event& event) { recorder->take(thread, event); };
    collector.emplace(*rings, heard);
  }
  Executor::Options how;
  how.duration_ns = kRunNs;
  how.board = &board;
  how.trace = rings ? &*rings : nullptr;
  Executor executor(plan, *transport, clock, how);
  const RunResult result = executor.run();
  Outcome outcome;
  for (const auto& task : executor.tasks()) {
    const int64_t p99 = task->statistics().lateness.quantile_ns(0.99);
    outcome.lateness_p99_us = std::max(outcome.lateness_p99_us, static_cast<double>(p99) / 1e3);
    outcome.misses += task->statistics().deadline_misses;
  }
  outcome.granted = to_string(result.policy_granted);
  if (collector) collector->finish();
  if (recorder) outcome.written = recorder->finish({});
  return outcome;
}

}  // namespace

std::vector<Row> run_record(const Options& options) {
  std::mt19937 random(1);
  std::array<Frame, kFrames> frames;
  for (Frame& frame : frames) frame = make_frame(random);
  std::string name = (std::filesystem::temp_directory_path() / "takt-bench-XXXXXX").string();
  const int descriptor = mkstemp(name.data());
  if (descriptor < 0) throw CannotRun("no temporary file can be made in " + name);
  close(descriptor);
  Samples mb_s, copying, writing, lost;
  std::string granted;
  const auto recorded = [&] {
    std::fprintf(stderr, "record: 20 s of two cameras, recorded\n");
    const Outcome outcome = one_run(frames, name);
    constexpr double seconds = static_cast<double>(kRunNs) / 1e9;
    mb_s.add(static_cast<double>(outcome.written.bytes) / 1e6 / seconds);
    copying.add(static_cast<double>(outcome.written.capture_cpu_ns) / 1e7 / seconds);
    writing.add(static_cast<double>(outcome.written.write_cpu_ns) / 1e7 / seconds);
    lost.add(static_cast<double>(outcome.written.lost()));
    granted = outcome.granted + ", " + std::to_string(outcome.written.messages) + " pairs, " +
              std::to_string(outcome.misses) + " misses";
    return outcome.lateness_p99_us;
  };
  const Compared figures = compare(
      static_cast<size_t>(options.rounds_or(2)), [&] { return one_run(frames, {}).lateness_p99_us; }, recorded);
  std::error_code ignored;
  std::filesystem::remove(name, ignored);
  std::vector<Row> rows;
  const auto row = [&](const char* what, const char* unit, const Samples& samples) {
    rows.push_back({what, unit, samples.quantile(0.5).value_or(0), samples, {}, {}, {}, granted});
  };
  row("record/cameras/written", "MB/s", mb_s);
  row("record/cameras/copying", "% of a CPU", copying);
  row("record/cameras/writing", "% of a CPU", writing);
  row("record/cameras/lost", "records", lost);
  add_pair(rows, {"record/cameras/lateness_p99", "us", 0, figures.changed, {}, {}, {}, granted},
           "the same run, not recorded", figures.pairs);
  return rows;
}

}  // namespace takt::bench
