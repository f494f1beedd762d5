// SPDX-License-Identifier: Apache-2.0
// What browsers and Foxglove get of the hub, and what they may do.
#include "graph/web/session.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <utility>
#include <vector>

#include "graph/world/encoder.hpp"

using namespace takt;
using web::Json;

namespace {

Json shown_graph() {
  return {{"name", "test"},
          {"nodes",
           {{{"name", "eye"}, {"inputs", Json::array()}, {"outputs", {"eye.pair"}}},
            {{"name", "mind"}, {"inputs", {{{"name", "pair"}, {"from", "eye.pair"}}}}, {"outputs", Json::array()}}}},
          {"ports", {{{"name", "eye.pair"}}}},
          {"parameters",
           {{{"node", "mind"}, {"param", "speed"}, {"unit", "m/s"}, {"kind", "number"}, {"value", "0.3"}},
            {{"node", "mind"}, {"param", "rule"}, {"unit", ""}, {"kind", "choice"}, {"value", "sad"}}}}};
}

Json news(Json parameters = Json::array(), Json events = Json::array()) {
  return {{"state", {{"running_s", 1.0}, {"parameters", std::move(parameters)}}},
          {"jobs", Json::array()},
          {"events", std::move(events)}};
}

struct Scene {
  int woken = 0;
  web::Hub hub{[this] { ++woken; }};
  std::vector<std::pair<Json, std::function<void(Json)>>> asked;
  web::Room room{hub, "the token", false, [this](uint64_t, Json question, std::function<void(Json)> then) {
                   asked.emplace_back(std::move(question), std::move(then));
                 }};
  std::unique_ptr<web::Session> session;

