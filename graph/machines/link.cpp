// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/link.hpp"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <chrono>

#include "rt/record/packed_message.hpp"
#include "rt/sched/histogram.hpp"

namespace takt::machines {
namespace {

constexpr int64_t kStateEvery_ns = 100'000'000;
constexpr int64_t kSilent_ns = 3 * kStateEvery_ns;  ///< then a machine is lost
constexpr int64_t kTold_ns = 1'000'000'000;         ///< so long a trouble is told
constexpr auto kTellAgain = std::chrono::seconds(10);

std::string topic_name(std::string_view graph, std::string_view machine, std::string_view what) {
  std::string name = fmt::format("takt/{}/{}/{}", graph, machine, what);
  std::replace(name.begin(), name.end(), '.', '/');
  return name;
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

bool is_there(const Peer& machine, int64_t at_ns) {
  const int64_t heard_ns = machine.heard_ns.load(std::memory_order_relaxed);
  return heard_ns != INT64_MIN && at_ns - heard_ns <= kSilent_ns;
}

}  // namespace

/// Under `taking_`; jobs and status read the counts.
struct Link::Import {
  Import(Peer& from, const ImportName& name) : from(from), port(name.port), remembered(name.remembered) {}
  Peer& from;
  const std::string port;
  const std::function<std::optional<Capacity>()> remembered;
  const MessageType* type = nullptr;
  std::unique_ptr<Inbox> own;
  std::atomic<Inbox*> inbox{nullptr};  ///< null: the run has not begun
  uint64_t run = 0;
  Arrivals arrivals;
  std::vector<std::byte> decoded;  ///< the last message, if it came in a coding
  Histogram latency;               ///< from publication there to arrival here
  std::atomic<uint64_t> received{0}, missing{0}, doubled{0}, passed{0}, damaged{0}, late{0}, no_room{0},
      unknown_clock{0};
  std::atomic<int64_t> late_at_ns{INT64_MIN}, unknown_at_ns{INT64_MIN};  ///< the last one
};

class Link::Source final : public RemoteSource {
 public:
  Source(Link& link, Peer& machine, std::vector<Import*> imports, StampLaw law)
      : link_(link), machine_(machine), imports_(std::move(imports)), law_(std::move(law)) {}
  StampLaw stamp_law(const JobTimes&) const override { return law_; }
  Capacity capacity(std::string_view output) override {
    for (Import* import : imports_) {
      if (import->port.substr(import->port.find('.') + 1) != output) continue;
      const auto remembered = import->remembered ? import->remembered() : std::nullopt;
      const Capacity capacity = remembered ? *remembered : link_.fact(machine_, import->port);
      import->own = std::make_unique<Inbox>(*import->type, capacity);
      return capacity;
    }
    throw SetupError(fmt::format("{} does not come from machine {}", output, machine_.name));
  }
  DeviceResult start(int64_t) override {  // what came before is not for this run
    for (Import* import : imports_) import->inbox.store(import->own.get(), std::memory_order_release);
    return {};
  }
  Inbox& inbox(size_t output) override { return *imports_[output]->own; }
  ReadStatus status(int64_t release_ns) override {
    return is_there(machine_, release_ns) ? ReadStatus::ok : ReadStatus::no_data;
  }
  SourceCounts counts() const override {
    SourceCounts all;
    for (const Import* import : imports_) {
      all.received += import->received.load(std::memory_order_relaxed);
      all.damaged += import->damaged.load(std::memory_order_relaxed);
      all.missing += import->missing.load(std::memory_order_relaxed);
    }
    return all;
  }
  const char* trouble() const override {
    if (machine_.differs.load()) return "that machine runs another graph, schedule or other parameters";
    const int64_t now_ns = link_.clock_.now_ns();
    const auto of_late = [&](auto Import::*at_ns) {
      return std::any_of(imports_.begin(), imports_.end(), [&](const Import* import) {
        return (import->*at_ns).load(std::memory_order_relaxed) > now_ns - kTold_ns;
      });
    };
    if (of_late(&Import::unknown_at_ns)) return "its clock is known too badly: ages are unknown";
    return of_late(&Import::late_at_ns) ? "messages came later than the network's latency" : "";
  }

