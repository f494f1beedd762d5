// SPDX-License-Identifier: Apache-2.0
#include "graph/web/link.hpp"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <thread>

#include "graph/attach/message_text.hpp"
#include "graph/web/page_frames.hpp"
#include "graph/world/encoder.hpp"
#include "graph/world/specimen.hpp"
#include "rt/time/clock.hpp"

namespace takt::web {
namespace {

constexpr int kLookMs = 20;
constexpr auto kRetry = std::chrono::milliseconds(300);
constexpr size_t kItems = 64;  ///< of an array, for views by value
constexpr size_t kStack = 2 << 20;

/// Several outputs tell of one topic: one channel.
void add(Channel channel, std::vector<Channel>& channels) {
  const auto twin = std::find_if(channels.begin(), channels.end(), [&](const Channel& other) {
    return other.topic == channel.topic && other.schema == channel.schema;
  });
  if (twin == channels.end()) channels.push_back(std::move(channel));
  else twin->ports.push_back(channel.ports.front());
}

double seconds(int64_t ns) { return static_cast<double>(ns) / 1e9; }

}  // namespace

Link::Link(Hub& hub, const graph::MessageTypes& types, const Options& options)
    : hub_(hub), types_(types), options_(options), thread_([this] { work(); }, kStack) {}

Link::~Link() {
  ending_.store(true);
  thread_.join();
}

Json Link::ask(const Json& question) const {
  const int run = run_.load();
  auto connection = run > 0 ? attach::connect_to(run) : std::nullopt;
  if (!connection || !connection->write(question)) return {{"error", "no run is there"}};
  const auto answer = connection->read_line();
  return answer ? *answer : Json{{"error", "the run does not answer"}};
}

void Link::work() {
  pthread_setname_np(pthread_self(), "takt-link");
  for (std::string why = "no run is there; start one with `takt run GRAPH`"; !ending_.load();) {
    std::this_thread::sleep_for(kRetry);
    const auto run = attach::chosen_run(options_.run);
    if (!run && !attach::running().empty()) why = run.error();
    auto connection = run ? attach::connect_to(*run) : std::nullopt;
    run_.store(connection ? *run : 0);
    if (connection) why = follow(*connection);
    if (connection || hub_.why_gone() != why) hub_.set_graph(nullptr, {}, why);
  }
}

std::string Link::follow(attach::Connection& connection) {
  if (!describe(connection)) return "the run does not say what it is: it is of another version of Takt";
  if (!connection.write({{"do", "follow"}}) || !connection.write({{"state_every_ms", options_.state_every_ms}}))
    return "the run has ended";
  wants_ = UINT64_MAX;
  while (!ending_.load()) {
    if (!tell_wishes(connection)) break;
    if (!connection.readable(kLookMs)) continue;
    const auto line = connection.read_line();
    if (!line || !line->is_object() || !take(connection, *line)) break;
  }
  return "the run has ended";
}

bool Link::describe(attach::Connection& connection) {
  if (!connection.write({{"do", "describe"}})) return false;
  auto graph = connection.read_line();
  if (!graph || !graph->is_object() || !graph->contains("ports")) return false;
  ports_.clear();
  std::vector<Channel> channels;
  for (Json& port : (*graph)["ports"]) {
    Port made(port, types_);
    Json shows = made.type != nullptr ? Json(kinds_of(*made.type, made.capacity)) : Json::array();
    shows.push_back("value");
    port["shows"] = std::move(shows);
    port.erase("layout");
    const std::string name = port.value("name", "");
    for (Channel& channel : channels_of(name, made)) add(std::move(channel), channels);
    ports_.emplace(name, std::move(made));
  }
  hub_.set_graph(std::move(*graph), std::move(channels));
  return true;
}

std::vector<Channel> Link::channels_of(const std::string& name, const Port& port) const {
  std::vector<Channel> channels;
  if (port.type != nullptr && port.type->show != nullptr) {
    const AlignedBytes message = world::specimen(*port.type, port.capacity);
    for (const world::Outline& outline : encoder_.outline(*port.type, message.get()))
      channels.push_back({{name},
                          world::topic_of(name, outline.topic),
                          outline.schema,
                          world::schema_text(outline.schema, port.recorded->fields())});
  }
  if (!channels.empty() || !port.recorded) return channels;
  const std::string schema = world::own_schema(port.recorded->name());
  return {{{name}, name, schema, world::schema_text(schema, port.recorded->fields())}};
}

bool Link::tell_wishes(attach::Connection& connection) {
  const uint64_t wants = hub_.wants();
  if (wants == wants_) return true;
  wants_ = wants;
  std::map<std::string, double> most_hz;
  for (const Hub::Want& want : hub_.wanted()) most_hz[want.view.port] = std::max(most_hz[want.view.port], want.most_hz);
  for (auto& [name, port] : ports_) {
    const auto wanted = most_hz.find(name);
    const double hz = wanted == most_hz.end() ? -1 : wanted->second;
    if (hz == port.asked_hz) continue;
    port.asked_hz = hz;
    const Json wish = hz < 0 ? Json{{"drop", name}} : Json{{"add", name}, {"every_ms", hz > 0 ? 1000.0 / hz : 0.0}};
    if (!connection.write(wish)) return false;
  }
  return true;
}

bool Link::take(attach::Connection& connection, const Json& line) {
  stamps_.look(attach::wall_ns(), MonotonicClock().now_ns());
  if (line.contains("state")) {
    take_state(line);
    return true;
  }
  if (!line.contains("message")) return true;  // a refusal: the hub is asked for what is not there
  const auto bytes = connection.read_bytes(line.value("bytes", size_t{0}));
  if (!bytes) return false;
  const std::string name = line.value("message", "");
  if (const auto port = ports_.find(name); port != ports_.end()) show(name, port->second, line, *bytes);
  return true;
}

void Link::show(const std::string& name, Port& port, const Json& line, const std::string& packed) {
  std::optional<bool> filled;
  const std::span bytes(reinterpret_cast<const std::byte*>(packed.data()), packed.size());
  const auto fill = [&] {
    if (!filled) filled = port.fill(bytes);
    return *filled;
  };
  const int64_t stamp_ns = line.value("stamp_ns", int64_t{0});
  const Origin origin{name,
                      line.value("sequence", uint64_t{0}),
                      stamp_ns,
                      epoch_ns_,
                      line.value("level", 0),
                      static_cast<double>(MonotonicClock().now_ns() - stamp_ns) / 1e6};
  bool topics = false;
  for (const Hub::Want& want : hub_.wanted()) {
    if (want.view.port != name) continue;
    if (want.view.as == "value") show_value(want.view, port, line, packed);
    else if (want.view.as.starts_with("cdr ")) topics = true;
    else if (fill()) hub_.put(want.view, page_frames(*port.type, port.memory.get(), want.view.as, origin));
  }
  if (topics && port.recorded) show_topics(name, port, fill(), stamps_.of(stamp_ns), bytes);
}

void Link::show_topics(const std::string& name, const Port& port, bool filled, int64_t stamp_ns,
                       std::span<const std::byte> packed) {
  std::set<std::string> wanted;
  for (const Hub::Want& want : hub_.wanted())
    if (want.view.port == name) wanted.insert(want.view.as);
  const auto put = [&](const world::Form& form) {
    const View view = cdr_view(name, {{}, world::topic_of(name, form.topic), form.schema, {}});
    if (wanted.contains(view.as))
      hub_.put(view, {{stamp_ns, frame_of({reinterpret_cast<const char*>(form.bytes.data()), form.bytes.size()})}});
  };
  const auto ends_with_topic = [&](std::string_view behind) {
    const std::string end = " " + world::topic_of(name, behind);
    return std::any_of(wanted.begin(), wanted.end(), [&](const std::string& as) { return as.ends_with(end); });
  };
  const std::string node = name.substr(0, name.find('.'));
  if (filled && port.type->show != nullptr)
    for (const world::Form& form : encoder_.forms(*port.type, port.memory.get(), node, stamp_ns, ends_with_topic))
      put(form);
  const View own = cdr_view(name, {{}, name, world::own_schema(port.recorded->name()), {}});
  if (!wanted.contains(own.as)) return;
  if (const auto form = world::own_form(port.recorded->name(), port.recorded->fields(), packed, stamp_ns)) put(*form);
}

void Link::show_value(const View& view, const Port& port, const Json& line, const std::string& packed) {
  if (!port.recorded) return;
  const std::span bytes(reinterpret_cast<const std::byte*>(packed.data()), packed.size());
  auto message = attach::packed_json(port.recorded->fields(), bytes, kItems);
  if (!message) return;
  const int64_t stamp_ns = line.value("stamp_ns", int64_t{0});
  const Json value{{"op", "value"},
                   {"port", view.port},
                   {"sequence", line.value("sequence", uint64_t{0})},
                   {"stamp_s", seconds(stamp_ns - epoch_ns_)},
                   {"age_ms", line.value("age_ms", 0.0)},
                   {"level", line.value("level", 0)},
                   {"message", std::move(*message)}};
  hub_.put(view, {{stamp_ns, frame_of(value.dump(-1, ' ', false, Json::error_handler_t::replace))}});
}

void Link::take_state(const Json& line) {
  epoch_ns_ = line.value("epoch_ns", int64_t{0});
  Json events = line.value("events", Json::array());
  for (Json& event : events)
    if (const Json at_s = event.value("at_s", Json()); at_s.is_number())
      event["wall_ns"] = stamps_.of(epoch_ns_ + static_cast<int64_t>(at_s.get<double>() * 1e9));
  Json state = line.at("state");
  std::vector<int> pids;
  for (const Json& process : state.value("processes", Json::array())) pids.push_back(process.value("pid", 0));
  const attach::MachineUse::Use use = use_.look(pids, MonotonicClock().now_ns());
  state["cpu"] = use.cpu ? Json(*use.cpu) : Json(nullptr);
  state["memory_mb"] = use.memory_mb;
  state["host_stall_ms"] = use.host_stall_ms;
  hub_.broadcast(
      {{"state", std::move(state)}, {"jobs", line.value("jobs", Json::array())}, {"events", std::move(events)}});
}

}  // namespace takt::web
