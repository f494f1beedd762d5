// SPDX-License-Identifier: Apache-2.0
// takt-ros2, which `takt ros2` becomes: publishes the outputs of a running graph to ROS 2.
#include <fmt/format.h>
#include <pthread.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <map>

#include "graph/ace/ace_registry.hpp"
#include "graph/cli/boundary.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/ros2/publisher.hpp"
#include "rt/capability.hpp"

namespace takt::ros2 {
namespace {

using command::kBadInput;
using command::kDeviceOrSystem;
using command::kNotOk;
using command::kOk;
using command::refuse;

constexpr int kMostDomain = 232;  ///< of DDS: those above have no ports

struct Options {
  PublisherOptions publisher;
  dds::Participant::Options network;
  bool list = false;
};

std::atomic<bool> ending{false};

void end_at_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { ending.store(true); });
}

/// What a ROS 2 node of the same shell would use. Error: it is no number.
tl::expected<int, std::string> domain_of_environment() {
  const char* text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == '\0') return 0;
  const std::string_view given(text);
  int domain = 0;
  const auto [end, error] = std::from_chars(given.data(), given.data() + given.size(), domain);
  if (error == std::errc() && end == given.data() + given.size() && domain >= 0 && domain <= kMostDomain) return domain;
  return tl::unexpected(fmt::format("ROS_DOMAIN_ID is `{}`, not a number from 0 to {}", given, kMostDomain));
}

int list(const Options& options, const graph::MessageTypes& types) {
  const auto run = attach::chosen_run(options.publisher.run);
  if (!run) return refuse(run.error(), kNotOk);
  auto connection = attach::connect_to(*run);
  const auto graph = connection && connection->write({{"do", "describe"}}) ? connection->read_line() : std::nullopt;
  if (!graph || !graph->contains("ports")) return refuse("the run does not say what it is", kNotOk);
  const auto offer = offer_of(*graph, types, options.publisher);
  if (!offer) return refuse(offer.error(), kBadInput);
  std::map<std::string, Publication> topics;
  for (const Offer::Port& port : offer->ports)
    for (const Publication& publication : port.publications) topics.emplace(publication.topic, publication);
  for (const Publication& publication : whole_run_publications()) topics.emplace(publication.topic, publication);
  for (const auto& [name, publication] : topics)
    fmt::print("{}  {}  {}\n", name, publication.schema, words(publication.profile));
  if (!offer->left_out.empty())
    fmt::print("without a message in ROS 2: {}\n", CLI::detail::join(offer->left_out, ", "));
  return kOk;
}

int publish(const Options& options, const graph::MessageTypes& types) {
  end_at_signals();
  keep_rights(Rights::none);
  try {
    dds::Participant participant(options.network, enclave());
    Publisher publisher(participant, types, options.publisher);
    fmt::print("takt ros2: node {}/takt on {}, domain {}\n", options.publisher.name_space, options.network.address,
               options.network.domain);
    if (std::fflush(stdout) != 0)
      return refuse("stdout does not take what is published where\n  fix: room for it", kDeviceOrSystem);
    publisher.run(ending);
    const Publisher::Counts& counts = publisher.counts();
    fmt::print("written: {}, not sent to slow readers: {}, damaged: {}, steps of the wall clock: {}\n", counts.written,
               counts.unsent, counts.unsound, counts.clock_steps > 0 ? counts.clock_steps - 1 : 0);
  } catch (const std::runtime_error& problem) {
    return refuse(fmt::format("{}\n  fix: --address of this machine (`ip address`), another --domain", problem.what()),
                  kDeviceOrSystem);
  }
  return kOk;
}

int run(int argc, char** argv) {
  CLI::App app{"Publishes the outputs of a running graph to ROS 2, over DDS", "takt ros2"};
  Options options;
  PublisherOptions& to = options.publisher;
  app.add_option("--run", to.run, "process id of the run; without it the one that there is");
  app.add_option("--address", options.network.address,
                 "IP address of the interface to ROS 2, 127.0.0.1 by default; nothing is sent or heard on any other");
  CLI::Option* domain =
      app.add_option("--domain", options.network.domain, "domain of DDS, 0 to 232; without it ROS_DOMAIN_ID, or 0")
          ->check(CLI::Range(0, kMostDomain));
  app.add_option("--port", to.ports,
                 "output NODE.PORT to publish, several; without it all that ROS 2 has a message for");
  app.add_option_function<std::string>(
         "--pictures",
         [&to](const std::string& word) {
           to.pictures = word == "image" ? Pictures::image : word == "both" ? Pictures::both : Pictures::compressed;
         },
         "compressed (CompressedImage, the default), image (Image) or both")
      ->check(CLI::IsMember({"compressed", "image", "both"}));
  app.add_option("--quality", to.jpeg_quality, "of JPEG, 1 to 100; 75 by default")->check(CLI::Range(1, 100));
  app.add_option("--namespace", to.name_space, "of node and topics, such as /robot_1; none by default");
  app.add_option("--odometry", to.odometry, "output that gives odom -> base_link; without it the first odometry");
  app.add_option("--map-pose", to.map_pose, "output with the robot's pose in the map, for map -> odom");
  app.add_flag("--list", options.list, "prints topics, types and profiles, and ends");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kBadInput;
  }
  if (domain->count() == 0) {
    const auto given = domain_of_environment();
    if (!given) return refuse(given.error(), kBadInput);
    options.network.domain = *given;
  }
  if (!is_namespace(to.name_space))
    return refuse(fmt::format("--namespace `{}` is none of ROS 2: a slash, then letters, digits and _, as /robot_1",
                              to.name_space),
                  kBadInput);
  const Registry registry = ace_registry();
  const graph::MessageTypes types = graph::message_types(registry);
  return options.list ? list(options, types) : publish(options, types);
}

}  // namespace
}  // namespace takt::ros2

int main(int argc, char** argv) {
  return takt::command::at_boundary(argc, argv, [&] { return takt::ros2::run(argc, argv); });
}