 private:
  Link& link_;
  Peer& machine_;
  const std::vector<Import*> imports_;
  const StampLaw law_;
};

Link::Link(Options options, const std::vector<ImportName>& imports, std::vector<Export> exports,
           std::unique_ptr<Wire> wire, Doorbell& bell, const Clock& clock)
    : options_(std::move(options)),
      exports_(std::move(exports)),
      bell_(bell),
      clock_(clock),
      run_(static_cast<uint64_t>(std::chrono::system_clock::now().time_since_epoch() / std::chrono::microseconds(1))),
      wire_(std::move(wire)) {
  for (const std::string& name : options_.peers) {
    peers_.push_back(std::make_unique<Peer>(name, options_.same));
    wire_->takes({topic_name(options_.graph, name, "state"), Wire::Promise::newest});
  }
  for (const std::string& name : options_.peers)
    wire_->takes({topic_name(options_.graph, name, "words"), Wire::Promise::all});
  for (const ImportName& import : imports) {
    imports_.push_back(std::make_unique<Import>(peer(import.machine), import));
    wire_->takes({topic_name(options_.graph, import.machine, import.port)});
  }
  state_topic_ = wire_->sends({topic_name(options_.graph, options_.machine, "state"), Wire::Promise::newest});
  words_topic_ = wire_->sends({topic_name(options_.graph, options_.machine, "words"), Wire::Promise::all});
  for (const Export& one : exports_)
    out_topics_.push_back(wire_->sends({topic_name(options_.graph, options_.machine, one.port)}));
  older_.resize(exports_.size());
  questions_ =
      std::make_unique<Questions>(Questions::Options{options_.machine, run_, options_.answer},
                                  [this](std::span<const std::byte> words) { wire_->send(words_topic_, words); });
  wire_->begin([this](size_t topic, std::span<const std::byte> bytes) { take(topic, bytes); });
  sending_ = OwnThread([this](const std::stop_token& end) { send_on(end); });
}

Link::~Link() {
  give_up();
  sending_.request_stop();
  bell_.ring();
  if (sending_.joinable()) sending_.join();
  questions_->stop();  // it sends
  wire_.reset();       // nothing comes any more
  if (!options_.say) return;
  for (const std::string& line : summary()) options_.say(line);
}

Json Link::outputs_of(const Peer& machine) const {
  Json outputs = Json::array();
  for (const auto& import : imports_) {
    if (&import->from != &machine) continue;
    const auto ms = [&](int64_t ns) { return static_cast<double>(ns) / 1e6; };
    outputs.push_back({{"port", import->port},
                       {"received", import->received.load()},
                       {"missing", import->missing.load()},
                       {"late", import->late.load()},
                       {"damaged", import->damaged.load()},
                       {"doubled", import->doubled.load()},
                       {"behind a newer one", import->passed.load()},
                       {"without room", import->no_room.load()},
                       {"of unknown age", import->unknown_clock.load()},
                       {"latency_ms",
                        {{"p50", ms(import->latency.quantile_ns(0.5))},
                         {"p99", ms(import->latency.quantile_ns(0.99))},
                         {"max", ms(import->latency.max_ns())}}}});
  }
  return outputs;
}

Json Link::report() const {
  Json machines = Json::array();
  const int64_t now_ns = clock_.now_ns();
  const std::scoped_lock lock(taking_, mutex_);
  for (const auto& known : peers_) {
    const char* const state = known->differs.load()                 ? "runs something else"
                              : is_there(*known, now_ns)            ? "here"
                              : known->heard_ns.load() == INT64_MIN ? "never heard"
                                                                    : "lost";
    const auto clock = known->clock.offset(now_ns);
    machines.push_back({{"name", known->name},
                        {"state", state},
                        {"clock_offset_ms", clock ? Json(static_cast<double>(clock->offset_ns) / 1e6) : Json()},
                        {"clock_error_ms", clock ? Json(static_cast<double>(clock->error_ns) / 1e6) : Json()},
                        {"clock_jumps", known->clock.jumps()},
                        {"outputs", outputs_of(*known)},
                        {"told", known->newest.told}});
  }
  return machines;
}

std::vector<std::string> Link::summary() const {
  std::vector<std::string> lines;
  for (const Json& machine : report()) {
    const std::string name = machine["name"];
    for (const Json& output : machine["outputs"]) {
      std::string what;
      for (const char* word :
           {"missing", "late", "damaged", "doubled", "behind a newer one", "without room", "of unknown age"})
        if (const uint64_t count = output[word]; count > 0)
          what += fmt::format("{} {} {}", what.empty() ? ";" : ",", count, word);
      const Json& ms = output["latency_ms"];
      lines.push_back(fmt::format("{} from machine {}: {} received within {:.2f} (p50), {:.2f} (p99), {:.2f} ms{}",
                                  output["port"].get<std::string>(), name, output["received"].get<uint64_t>(),
                                  ms["p50"].get<double>(), ms["p99"].get<double>(), ms["max"].get<double>(), what));
    }
    if (const uint64_t jumps = machine["clock_jumps"]; jumps > 0)
      lines.push_back(fmt::format("the clock of machine {} jumped {} times", name, jumps));
  }
  for (size_t i = 0; i < exports_.size(); ++i)
    if (older_[i] > 0)
      lines.push_back(fmt::format("{}: {} messages were older than the {:.1f} ms that other machines count on",
                                  exports_[i].port, older_[i], static_cast<double>(*exports_[i].age_ns) / 1e6));
  return lines;
}

Peer& Link::peer(std::string_view name) {
  return **std::find_if(peers_.begin(), peers_.end(), [&](const auto& known) { return known->name == name; });
}

std::unique_ptr<RemoteSource> Link::source(const std::string& machine, const std::string& node,
                                           const std::vector<RemoteNode::Port>& ports, const StampLaw& law) {
  std::vector<Import*> of_node;
  for (const RemoteNode::Port& port : ports)
    for (const auto& import : imports_)
      if (import->port == node + "." + port.name) import->type = port.type, of_node.push_back(import.get());
  return std::make_unique<Source>(*this, peer(machine), std::move(of_node), law);
}

void Link::begin(std::vector<Outgoing> outgoing) {
  outgoing_ = std::move(outgoing);
  begun_.store(true, std::memory_order_release);
  bell_.ring();
}

void Link::give_up() {
  const std::lock_guard lock(mutex_);
  gave_up_ = true;
  changed_.notify_all();
}

Json Link::ask(const std::string& machine, const Json& question) {
  const auto known = std::find_if(peers_.begin(), peers_.end(), [&](const auto& one) { return one->name == machine; });
  if (known == peers_.end() || !is_there(**known, clock_.now_ns()))
    return {{"error", fmt::format("machine {} is not there", machine)}};
  return questions_->ask(machine, question);
}

Capacity Link::fact(const Peer& of, const std::string& port) {
  std::unique_lock lock(mutex_);
  for (bool said = false;; said = true) {
    const auto known = [&] { return gave_up_ || of.newest.facts.contains(port); };
    if (changed_.wait_for(lock, said ? kTellAgain : std::chrono::seconds(1), known)) break;
    if (options_.say) options_.say(fmt::format("waiting for machine {} to say how large {} can become", of.name, port));
  }
  const auto told = of.newest.facts.find(port);
  if (told == of.newest.facts.end()) throw SetupError(fmt::format("machine {} was not there", of.name));
  return told->second;
}

void Link::send_on(const std::stop_token& end) {
  pthread_setname_np(pthread_self(), "takt-send");
  std::vector<Follower> followers;
  std::vector<Framer> framers;
  for (int64_t next_state_ns = 0; !end.stop_requested();) {
    const uint32_t heard = bell_.rung();
    if (const int64_t now_ns = clock_.now_ns(); now_ns >= next_state_ns) {
      send_state();
      next_state_ns = now_ns + kStateEvery_ns;
    }
    if (followers.empty() && begun_.load(std::memory_order_acquire))
      for (size_t i = 0; i < outgoing_.size(); ++i) {
        followers.emplace_back(std::move(outgoing_[i].reader));
        framers.emplace_back(*outgoing_[i].type, exports_[i].coding);
      }
    for (size_t i = 0; i < followers.size(); ++i)
      followers[i].take([&](const Held& held) { send(i, held, framers[i]); });
    bell_.wait(heard, next_state_ns - clock_.now_ns());
  }
}

void Link::send(size_t i, const Held& held, Framer& framer) {
  if (const auto& age_ns = exports_[i].age_ns; age_ns && held.header->published_ns - held.stamp_ns > *age_ns)
    ++older_[i];
  wire_->send(out_topics_[i], framer.frame(run_, held));
}

void Link::send_state() {
  State state{options_.machine, run_, options_.same, 0, {}, {}, options_.tells ? options_.tells() : Json()};
  for (const Export& one : exports_)
    if (const auto capacity = one.capacity()) state.facts[one.port] = *capacity;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& known : peers_)
      if (const int64_t heard_ns = known->heard_ns.load(); heard_ns != INT64_MIN)
        state.heard[known->name] = {known->newest.run, known->newest.sent_ns, heard_ns};
  }
  state.sent_ns = clock_.now_ns();
  const std::string text = text_of(state);
  wire_->send(state_topic_, bytes_of(text));
}

