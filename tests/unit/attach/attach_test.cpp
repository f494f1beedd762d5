// SPDX-License-Identifier: Apache-2.0
// Speaking to a running graph: messages as text and pictures, the socket, its questions.
#include <doctest/doctest.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>

#include "graph/ace/ace_registry.hpp"
#include "graph/attach/message_text.hpp"
#include "graph/attach/parameters.hpp"
#include "graph/attach/server.hpp"
#include "graph/compose/composition.hpp"
#include "graph/language/message_types.hpp"
#include "graph/language/overlay.hpp"
#include "graph/pictures/pictures.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/sched/param_mail.hpp"
#include "tests/temporary_folder.hpp"

namespace {

using namespace takt;
using Json = nlohmann::ordered_json;

/// An empty message of a type in memory of its own.
struct Placed {
  Placed(const MessageType& type, const Capacity& capacity) : memory(type.bytes(capacity) + 64), start(memory.data()) {
    size_t room = memory.size();
    REQUIRE(std::align(64, memory.size() - 64, start, room) != nullptr);
    type.place(start, capacity);
  }
  Placed(const Placed&) = delete;
  Placed& operator=(const Placed&) = delete;
  std::vector<std::byte> memory;
  void* start;
};

template <class T>
struct Built : Placed {
  explicit Built(const Capacity& capacity) : Placed(MessageType::of<T>(), capacity), message(static_cast<T*>(start)) {}
  T* message;
};

struct Thermogram {
  static constexpr std::string_view type_name = "thermogram";
  int32_t width = 0, height = 0;
  Array<uint8_t> pixels;
  bool sound() const { return image_fits(width, height, 1, pixels.capacity); }
  void show(Viewer& to) const { to.picture({pixels.data(), width, height}); }
  TAKT_FIELDS(Thermogram, (width, "px"), (height, "px"), (pixels, "1", capacity.pixels()))
};

/// A folder for sockets that is ours alone, named by the environment as at a login. In /tmp, because the path of a
/// socket must be short.
struct Folder : test::TemporaryFolder {
  Folder() : TemporaryFolder("/tmp") { setenv("XDG_RUNTIME_DIR", path.c_str(), 1); }
};

/// The shipped graph, as far as it is known without any device, with one output that this test writes.
struct Scene {
  Folder folder;
  Registry registry = ace_registry();
  graph::GraphSpec spec;
  Plan plan;
  std::unique_ptr<RunBoard> board;
  std::unique_ptr<Transport> transport;

  Scene() {
    spec.name = "test";
    spec.nodes.push_back({"map", "mapping_3d", "depth", {}, {}, {}, {}});
    TaskPlan task;
    task.name = "map";
    task.rate = Rate{2, 1};
    plan.tasks.push_back(task);
    plan.ports.push_back({"map", "obstacles", &MessageType::of<Grid>(), {.width = 4, .height = 3}, 2, 2, 2});
    board = std::make_unique<RunBoard>(plan);
    transport = make_local_transport(plan.ports);
  }
  Json ask(const Json& question) {
    auto connection = attach::connect_to(getpid());
    REQUIRE(connection);
    REQUIRE(connection->write(question));
    const auto answer = connection->read_line();
    REQUIRE(answer);
    return *answer;
  }
};

}  // namespace

TEST_CASE("a message becomes JSON by its field descriptors") {
  Built<PointCloud> cloud({.count = 20});
  for (int i = 0; i < 12; ++i) cloud.message->points.push_back({float(i), 0.5f, -1});
  cloud.message->step_px = 2;
  const Json json = attach::message_json(MessageType::of<PointCloud>(), cloud.message, 3);
  CHECK(json["step_px"] == 2);
  CHECK(json["sensor_in_robot.qw"] == 1.0);
  CHECK(json["points"]["size"] == 12);
  CHECK(json["points"]["first"].size() == 3);
  CHECK(json["points"]["first"][2] == Json({2.0, 0.5, -1.0}));
  Built<TextStatus> text({.count = 8});
  for (const char c : std::string("hello")) text.message->text.push_back(c);
  CHECK(attach::message_json(MessageType::of<TextStatus>(), text.message)["text"] == "hello");
}