  void page() { session = web::page_session(room, 1), session->look(); }
  void foxglove(bool may_change = false) { session = web::foxglove_session(room, 1, may_change), session->look(); }
  bool say(const Json& json) { return session->receive(json.dump(), false); }
  /// What it has to send, texts as JSON.
  std::vector<Json> texts() {
    std::vector<Json> all;
    while (const auto message = session->next())
      if (!message->binary) all.push_back(Json::parse(*message->frame));
    return all;
  }
  Json last(const char* op) {
    Json found;
    for (const Json& text : texts())
      if (text.value("op", "") == op) found = text;
    return found;
  }
  std::vector<std::string> binary() {
    std::vector<std::string> all;
    while (const auto message = session->next())
      if (message->binary) all.push_back(*message->frame);
    return all;
  }
};

template <class T>
T number_at(const std::string& bytes, size_t at) {
  T number{};
  REQUIRE(bytes.size() >= at + sizeof number);
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

}  // namespace

TEST_CASE("page: greeted with the graph, told when it goes and when it is there again") {
  Scene scene;
  scene.hub.set_graph(nullptr, {}, "no run is there");
  scene.page();
  CHECK(scene.last("gone")["why"] == "no run is there");
  scene.hub.set_graph(shown_graph(), {});
  scene.session->look();
  const Json hello = scene.last("hello");
  CHECK(hello["graph"]["name"] == "test");
  CHECK(hello["may_change"] == false);
  scene.session->take_news(news({}, {{{"at_s", 1.0}, {"kind", "mark"}, {"node", ""}, {"text", "here"}}}));
  CHECK(scene.last("events")["events"][0]["text"] == "here");
  scene.hub.set_graph(nullptr, {}, "the run has ended");
  scene.session->look();
  CHECK(scene.last("gone")["why"] == "the run has ended");
}

TEST_CASE("page: without the token nothing is changed, with it everything may be asked for") {
  Scene scene;
  scene.hub.set_graph(shown_graph(), {});
  scene.page();
  const std::vector<Json> changes{{{"do", "set"}, {"param", "a.b"}, {"value", "1"}},
                                  {{"do", "forget"}, {"param", "a.b"}},
                                  {{"do", "mode"}, {"mode", "x"}},
                                  {{"do", "mark"}, {"words", "x"}},
                                  {{"do", "stop"}},
                                  {{"do", "answer"}, {"device", "person"}, {"text", "yes"}},
                                  {{"do", "fault"}, {"device", "d"}, {"fault", "silent"}},
                                  {{"do", "fault"}, {"device", "d"}, {"fault", 5}}};
  for (const char* token : {"", "the toke", "the token "}) {
    CHECK(scene.say({{"op", "token"}, {"token", token}}));
    for (const Json& question : changes) {
      CHECK(scene.say({{"op", "ask"}, {"id", 7}, {"question", question}}));
      CHECK(scene.last("answer")["error"].get<std::string>().starts_with("this needs the token"));
    }
  }
  for (const Json& question :
       {Json{{"do", "echo"}, {"port", "x"}}, Json{{"do", "follow"}}, Json{{"do", 5}}, Json::object(), Json(5)}) {
    CHECK(scene.say({{"op", "ask"}, {"id", 7}, {"question", question}}));
    CHECK(scene.last("answer").contains("error"));
  }
  CHECK(scene.asked.empty());
  CHECK(scene.say({{"op", "ask"}, {"id", 8}, {"question", {{"do", "get"}, {"param", ""}}}}));
  REQUIRE(scene.asked.size() == 1);
  CHECK(scene.say({{"op", "token"}, {"token", "the token"}}));
  CHECK(scene.last("hello")["may_change"] == true);
  for (const Json& question : changes) CHECK(scene.say({{"op", "ask"}, {"id", "x"}, {"question", question}}));
  REQUIRE(scene.asked.size() == 1 + changes.size());
  CHECK(scene.asked[1].first == changes[0]);
  scene.asked[1].second({{"ok", true}});
  CHECK(scene.last("answer") == Json{{"ok", true}, {"op", "answer"}, {"id", "x"}});
}

TEST_CASE("page: where looking needs the token, nothing is told without it") {
  Scene scene;
  scene.room.token_to_look = true;
  scene.hub.set_graph(shown_graph(), {});
  scene.page();
  scene.session->take_news(news());
  CHECK(scene.say({{"op", "look"}, {"port", "eye.pair"}, {"as", "picture"}}));
  CHECK(scene.say({{"op", "ask"}, {"id", 1}, {"question", {{"do", "get"}}}}));
  CHECK(scene.hub.wanted().empty());
  CHECK(scene.asked.empty());
  for (const Json& text : scene.texts()) CHECK((text["op"] == "gone" || text["op"] == "answer"));
  CHECK(scene.say({{"op", "token"}, {"token", "the token"}}));
  CHECK(scene.last("hello")["graph"]["name"] == "test");
}

TEST_CASE("page: the newest of each view in turn; what nobody looks at is not wanted") {
  Scene scene;
  scene.hub.set_graph(shown_graph(), {});
  scene.page();
  scene.texts();
  const web::View picture{"eye.pair", "picture"}, value{"eye.pair", "value"};
  CHECK(scene.say({{"op", "look"}, {"port", "eye.pair"}, {"as", "picture"}, {"most_hz", 5}}));
  CHECK(scene.say({{"op", "look"}, {"port", "eye.pair"}, {"as", "picture"}, {"most_hz", 50}}));  // looks already
  CHECK(scene.say({{"op", "look"}, {"port", "eye.pair"}, {"as", "value"}}));
  CHECK(scene.say(
      {{"op", "look"}, {"port", "eye.pair"}, {"as", "cdr takt_msgs/msg/StereoPair eye.pair"}}));  // not the page's
  REQUIRE(scene.hub.wanted().size() == 2);
  CHECK(scene.hub.wanted()[0].most_hz == 5);
  for (int i = 0; i < 3; ++i) {
    scene.hub.put(picture,
                  {{i, web::frame_of("left " + std::to_string(i))}, {i, web::frame_of("right " + std::to_string(i))}});
    scene.hub.put(value, {{i, web::frame_of("{\"op\": \"value\", \"i\": " + std::to_string(i) + "}")}});
  }
  std::vector<std::string> sent;
  while (const auto message = scene.session->next()) sent.push_back(*message->frame);
  CHECK(sent.size() == 3);  // of the newest message, two pictures and a value
  CHECK(std::count(sent.begin(), sent.end(), "left 2") == 1);
  CHECK(std::count(sent.begin(), sent.end(), "right 2") == 1);
  CHECK_FALSE(scene.session->next());
  CHECK(scene.say({{"op", "leave"}, {"port", "eye.pair"}, {"as", "picture"}}));
  REQUIRE(scene.hub.wanted().size() == 1);
  scene.session.reset();
  CHECK(scene.hub.wanted().empty());
}

TEST_CASE("page: who does not read keeps a megabyte waiting, and is told how much was dropped") {
  Scene scene;
  scene.hub.set_graph(shown_graph(), {});
  scene.page();
  for (int i = 0; i < 5000; ++i)
    scene.session->take_news(
        news({}, {{{"at_s", i}, {"kind", "log"}, {"node", "x"}, {"text", std::string(1000, 'x')}}}));
  size_t bytes = 0;
  std::string told;
  while (const auto message = scene.session->next()) {
    bytes += message->frame->size();
    told = *message->frame;
  }
  CHECK(bytes < 1'200'000);
  CHECK(told.find("messages of the server were dropped") != std::string::npos);
}

TEST_CASE("page: what is not of the protocol ends the session") {
  Scene scene;
  scene.page();
  for (const char* said : {"", "5", "[]", "{}", "{\"op\": 5}", "{\"op\": \"dance\"}", "{\"op\": \"look\"", "\xff"})
    CHECK_FALSE(scene.session->receive(said, false));
  CHECK_FALSE(scene.session->receive("{\"op\": \"token\"}", true));
  CHECK(scene.say({{"op", "look"}, {"port", 5}, {"as", {}}}));
  for (int i = 0; i < 1000; ++i) scene.say({{"op", "look"}, {"port", std::to_string(i)}, {"as", "value"}});
  CHECK(scene.hub.wanted().size() == 64);
}

TEST_CASE("foxglove: channels with schemas, messages with their stamps, events as a log") {
  Scene scene;
  scene.hub.set_graph(shown_graph(),
                      {{{"eye.pair"}, "eye.pair.left", "foxglove_msgs/msg/CompressedImage", "definition"}});
  scene.foxglove();
  const std::vector<Json> first = scene.texts();
  REQUIRE(first.size() == 3);
  CHECK(first[0]["op"] == "serverInfo");
  CHECK(first[1]["op"] == "advertiseServices");
  for (const Json& service : first[1]["services"])
    for (const auto& [way, name] : {std::pair("request", "_Request"), std::pair("response", "_Response")}) {
      CHECK(service[way]["schemaName"] == service["type"].get<std::string>() + name);
      CHECK(service[way]["schema"] == service[std::string(way) + "Schema"]);
      CHECK(Json::parse(service[way]["schema"].get<std::string>())["type"] == "object");
    }
  REQUIRE(first[2]["channels"].size() == 2);
  CHECK(first[2]["channels"][0]["topic"] == "takt/events");
  CHECK(first[2]["channels"][1] == Json{{"id", 1},
                                        {"topic", "eye.pair.left"},
                                        {"encoding", "cdr"},
                                        {"schemaName", "foxglove_msgs/msg/CompressedImage"},
                                        {"schema", "definition"},
                                        {"schemaEncoding", "ros2msg"}});
  CHECK(scene.say(
      {{"op", "subscribe"}, {"subscriptions", {{{"id", 40}, {"channelId", 1}}, {{"id", 41}, {"channelId", 0}}}}}));
  REQUIRE(scene.hub.wanted().size() == 1);
  const web::View view = scene.hub.wanted()[0].view;
  CHECK(view.as == "cdr foxglove_msgs/msg/CompressedImage eye.pair.left");
  scene.hub.put(view, {{77, web::frame_of("abc")}});
  auto sent = scene.binary();
  REQUIRE(sent.size() == 1);
  CHECK(sent[0][0] == 1);
  CHECK(number_at<uint32_t>(sent[0], 1) == 40);
  CHECK(number_at<uint64_t>(sent[0], 5) == 77);
  CHECK(sent[0].substr(13) == "abc");
  scene.session->take_news(
      news({}, {{{"at_s", 2.0}, {"wall_ns", 2'000'000'001}, {"kind", "mark"}, {"node", "mind"}, {"text", "here"}}}));
  sent = scene.binary();
  REQUIRE(sent.size() == 1);
  CHECK(number_at<uint32_t>(sent[0], 1) == 41);
  CHECK(number_at<uint64_t>(sent[0], 5) == 2'000'000'001);
  CHECK(sent[0].find("mark: here") != std::string::npos);
  CHECK(scene.say({{"op", "subscribe"}, {"subscriptions", {{{"id", 42}, {"channelId", 9}}}}}));
  CHECK(scene.last("status")["level"] == 2);
  CHECK(scene.say({{"op", "unsubscribe"}, {"subscriptionIds", {40, 99, "x"}}}));
  CHECK(scene.hub.wanted().empty());
}

TEST_CASE("foxglove: parameters are read by all and set with the token, in their own units") {
  for (const bool may_change : {false, true}) {
    Scene scene;
    scene.hub.set_graph(shown_graph(), {});
    scene.foxglove(may_change);
    CHECK(scene.say({{"op", "getParameters"}, {"parameterNames", Json::array()}, {"id", "a"}}));
    const Json all = scene.last("parameterValues");
    CHECK(all["id"] == "a");
    CHECK(all["parameters"] ==
          Json{{{"name", "mind.rule"}, {"value", "sad"}}, {{"name", "mind.speed"}, {"value", 0.3}}});
    CHECK(scene.say({{"op", "subscribeParameterUpdates"}, {"parameterNames", {"mind.speed"}}}));
    scene.session->take_news(news({{{"node", "mind"}, {"param", "speed"}, {"value", 0.4}}}));
    CHECK(scene.last("parameterValues")["parameters"][0]["value"] == 0.4);
    scene.session->take_news(news({{{"node", "mind"}, {"param", "speed"}, {"value", 0.4}}}));
    CHECK(scene.last("parameterValues").is_null());
    CHECK(
        scene.say({{"op", "setParameters"}, {"parameters", {{{"name", "mind.speed"}, {"value", 0.5}}}}, {"id", "b"}}));
    if (!may_change) {
      CHECK(scene.asked.empty());
      CHECK(scene.last("status")["message"].get<std::string>().starts_with("this needs the token"));
      continue;
    }
    REQUIRE(scene.asked.size() == 2);
    CHECK(scene.asked[0].first == Json{{"do", "set"}, {"param", "mind.speed"}, {"value", "0.5 m/s"}});
    scene.asked[0].second({{"ok", true}});
    scene.asked[1].second({{"ok", true}, {"parameters", Json::array()}});
    CHECK(scene.last("parameterValues")["parameters"] == Json{{{"name", "mind.speed"}, {"value", 0.5}}});
  }
}

TEST_CASE("foxglove: services need the token and what they ask for") {
  const auto request = [](uint32_t service, const std::string& payload) {
    std::string bytes(1, '\2');
    for (const uint32_t number : {service, 9U, 4U}) bytes.append(reinterpret_cast<const char*>(&number), 4);
    return bytes + "json" + payload;
  };
  Scene scene;
  scene.hub.set_graph(shown_graph(), {});
  scene.foxglove(false);
  CHECK(scene.session->receive(request(0, "{\"mode\": \"manual\"}"), true));
  CHECK(scene.last("serviceCallFailure")["callId"] == 9);
  CHECK(scene.asked.empty());
  scene.foxglove(true);
  CHECK(scene.session->receive(request(0, "{\"mode\": 5}"), true));
  CHECK(scene.last("serviceCallFailure")["message"].get<std::string>().find("`mode`") != std::string::npos);
  CHECK(scene.session->receive(request(17, "{}"), true));
  CHECK(scene.last("serviceCallFailure")["serviceId"] == 17);
  CHECK(scene.session->receive(request(0, "{\"mode\": \"manual\"}"), true));
  REQUIRE(scene.asked.size() == 1);
  CHECK(scene.asked[0].first == Json{{"do", "mode"}, {"mode", "manual"}});
  scene.asked[0].second({{"ok", true}});
  const auto sent = scene.binary();
  REQUIRE(sent.size() == 1);
  CHECK(sent[0][0] == 3);
  CHECK(number_at<uint32_t>(sent[0], 5) == 9);
  CHECK(sent[0].substr(13) == "json{\"ok\":true}");
  for (size_t cut = 0; cut < 13; ++cut) CHECK_FALSE(scene.session->receive(request(0, "").substr(0, cut), true));
  CHECK(scene.say({{"op", "subscribeConnectionGraph"}}));
  const Json connections = scene.last("connectionGraphUpdate");
  CHECK(connections["publishedTopics"] == Json{{{"name", "eye.pair"}, {"publisherIds", {"eye"}}}});
  CHECK(connections["subscribedTopics"] == Json{{{"name", "eye.pair"}, {"subscriberIds", {"mind"}}}});
}