void Link::take(size_t topic, std::span<const std::byte> bytes) {
  const std::lock_guard lock(taking_);
  if (topic < peers_.size()) take_state(bytes);
  else if (topic < 2 * peers_.size()) questions_->take(bytes);
  else take_message(*imports_[topic - 2 * peers_.size()], bytes);
}

void Link::take_state(std::span<const std::byte> bytes) {
  const auto state = state_of({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const auto from = std::find_if(peers_.begin(), peers_.end(),
                                 [&](const auto& known) { return state && known->name == state->machine; });
  if (from == peers_.end()) return;
  const std::lock_guard lock(mutex_);
  const bool differed = (*from)->differs.load();
  if ((*from)->hear(*state, options_.machine, run_, clock_.now_ns())) return changed_.notify_all();
  if (!differed && options_.say)
    options_.say(fmt::format("machine {} runs another graph, schedule or other parameters: it is not listened to",
                             state->machine));
}

void Link::take_message(Import& import, std::span<const std::byte> bytes) {
  const int64_t now_ns = clock_.now_ns();
  const auto frame = frame_of(bytes);
  if (!frame) return static_cast<void>(import.damaged.fetch_add(1));
  if (frame->run != import.run) import.arrivals.begin_again(), import.from.stamps.forget();
  import.run = frame->run;
  const auto verdict = import.arrivals.take(frame->sequence);
  import.received.store(import.arrivals.received());
  import.missing.store(import.arrivals.missing());
  import.doubled.store(import.arrivals.doubles());
  import.passed.store(import.arrivals.passes());
  if (verdict != Arrivals::fresh || import.from.differs.load()) return;
  const auto there = import.from.clock.offset(now_ns);
  if (!there || there->error_ns > options_.clock_error_ns) {
    import.unknown_clock.fetch_add(1);
    import.unknown_at_ns.store(now_ns);
  }
  if (!there) return;
  import.latency.add(now_ns - (frame->published_ns - there->offset_ns));
  const int64_t visible_ns = frame->published_ns - there->offset_ns + options_.latency_ns + options_.clock_error_ns;
  if (now_ns > visible_ns) {
    import.late.fetch_add(1);
    import.late_at_ns.store(now_ns);
  }
  fill(import, import.from.stamps.here(frame->stamp_ns, there->offset_ns), std::max(visible_ns, now_ns), *frame);
}

void Link::fill(Import& import, int64_t stamp_ns, int64_t visible_ns, const Frame& frame) {
  Inbox* const inbox = import.inbox.load(std::memory_order_acquire);
  if (inbox == nullptr) return;
  Inbox::Message* const message = inbox->to_fill();
  if (message == nullptr) return static_cast<void>(import.no_room.fetch_add(1));
  const auto packed = decoded(frame.coding, frame.coded, inbox->message_bytes(), import.decoded);
  if (!packed || !record::unpack(*import.type, *packed, message->memory.get()))
    return static_cast<void>(import.damaged.fetch_add(1));
  message->stamp_ns = stamp_ns;
  message->visible_at_ns = visible_ns;
  inbox->filled();
}

}  // namespace takt::machines
