// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "graph/explain/trace_file.hpp"

namespace takt::explain {
namespace {

using trace::Slice;

/// What is wrong with the file.
struct Wrong : std::runtime_error {
  using std::runtime_error::runtime_error;
};

constexpr int64_t kLatestNs = 4'000'000'000'000'000'000;  // instants beyond would overflow when subtracted
constexpr size_t kMostCpus = 8192;                        // the most that Linux is built for

/// Reads what write_trace wrote. Json's own exceptions (a key that is missing, of another kind) become Wrong.
class Reader {
 public:
  explicit Reader(const Json& file) : file_(file) {}

  TraceFile read() {
    if (!file_.is_object() || !file_.contains("traceEvents") || !file_.contains("otherData"))
      throw Wrong("is no trace of a run");
    result_.head = file_["otherData"];
    read_facts(result_.head);
    for (const Json& event : file_["traceEvents"]) read_event(event);
    const auto by_start = [](const auto& a, const auto& b) { return a.from_ns < b.from_ns; };
    std::stable_sort(result_.trace.slices.begin(), result_.trace.slices.end(), by_start);
    std::stable_sort(result_.trace.jobs.begin(), result_.trace.jobs.end(),
                     [](const auto& a, const auto& b) { return a.start_ns < b.start_ns; });
    return std::move(result_);
  }

 private:
  static int64_t whole(const Json& value) {
    if (!value.is_number_integer()) throw Wrong(fmt::format("has {} where a whole number belongs", value.type_name()));
    return value.get<int64_t>();
  }

  template <class T>
  static T number(const Json& value) {
    const int64_t number = whole(value);
    if (!std::in_range<T>(number)) throw Wrong(fmt::format("has a number out of range: {}", number));
    return static_cast<T>(number);
  }

  static int64_t instant(const Json& value) { return instant(whole(value)); }
  static int64_t instant(int64_t ns) {
    if (ns > kLatestNs || ns < -kLatestNs) throw Wrong(fmt::format("has an instant out of range: {}", ns));
    return ns;
  }

  int64_t from_us(const Json& value) const { return instant(span_us(value) + result_.trace.epoch_ns); }
  static int64_t span_us(const Json& value) {
    const double ns = value.get<double>() * 1e3;
    if (!(std::abs(ns) < 1e18)) throw Wrong("has an instant out of range");
    return std::llround(ns);
  }

  static size_t index(const Json& value, size_t size, const char* what) {
    const int64_t i = whole(value);
    if (i < 0 || static_cast<uint64_t>(i) >= size) throw Wrong(fmt::format("names {} {} of {}", what, i, size));
    return static_cast<size_t>(i);
  }

  /// Tracks are counted from 1: track k is entry k - 1.
  static size_t track_index(const Json& event, size_t size, const char* what) {
    const int64_t track = whole(event.at("tid"));
    if (track < 1 || static_cast<uint64_t>(track) > size)
      throw Wrong(fmt::format("has an event on track {}, which is no {}'s (1 to {})", track, what, size));
    return static_cast<size_t>(track - 1);
  }

  void read_facts(const Json& head) {
    trace::Trace& trace = result_.trace;
    const std::string source = head.at("source_of_preemption");
    for (const auto known : {trace::Source::tracefs, trace::Source::perf, trace::Source::simulation})
      if (source == trace::to_string(known)) trace.source = known;
    trace.source_note = head.at("source_note");
    trace.policy = head.at("policy_granted");
    trace.epoch_ns = instant(head.at("epoch_ns"));
    trace.end_ns = instant(head.at("end_ns"));
    trace.first_ns = instant(head.at("first_ns"));
    const Json& lost = head.at("lost");
    trace.losses = {number<uint64_t>(lost.at("events")), number<uint64_t>(lost.at("switches")),
                    number<uint64_t>(lost.at("forgotten")), number<uint64_t>(lost.at("threads"))};
    trace.ports = head.at("ports").get<std::vector<std::string>>();
    for (const Json& task : head.at("tasks")) read_task(task);
    for (const Json& thread : head.at("threads"))
      trace.threads.push_back({number<int32_t>(thread.at(0)), thread.at(1)});
    for (const Json& steal : head.at("steals"))
      trace.steals.push_back(
          {instant(steal.at(0)), instant(steal.at(1)), instant(steal.at(2)), number<int>(steal.at(3))});
  }

  void read_task(const Json& json) {
    trace::Trace& trace = result_.trace;
    trace::TaskFacts task;
    task.name = json.at("name");
    task.lane = json.at("lane");
    task.deadline_ns = instant(json.at("deadline_ns"));
    task.budget_ns = instant(json.at("budget_ns"));
    task.high = json.at("high");
    for (const Json& edge : json.at("edges"))
      task.edges.push_back({edge.at("input"), index(edge.at("port"), trace.ports.size(), "port")});
    for (const Json& port : json.at("ports")) task.ports.push_back(index(port, trace.ports.size(), "port"));
    trace.tasks.push_back(std::move(task));
  }