TEST_CASE("every message type becomes JSON with one entry a field, and those that can be seen a picture") {
  const Registry registry = ace_registry();
  const graph::MessageTypes types = graph::message_types(registry);
  CHECK(types.size() >= 20);
  for (const auto& [name, type] : types) {
    const Placed placed(*type, {.width = 4, .height = 2, .channels = 1, .count = 3});
    CHECK(attach::message_json(*type, placed.start).size() == type->fields.size());
  }
  Built<Grid> grid({.width = 4, .height = 3});
  grid.message->width = 4;
  grid.message->height = 3;
  grid.message->cells.resize(12);
  const auto png = message_png(MessageType::of<Grid>(), grid.message);
  REQUIRE(png);
  const cv::Mat image = cv::imdecode(std::vector<char>(png->begin(), png->end()), cv::IMREAD_COLOR);
  CHECK(image.cols == 4 * 6);
  CHECK(image.rows == 3 * 6);
  grid.message->width = 5;  // more cells than there are: it is not sound
  CHECK_FALSE(message_png(MessageType::of<Grid>(), grid.message));
  Built<StereoPair> pair({.width = 3, .height = 2});
  pair.message->width = 3;
  pair.message->height = 2;
  pair.message->channels = 1;
  const auto side_by_side = message_png(MessageType::of<StereoPair>(), pair.message);
  REQUIRE(side_by_side);
  const cv::Mat both =
      cv::imdecode(std::vector<char>(side_by_side->begin(), side_by_side->end()), cv::IMREAD_UNCHANGED);
  CHECK(both.cols == 6);
  CHECK(both.rows == 2);
  Built<Odometry> odometry({});
  CHECK_FALSE(message_png(MessageType::of<Odometry>(), odometry.message));
  Built<PointCloud> cloud({.count = 2});
  cloud.message->points.push_back({1, 2, 3});
  cloud.message->colours.push_back({4, 5, 6});
  const auto ply = message_ply(MessageType::of<PointCloud>(), cloud.message);
  REQUIRE(ply);
  CHECK(ply->find("element vertex 1\n") != std::string::npos);
  CHECK(ply->ends_with("\6\5\4"));
  CHECK_FALSE(message_ply(MessageType::of<Odometry>(), odometry.message));
}

TEST_CASE("a type that no room knows is seen as it shows itself") {
  Built<Thermogram> hot({.width = 2, .height = 3});
  hot.message->width = 2;
  hot.message->height = 3;
  for (uint8_t i = 0; i < 6; ++i) hot.message->pixels.push_back(static_cast<uint8_t>(40 * i));
  const auto png = message_png(MessageType::of<Thermogram>(), hot.message);
  REQUIRE(png);
  const cv::Mat image = cv::imdecode(std::vector<char>(png->begin(), png->end()), cv::IMREAD_UNCHANGED);
  REQUIRE(image.size() == cv::Size(2, 3));
  CHECK(image.at<uint8_t>(2, 1) == 200);
  CHECK_FALSE(message_ply(MessageType::of<Thermogram>(), hot.message));
  CHECK((MessageType::of<VelocityCommand>().show == nullptr));
}

TEST_CASE("top, stop and unknown questions over the socket") {
  Scene scene;
  scene.board->task(0).completed.store(17);
  const attach::Server server({scene.registry, scene.spec, scene.plan, *scene.board, *scene.transport});
  REQUIRE(server.lacks().empty());
  CHECK(attach::running() == std::vector<int>{getpid()});
  const Json top = scene.ask({{"do", "top"}});
  CHECK(top["nodes"][0]["name"] == "map");
  CHECK(top["nodes"][0]["type"] == "mapping_3d");
  CHECK(top["nodes"][0]["completed"] == 17);
  CHECK_FALSE(top["nodes"][0].contains("device"));
  CHECK(scene.ask({{"do", "dance"}})["error"].get<std::string>().find("known: top, echo") != std::string::npos);
  CHECK(scene.board->stop().end_ns() == INT64_MAX);
  CHECK(scene.ask({{"do", "stop"}})["ok"] == true);
  CHECK(scene.board->stop().end_ns() < INT64_MAX);
}

