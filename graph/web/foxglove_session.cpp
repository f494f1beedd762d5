// SPDX-License-Identifier: Apache-2.0
// Foxglove's WebSocket protocol, sub-protocols foxglove.sdk.v1 and foxglove.websocket.v1, which are alike in what is
// used here: channels, parameters, services, connection graph.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "graph/language/quantity.hpp"
#include "graph/web/session.hpp"
#include "graph/world/encoder.hpp"

namespace takt::web {
namespace {

constexpr double kMostHz = 1000;  ///< each message
constexpr uint8_t kMessageData = 1, kServiceRequest = 2, kServiceResponse = 3;
constexpr const char* kEvents = "takt/events";

template <class T>
void append(std::string& bytes, T number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

template <class T>
bool take(std::string_view& bytes, T& number) {
  if (bytes.size() < sizeof number) return false;
  std::memcpy(&number, bytes.data(), sizeof number);
  bytes.remove_prefix(sizeof number);
  return true;
}

std::string message_data(uint32_t subscription, int64_t stamp_ns, std::string_view payload) {
  std::string bytes(1, static_cast<char>(kMessageData));
  append(bytes, subscription);
  append(bytes, static_cast<uint64_t>(std::max<int64_t>(stamp_ns, 0)));
  return bytes.append(payload);
}

/// What Foxglove can call: the question, and the member that it asks for ("": none).
struct Service {
  const char *name, *question, *member, *help;
};
constexpr Service kServices[] = {{"takt/mode", "mode", "mode", "changes the mode"},
                                 {"takt/mark", "mark", "words", "sets a mark with words"},
                                 {"takt/stop", "stop", "", "ends the run"},
                                 {"takt/task", "task", "words", "hands the robot a task: goal cup_1.level=full"},
                                 {"takt/know", "know", "object", "what the robot knows of an object"}};

Json service_json(size_t id) {
  const Service& service = kServices[id];
  Json properties = Json::object();
  if (*service.member != '\0') properties[service.member] = {{"type", "string"}};
  Json told{{"id", id}, {"name", service.name}, {"type", service.name}};
  const auto describe = [&](const char* way, const char* end, const Json& of) {
    const std::string schema = Json{{"type", "object"}, {"properties", of}}.dump();
    told[way] = {{"encoding", "json"},
                 {"schemaName", std::string(service.name) + end},
                 {"schemaEncoding", "jsonschema"},
                 {"schema", schema}};
    told[std::string(way) + "Schema"] = schema;  // all that Foxglove Studio 1.x reads
  };
  describe("request", "_Request", properties);
  describe("response", "_Response", {{"ok", {{"type", "boolean"}}}, {"error", {{"type", "string"}}}});
  return told;
}

class FoxgloveSession final : public Session {
 public:
  FoxgloveSession(const Room& room, uint64_t number, bool may_change) : Session(room, number), may_change_(may_change) {
    send(Json{{"op", "serverInfo"},
              {"name", "takt"},
              {"capabilities", {"parameters", "parametersSubscribe", "services", "connectionGraph"}},
              {"supportedEncodings", {"json"}},
              {"metadata", Json::object()},
              {"sessionId", std::to_string(number)}});
    Json services = Json::array();
    for (size_t id = 0; id < std::size(kServices); ++id) services.push_back(service_json(id));
    send(Json{{"op", "advertiseServices"}, {"services", services}});
  }
  ~FoxgloveSession() override {
    for (const auto& [id, subscription] : subscriptions_) let_go(subscription);
  }

  bool receive(std::string_view bytes, bool binary) override {
    if (binary) return call_service(bytes);
    const Json said = Json::parse(bytes, nullptr, false);
    if (!said.is_object() || !said.value("op", Json()).is_string()) return false;
    const auto op = said["op"].get<std::string>();
    const auto list = [&](const char* key) {
      const Json found = said.value(key, Json::array());
      return found.is_array() ? found : Json::array();
    };
    if (op == "subscribe") subscribe(list("subscriptions"));
    else if (op == "unsubscribe") unsubscribe(list("subscriptionIds"));
    else if (op == "getParameters") send_parameters(list("parameterNames"), said.value("id", Json()));
    else if (op == "setParameters") set_parameters(list("parameters"), said.value("id", Json()));
    else if (op == "subscribeParameterUpdates") change_watched(list("parameterNames"), true);
    else if (op == "unsubscribeParameterUpdates") change_watched(list("parameterNames"), false);
    else if (op == "subscribeConnectionGraph") send_connections();
    else if (op != "unsubscribeConnectionGraph") tell(1, "this server does not know `" + op + "`");
    return true;
  }

  void take_news(const Json& news) override {
    take_parameters(news.at("state").value("parameters", Json::array()));
    for (const auto& [id, subscription] : subscriptions_)
      if (subscription.channel == 0)
        for (const Json& event : news.at("events")) send_event(id, event);
  }

  void look() override {
    const uint64_t version = room().hub.graph_version();
    if (version == std::exchange(graph_version_, version)) return;
    begin_graph();
  }

 protected:
  std::optional<Message> next_shown() override {
    for (size_t tried = 0; tried < subscriptions_.size(); ++tried) {
      auto at = subscriptions_.upper_bound(last_);
      if (at == subscriptions_.end()) at = subscriptions_.begin();
      last_ = at->first;
      for (auto& [view, seen] : at->second.seen) {
        const auto shown = room().hub.newer(view, seen);
        if (!shown || shown->parts.empty()) continue;
        seen = shown->version;
        const Hub::Part& part = shown->parts.front();
        return Message{frame_of(message_data(at->first, part.stamp_ns, *part.frame)), true};
      }
    }
    return std::nullopt;
  }
  void tell_dropped(uint64_t count) override {
    tell(1, fmt::format("{} messages were dropped: this client was too slow", count));
  }

 private:
  struct Subscription {
    uint32_t channel = 0;           ///< 0: the events
    std::map<View, uint64_t> seen;  ///< of each that tells of it, the version that was sent
  };

  void tell(int level, const std::string& text) { send(Json{{"op", "status"}, {"level", level}, {"message", text}}); }
  void let_go(const Subscription& subscription) const {
    for (const auto& [view, seen] : subscription.seen) room().hub.leave(view, kMostHz);
  }

  void begin_graph() {
    if (!channels_.empty()) {
      Json ids = Json::array();
      for (size_t id = 0; id <= channels_.size(); ++id) ids.push_back(id);
      send(Json{{"op", "unadvertise"}, {"channelIds", ids}});
    }
    for (const auto& [id, subscription] : subscriptions_) let_go(subscription);
    subscriptions_.clear();
    channels_ = room().hub.channels();
    const Json graph = room().hub.graph();
    if (graph.is_null()) return tell(0, room().hub.why_gone());
    describe_parameters(graph);
    Json channels = Json::array();
    const auto add = [&](const std::string& topic, const std::string& schema, const std::string& definition) {
      channels.push_back({{"id", channels.size()},
                          {"topic", topic},
                          {"encoding", "cdr"},
                          {"schemaName", schema},
                          {"schema", definition},
                          {"schemaEncoding", "ros2msg"}});
    };
    const std::string log = world::log_form(0, "", "").schema;
    add(kEvents, log, world::schema_text(log));
    for (const Channel& channel : channels_) add(channel.topic, channel.schema, channel.definition);
    send(Json{{"op", "advertise"}, {"channels", channels}});
  }

  void subscribe(const Json& wanted) {
    for (const Json& one : wanted) {
      const Json id = one.value("id", Json()), channel = one.value("channelId", Json());
      if (!id.is_number_unsigned() || !channel.is_number_unsigned() || channel.get<uint64_t>() > channels_.size() ||
          subscriptions_.contains(id.get<uint32_t>())) {
        tell(2, "there is no such channel, or the subscription's number is taken");
        continue;
      }
      Subscription& made = subscriptions_[id.get<uint32_t>()];
      made.channel = channel.get<uint32_t>();
      if (made.channel == 0) {
        for (const Json& event : room().hub.events()) send_event(id.get<uint32_t>(), event);
        continue;
      }
      const Channel& of = channels_[made.channel - 1];
      for (const std::string& port : of.ports) {
        made.seen.emplace(cdr_view(port, of), 0);
        room().hub.look(cdr_view(port, of), kMostHz);
      }
    }
  }

  void unsubscribe(const Json& ids) {
    for (const Json& id : ids) {
      const auto found = id.is_number_unsigned() ? subscriptions_.find(id.get<uint32_t>()) : subscriptions_.end();
      if (found == subscriptions_.end()) continue;
      let_go(found->second);
      subscriptions_.erase(found);
    }
  }

  void send_event(uint32_t subscription, const Json& event) {
    const auto at_ns = event.value("wall_ns", int64_t{0});
    const std::string level = event.value("level", ""), kind = level.empty() ? event.value("kind", "") : level;
    const world::Form form = world::log_form(at_ns, event.value("node", ""), kind + ": " + event.value("text", ""),
                                             log_level(level).value_or(LogLevel::info));
    send(frame_of(
             message_data(subscription, at_ns, {reinterpret_cast<const char*>(form.bytes.data()), form.bytes.size()})),
         true);
  }

  // Parameters: "node.param", numbers in their own unit.
  void describe_parameters(const Json& graph) {
    values_.clear();
    units_.clear();
    for (const Json& parameter : graph.value("parameters", Json::array())) {
      const std::string name = parameter.value("node", "") + "." + parameter.value("param", "");
      values_[name] = typed(parameter.value("kind", ""), parameter.value("value", Json()));
      units_[name] = parameter.value("unit", "");
    }
  }
  static Json typed(const std::string& kind, const Json& value) {
    if (!value.is_string() || kind == "text" || kind == "choice") return value;
    const Json parsed = Json::parse(value.get<std::string>(), nullptr, false);
    return parsed.is_discarded() ? value : parsed;
  }
  void take_parameters(const Json& changed) {
    Json told = Json::array();
    for (const Json& parameter : changed) {
      const std::string name = parameter.value("node", "") + "." + parameter.value("param", "");
      Json& known = values_[name];
      if (known == parameter.value("value", Json())) continue;
      known = parameter.value("value", Json());
      if (watches_all_ || watched_.contains(name)) told.push_back({{"name", name}, {"value", known}});
    }
    if (!told.empty()) send(Json{{"op", "parameterValues"}, {"parameters", told}});
  }
  void send_parameters(const Json& names, const Json& id) {
    Json parameters = Json::array();
    for (const auto& [name, value] : values_)
      if (names.empty() || std::find(names.begin(), names.end(), Json(name)) != names.end())
        parameters.push_back({{"name", name}, {"value", value}});
    Json answer{{"op", "parameterValues"}, {"parameters", parameters}};
    if (!id.is_null()) answer["id"] = id;
    send(answer);
  }
  void set_parameters(const Json& wanted, const Json& id) {
    if (!may_change_) return tell(2, "this needs the token: ws://HOST:PORT/?token=...");
    Json names = Json::array();
    for (const Json& parameter : wanted) {
      const std::string name = parameter.value("name", "");
      const Json value = parameter.value("value", Json());
      std::string text = value.is_string() ? value.get<std::string>() : value.dump();
      if (value.is_number() && !graph::carries_no_unit(units_[name])) text += " " + units_[name];
      names.push_back(name);
      room().ask(number(), {{"do", "set"}, {"param", name}, {"value", text}}, [this, name, value](const Json& answer) {
        if (answer.contains("error")) tell(2, answer.value("error", ""));
        else values_[name] = value;
      });
    }
    // Behind all of these: answers come in the order of the questions.
    room().ask(number(), {{"do", "get"}, {"param", ""}}, [this, names, id](const Json& answer) {
      take_parameters(answer.value("parameters", Json::array()));
      if (!id.is_null()) send_parameters(names, id);
    });
  }
  void change_watched(const Json& names, bool on) {
    if (names.empty()) watches_all_ = on;
    for (const Json& name : names) {
      if (!name.is_string()) continue;
      if (on) watched_.insert(name.get<std::string>());
      else watched_.erase(name.get<std::string>());
    }
  }

  bool call_service(std::string_view bytes) {
    uint8_t opcode = 0;
    uint32_t service = 0, call = 0, encoding_bytes = 0;
    if (!take(bytes, opcode) || opcode != kServiceRequest || !take(bytes, service) || !take(bytes, call) ||
        !take(bytes, encoding_bytes) || bytes.size() < encoding_bytes)
      return false;
    const auto fail = [&](const std::string& why) {
      send(Json{{"op", "serviceCallFailure"}, {"serviceId", service}, {"callId", call}, {"message", why}});
      return true;
    };
    if (service >= std::size(kServices)) return fail("there is no such service");
    if (!may_change_) return fail("this needs the token: ws://HOST:PORT/?token=...");
    const Json given = Json::parse(bytes.substr(encoding_bytes), nullptr, false);
    const Service& called = kServices[service];
    Json question{{"do", called.question}};
    if (*called.member != '\0') {
      if (!given.is_object() || !given.value(called.member, Json()).is_string())
        return fail(fmt::format("the request is an object with the text `{}`", called.member));
      question[called.member] = given[called.member];
    }
    room().ask(number(), question, [this, service, call](const Json& answer) {
      std::string response(1, static_cast<char>(kServiceResponse));
      append(response, service);
      append(response, call);
      append(response, uint32_t{4});
      send(frame_of(response + "json" + answer.dump()), true);
    });
    return true;
  }

  void send_connections() {
    std::map<std::string, Json> readers;
    Json published = Json::array(), subscribed = Json::array();
    for (const Json& node : room().hub.graph().value("nodes", Json::array())) {
      for (const Json& port : node.value("outputs", Json::array()))
        published.push_back({{"name", port}, {"publisherIds", {node.value("name", "")}}});
      for (const Json& input : node.value("inputs", Json::array()))
        readers[input.value("from", "")].push_back(node.value("name", ""));
    }
    for (const auto& [name, nodes] : readers) subscribed.push_back({{"name", name}, {"subscriberIds", nodes}});
    Json services = Json::array();
    for (const Service& service : kServices)
      services.push_back({{"name", service.name}, {"providerIds", {"takt web"}}});
    send(Json{{"op", "connectionGraphUpdate"},
              {"publishedTopics", published},
              {"subscribedTopics", subscribed},
              {"advertisedServices", services},
              {"removedTopics", Json::array()},
              {"removedServices", Json::array()}});
  }

  const bool may_change_;
  bool watches_all_ = false;
  uint64_t graph_version_ = UINT64_MAX;
  std::vector<Channel> channels_;  ///< from 1; 0 are the events
  std::map<uint32_t, Subscription> subscriptions_;
  uint32_t last_ = 0;
  std::map<std::string, Json> values_;
  std::map<std::string, std::string> units_;
  std::set<std::string> watched_;
};

}  // namespace

std::unique_ptr<Session> foxglove_session(const Room& room, uint64_t number, bool may_change) {
  return std::make_unique<FoxgloveSession>(room, number, may_change);
}

}  // namespace takt::web