  void read_event(const Json& event) {
    if (!event.is_object()) throw Wrong("has an event that is no object");
    const std::string category = event.value("cat", "");
    if (category == "job") read_job(event);
    if (category == "mark") read_mark(event);
    if (category == "cpu") read_slice(event);
  }

  void read_job(const Json& event) {
    trace::Trace& trace = result_.trace;
    const Json& args = event.at("args");
    trace::JobSpan job;
    job.task = static_cast<uint16_t>(track_index(event, trace.tasks.size(), "node"));
    job.job = number<uint32_t>(args.at("job"));
    job.release_ns = instant(args.at("release_ns"));
    job.deadline_ns = instant(args.at("deadline_ns"));
    job.start_ns = instant(args.at("start_ns"));
    job.finish_ns = instant(args.at("finish_ns"));
    job.published_ns = instant(args.at("published_ns"));
    job.cpu_ns = instant(args.at("cpu_ns"));
    if (job.published_ns < job.start_ns) throw Wrong(fmt::format("has job {} that ends before it starts", job.job));
    job.thread = number<int32_t>(args.at("thread"));
    job.start_cpu = number<int>(args.at("start_cpu"));
    job.cpu = number<int>(args.at("cpu"));
    job.level = number<int>(args.at("level"));
    job.late = args.at("late");
    const trace::TaskFacts& task = trace.tasks[job.task];
    for (const Json& l : args.at("latched"))
      job.latched.push_back({static_cast<uint8_t>(index(l.at(0), task.edges.size(), "edge")), number<uint64_t>(l.at(1)),
                             instant(l.at(2))});
    for (const Json& p : args.at("published"))
      job.published.push_back({static_cast<uint8_t>(index(p.at(0), task.ports.size(), "output")),
                               number<uint64_t>(p.at(1)), instant(p.at(2))});
    trace.jobs.push_back(std::move(job));
  }

  void read_mark(const Json& event) {
    static const std::map<std::string, trace::Kind> kinds{{"release skipped", trace::Kind::skip},
                                                          {"budget overrun", trace::Kind::overrun},
                                                          {"level", trace::Kind::level},
                                                          {"mode", trace::Kind::mode}};
    const auto kind = kinds.find(event.at("name").get<std::string>());
    if (kind == kinds.end()) return;
    const Json& args = event.at("args");
    const size_t task =
        whole(event.at("tid")) == 0 ? trace::kNoTask : track_index(event, result_.trace.tasks.size(), "node");
    result_.trace.marks.push_back({kind->second, instant(args.at("at_ns")), instant(args.at("value")),
                                   instant(args.at("extra")), number<uint32_t>(args.at("job")),
                                   static_cast<uint16_t>(task)});
  }

  void read_slice(const Json& event) {
    const Json& args = event.at("args");
    Slice slice;
    slice.from_ns = from_us(event.at("ts"));
    slice.to_ns = instant(slice.from_ns + span_us(event.at("dur")));
    if (slice.to_ns < slice.from_ns) throw Wrong("has a stretch on a CPU that ends before it starts");
    slice.woken_ns = args.contains("woken_us") ? from_us(args.at("woken_us")) : 0;
    slice.thread = number<int32_t>(args.at("thread"));
    slice.priority = number<int32_t>(args.at("priority"));
    slice.cpu = static_cast<int32_t>(track_index(event, kMostCpus, "CPU"));
    const std::string end = args.at("end");
    slice.end = end == "preempted" ? Slice::End::preempted : end == "asleep" ? Slice::End::asleep : Slice::End::open;
    slice.name = name(event.at("name"));
    result_.trace.slices.push_back(slice);
  }

  uint32_t name(const std::string& text) {
    const auto [known, fresh] = names_.emplace(text, static_cast<uint32_t>(result_.trace.names.size()));
    if (fresh) result_.trace.names.push_back(text);
    return known->second;
  }

  const Json& file_;
  TraceFile result_;
  std::map<std::string, uint32_t> names_;
};

}  // namespace

tl::expected<TraceFile, std::string> read_trace(const Json& file) {
  try {
    return Reader(file).read();
  } catch (const Wrong& wrong) {
    return tl::unexpected(std::string(wrong.what()));
  } catch (const Json::exception& wrong) {
    return tl::unexpected(std::string("is no trace that takt wrote: ") + wrong.what());
  }
}

}  // namespace takt::explain