TEST_CASE("echo gives each new message once, and lets it go") {
  Scene scene;
  const auto writer = scene.transport->make_writer(0);
  const auto publish = [&](int16_t value) {
    auto* grid = reinterpret_cast<Grid*>(writer->loan() + 1);
    grid->width = 4;
    grid->height = 3;
    grid->cells.resize(12);
    grid->cells[0] = value;
    writer->publish(1, 0, 0);
  };
  publish(500);
  const attach::Server server({scene.registry, scene.spec, scene.plan, *scene.board, *scene.transport});
  auto connection = attach::connect_to(getpid());
  REQUIRE(connection);
  REQUIRE(connection->write({{"do", "echo"}, {"port", "map.obstacles"}, {"as", "png"}, {"count", 2}}));
  const auto first = connection->read_line();
  REQUIRE(first);
  CHECK((*first)["type"] == "grid");
  CHECK((*first)["message"]["cells"]["first"][0] == 500);
  CHECK(connection->read_bytes((*first)["bytes"].get<size_t>()));
  publish(700);
  const auto second = connection->read_line();
  REQUIRE(second);
  CHECK((*second)["sequence"] == 2);
  CHECK((*second)["message"]["cells"]["first"][0] == 700);
  CHECK(connection->read_bytes((*second)["bytes"].get<size_t>()));
  CHECK(writer->statistics().in_use == 2);  // what the ring keeps, nothing else
  const auto shown = [&](const Json& question) { return scene.ask(question)["message"]["cells"]["first"].size(); };
  CHECK(shown({{"do", "echo"}, {"port", "map.obstacles"}}) == 8);
  CHECK(shown({{"do", "echo"}, {"port", "map.obstacles"}, {"items", 100U}}) == 12);
  const std::string wrong = scene.ask({{"do", "echo"}, {"port", "map.obstacle"}})["error"];
  CHECK(wrong.find("did you mean `map.obstacles`") != std::string::npos);
}

TEST_CASE("set refuses what the parameter would refuse, before the node sees it") {
  Scene scene;
  const attach::Server server({scene.registry, scene.spec, scene.plan, *scene.board, *scene.transport});
  const auto error = [&](const char* param, const char* value) {
    return scene.ask({{"do", "set"}, {"param", param}, {"value", value}}).value("error", "");
  };
  CHECK(error("maps.voxel", "0.2m").find("did you mean `map`") != std::string::npos);
  CHECK(error("map.z_flor", "0.2m").find("did you mean `z_floor`") != std::string::npos);
  CHECK(error("map.z_floor", "0.2").find("without a unit") != std::string::npos);
  CHECK(error("map.z_floor", "20m").find("must lie in") != std::string::npos);
  CHECK(error("mapping:z_floor", "0.2m").find("there is no node of type `mapping`; did you mean `mapping_3d`") !=
        std::string::npos);
  CHECK(error("mapping_3d:z_flor", "0.2m").find("node `map` (type `mapping_3d`)") != std::string::npos);
  CHECK(scene.board->mail(0).state.load() == ParamMail::empty);
}

