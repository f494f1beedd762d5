// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/flight_recorder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <ctime>
#include <system_error>

#include "graph/flight/left_runs.hpp"

namespace takt::flight {
namespace {

namespace fs = std::filesystem;

/// A second's worth of what is small.
constexpr size_t kQueueBytes = 8 << 20, kImageQueueBytes = 64 << 20;
constexpr size_t kChunkBytes = 256 << 10;
constexpr size_t kSentences = 20;
/// Until a window is written, and for the snapshots before it.
constexpr int64_t kWait_ns = 10'000'000'000;

/// "ace-20261129-184012-4711": runs sort by their start.
std::string name_of_run(const std::string& graph) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char at[32];
  std::strftime(at, sizeof at, "%Y%m%d-%H%M%S", &utc);
  return fmt::format("{}-{}-{}", graph, at, getpid());
}

/// With how many causes it stands for.
std::string sentence_of(const Frozen& frozen) {
  const uint64_t others = frozen.also.size() + frozen.more;
  return others == 0 ? frozen.sentence : fmt::format("{}; and {} more", frozen.sentence, others);
}

}  // namespace

FlightRecorder::FlightRecorder(const graph::GraphSpec& graph, const Plan& plan, const RunBoard& board,
                               Transport& transport, record::Head head, Options options)
    : options_(std::move(options)), board_(board), triggers_(graph, plan), places_(places(graph.record, plan)) {
  const graph::RecordSpec& spec = graph.record;
  const std::string name = name_of_run(graph.name);
  record::RingLimits limits;
  limits.bytes = static_cast<uint64_t>(spec.disk_bytes);
  limits.age_ns = spec.keep_ns;
  auto disk = record::Ring::open(options_.folder / "ring", name, limits);
  if (!disk) {
    lacks_ = disk.error();
    return;
  }
  disk_ = std::move(*disk);
  doubts_ = flight::doubts(spec, places_, options_.folder);
  if (const int64_t memory_bytes = memory_to_use(spec); places_.in_memory() && memory_bytes > 0) {
    in_memory_ = memory_place(name);
    for (const fs::path& cleared : clear_memory())
      if (options_.say)
        options_.say(fmt::format("removed what a run that was killed left in memory: {}", cleared.string()));
    limits.bytes = static_cast<uint64_t>(memory_bytes);
    limits.split_ns = 1'000'000'000;
    limits.durable = false;
    auto memory = record::Ring::open(in_memory_, name, limits);
    auto lock = WriterLock::of_folder(in_memory_);
    if (lock) memory_lock_.emplace(std::move(*lock));
    if (memory) memory_ = std::move(*memory);
    else doubts_.push_back("record: no images and clouds are kept: " + memory.error());
  }
  evidence_ = std::make_unique<Evidence>(graph, plan, board, spec.before_ns + 2 * spec.after_ns + kWait_ns);
  freezer_ = std::make_unique<Freezer>(*disk_, memory_.get(), freezing(spec, plan, name));
  const auto note = [this](const std::optional<Cause>& cause) {
    if (cause) freezer_->freeze(*cause);
  };
  head.facts["states_ns"] = std::to_string(places_.states_ns);
  record::Recorder::Options how;
  how.by_caller = options_.by_caller;
  how.priority = options_.priority;
  how.queue_bytes = kQueueBytes;
  how.file.chunk_bytes = kChunkBytes;
  how.ports = places_.disk;
  how.snapshot_every_ns = spec.state_every_ns();
  how.listener = {[this, note](const record::RecordedJob& job) { note(triggers_.of(job)); },
                  [this, note](size_t port, const Held& held) { note(triggers_.of(port, held)); },
                  [this, note](const record::RecordedEvent& event) { note(triggers_.of(event)); }};
  recorder_ = std::make_unique<record::Recorder>(plan, board, transport, *disk_, head, how);
  if (!memory_) return;
  how.ports = places_.memory;
  how.jobs = false;
  how.queue_bytes = kImageQueueBytes;
  how.file.compression = mcap::Compression::none;
  how.listener = {};
  images_ = std::make_unique<record::Recorder>(plan, board, transport, *memory_, head, std::move(how));
}