TEST_CASE("a value that the node accepted stands in get and top, and with `keep` in the graph's overlay") {
  Scene scene;
  setenv("TAKT_STATE_DIR", (scene.folder.path / "state").c_str(), 1);
  const auto node = scene.registry.nodes.find("cruise")->make();
  node->end_setup();  // nothing was read: all are live
  scene.plan.tasks[0].node = node.get();
  scene.spec.nodes[0].type = "cruise";
  scene.spec.nodes[0].params["turn"] = {0.3, {}, graph::ChosenBy::command_line};
  scene.board = std::make_unique<RunBoard>(scene.plan);
  const attach::Server server({scene.registry, scene.spec, scene.plan, *scene.board, *scene.transport});
  /// Asks, and does meanwhile what a job of the node does.
  const auto set = [&](const Json& question) {
    auto connection = attach::connect_to(getpid());
    REQUIRE(connection);
    REQUIRE(connection->write(question));
    ParamMail& mail = scene.board->mail(0);
    while (mail.state.load() != ParamMail::posted) sched_yield();
    REQUIRE(deliver(mail, *node));
    keep(scene.board->kept(0, mail.param), mail, 2'500'000'000);
    mail.state.store(ParamMail::taken);
    return connection->read_line().value_or(Json());
  };
  CHECK(set({{"do", "set"}, {"param", "map.speed"}, {"value", "0.25 m/s"}}) == Json{{"ok", true}});
  const auto overlay = graph::overlay_file(scene.folder.path / "state", "test");
  CHECK_FALSE(std::filesystem::exists(overlay));
  const Json speed = scene.ask({{"do", "get"}, {"param", "map.speed"}})["parameters"][0];
  CHECK(speed["value"] == 0.25);
  CHECK(speed["from"] == "set");
  CHECK(speed["at_s"] == 2.5);
  CHECK(speed["by_user"] == geteuid());
  CHECK(attach::parameter_text(speed) == "map.speed 0.25 m/s (set at 2.5 s)");
  const Json all = scene.ask({{"do", "get"}})["parameters"];
  REQUIRE(all.size() == 2);
  CHECK(all == scene.ask({{"do", "top"}})["parameters"]);
  CHECK(attach::parameter_text(all[1]) == "map.turn 0.3 rad/s (command line)");
  CHECK(scene.ask({{"do", "get"}, {"param", "map.from"}})["parameters"][0]["from"] == "default");
  CHECK(scene.ask({{"do", "get"}, {"param", "map.fro"}})["error"].get<std::string>().find("`map.from`") !=
        std::string::npos);
  const Json kept = set({{"do", "set"}, {"param", "cruise:speed"}, {"value", "0.3 m/s"}, {"keep", true}});
  CHECK(kept["kept"] == overlay.string());
  std::vector<graph::Problem> problems;
  const graph::Overlay read = graph::read_overlay(overlay, "test", problems);
  REQUIRE(read.values.size() == 1);
  CHECK(read.values[0].text == "0.3 m/s");
  CHECK(scene.ask({{"do", "forget"}, {"param", "map.speed"}})["forgotten"] == overlay.string());
  CHECK(scene.ask({{"do", "forget"}, {"param", "map.speed"}}).contains("error"));
  CHECK(scene.ask({{"do", "get"}, {"param", "map.speed"}})["parameters"][0]["value"] == 0.3);
}

TEST_CASE("a question of a wrong kind is refused, and the next one answered") {
  Scene scene;
  const attach::Server server({scene.registry, scene.spec, scene.plan, *scene.board, *scene.transport});
  auto connection = attach::connect_to(getpid());
  REQUIRE(connection);
  for (const Json& question :
       {Json{{"do", 5}}, Json{{"do", "set"}, {"param", 1}}, Json{{"do", "echo"}, {"port", nullptr}},
        Json{{"do", "echo"}, {"port", "map.obstacles"}, {"count", "many"}},
        Json{{"do", "echo"}, {"port", "map.obstacles"}, {"items", -1}}}) {
    REQUIRE(connection->write(question));
    const auto answer = connection->read_line();
    REQUIRE(answer);
    CHECK(answer->contains("error"));
  }
  REQUIRE(connection->write({{"do", "top"}}));
  const auto top = connection->read_line();
  REQUIRE(top);
  CHECK((*top)["running_s"] == 0.0);  // no epoch yet
}

TEST_CASE("several listen to one output: each message is drawn once, and who goes is not missed") {
  Scene scene;
  static std::atomic<int> drawings{0};
  drawings.store(0);
  scene.registry.pictures.png = [](const MessageType&, const void*) {
    drawings.fetch_add(1);
    return std::optional<std::string>("picture");
  };
  const auto writer = scene.transport->make_writer(0);
  const auto publish = [&] { writer->loan(), writer->publish(1, 0, 0); };
  const attach::Server server({scene.registry, scene.spec, scene.plan, *scene.board, *scene.transport});
  publish();
  std::vector<attach::Connection> clients;
  for (int i = 0; i < 3; ++i) {
    auto client = attach::connect_to(getpid());
    REQUIRE(client);
    REQUIRE(client->write({{"do", "echo"}, {"port", "map.obstacles"}, {"as", "png"}, {"count", 2}}));
    clients.push_back(std::move(*client));
  }
  const auto all_see = [&](uint64_t sequence) {
    for (attach::Connection& client : clients) {
      const auto line = client.read_line();
      REQUIRE(line);
      CHECK((*line)["sequence"] == sequence);
      CHECK(client.read_bytes((*line)["bytes"].get<size_t>()) == "picture");
    }
  };
  all_see(1);
  CHECK(drawings.load() == 1);
  clients.pop_back();
  publish();
  all_see(2);
  CHECK(drawings.load() == 2);
  clients.clear();
  CHECK_FALSE(scene.ask({{"do", "echo"}, {"port", "map.obstacles"}}).contains("error"));
  CHECK(writer->statistics().in_use == 2);  // what the ring keeps, nothing else
}