Freezer::Options FlightRecorder::freezing(const graph::RecordSpec& spec, const Plan& plan, const std::string& run) {
  Freezer::Options freezing;
  freezing.folder = frozen_folder();
  freezing.name = run;
  freezing.before_ns = spec.before_ns;
  freezing.after_ns = spec.after_ns;
  freezing.most_bytes = static_cast<uint64_t>(spec.frozen_bytes);
  freezing.lead_ns = lead_ns(spec);
  for (const TaskPlan& task : plan.tasks) {
    auto& edges = freezing.edges.emplace_back();
    for (const EdgePlan& edge : task.edges)
      edges.push_back(plan.ports[edge.port].node + "." + plan.ports[edge.port].port);
  }
  freezing.say = [this](const Cause& cause, int64_t from_ns, int64_t to_ns) {
    return evidence_->say(cause, from_ns, to_ns);
  };
  freezing.told = [this](const Frozen& frozen) { tell(frozen); };
  return freezing;
}

FlightRecorder::~FlightRecorder() { finish({}, 0); }

void FlightRecorder::take(int32_t ring, const trace::Event& event) {
  if (recorder_) recorder_->take(ring, event);
  if (evidence_) evidence_->note(ring, event);
  look_for_outages();
}

void FlightRecorder::capture() {
  if (recorder_) recorder_->capture();
  if (images_) images_->capture();
}

void FlightRecorder::take_rest() {
  if (recorder_) recorder_->take_rest();
  if (images_) images_->take_rest();
}

void FlightRecorder::look_for_outages() {
  if (!freezer_ || board_.outages().size() == outages_seen_) return;
  for (; outages_seen_ < board_.outages().size(); ++outages_seen_) {
    const Outage& outage = board_.outages()[outages_seen_];
    const std::string process = outage.process < options_.processes.size() ? options_.processes[outage.process] : "all";
    freezer_->freeze(triggers_.of(outage, process));
  }
}

void FlightRecorder::finish(const mcap::Metadata& facts, uint64_t unheard_threads) {
  if (!recorder_) return;
  kept_ = recorder_->finish(facts, unheard_threads);
  if (images_) kept_images_ = images_->finish(facts);
  recorder_.reset();
  images_.reset();
  frozen_ = freezer_->finish();
  std::error_code error;
  if (!in_memory_.empty()) fs::remove_all(in_memory_, error);
}

std::vector<std::string> FlightRecorder::sentences() const {
  const std::lock_guard lock(mutex_);
  return sentences_;
}

void FlightRecorder::tell(const Frozen& frozen) {
  {
    const std::lock_guard lock(mutex_);
    if (sentences_.size() == kSentences) sentences_.erase(sentences_.begin());
    sentences_.push_back(frozen.file.empty() ? fmt::format("not: {}", frozen.refused) : sentence_of(frozen));
  }
  if (!options_.say) return;
  if (frozen.file.empty()) options_.say(fmt::format("not frozen ({}): {}", frozen.cause.what, frozen.refused));
  else options_.say(fmt::format("frozen: {} ({})", frozen.file.string(), sentence_of(frozen)));
}

nlohmann::ordered_json FlightRecorder::told() const {
  nlohmann::ordered_json frozen = nlohmann::ordered_json::array();
  const auto at_s = [&](const Cause& cause) { return static_cast<double>(cause.at_ns - board_.epoch_ns()) / 1e9; };
  for (const Frozen& one : frozen_) {
    nlohmann::ordered_json also = nlohmann::ordered_json::array();
    for (const Cause& cause : one.also)
      also.push_back({{"kind", cause.kind}, {"subject", cause.subject}, {"what", cause.what}, {"at_s", at_s(cause)}});
    frozen.push_back({{"kind", one.cause.kind},
                      {"subject", one.cause.subject},
                      {"what", one.cause.what},
                      {"sentence", one.sentence},
                      {"at_s", at_s(one.cause)},
                      {"also", std::move(also)},
                      {"more", one.more},
                      {"file", one.file.filename().string()},
                      {"mb", static_cast<double>(one.bytes) / 1e6},
                      {"damages", one.damages},
                      {"refused", one.refused}});
  }
  const auto ring = [](const record::Ring* of, const record::RecordResult& kept) -> nlohmann::ordered_json {
    if (of == nullptr) return nullptr;
    return {{"files", of->files().size()},
            {"mb", static_cast<double>(of->bytes()) / 1e6},
            {"most_mb", static_cast<double>(of->most_bytes()) / 1e6},
            {"dropped_files", of->dropped()},
            {"lost", kept.lost()},
            {"refused", kept.refused},
            {"cpu_ms", static_cast<double>(kept.capture_cpu_ns + kept.write_cpu_ns) / 1e6}};
  };
  return {{"folder", options_.folder.string()},
          {"lacks", lacks_},
          {"doubts", doubts_},
          {"disk", ring(disk_.get(), kept_)},
          {"memory", ring(memory_.get(), kept_images_)},
          {"frozen", frozen}};
}

}  // namespace takt::flight
