// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/language/message_types.hpp"
#include "graph/ros2/topics.hpp"
#include "hal/settings/json_text.hpp"

namespace takt::ros2 {

using Json = nlohmann::ordered_json;

struct PublisherOptions {
  int run = 0;                     ///< process id; 0: the one that there is
  std::vector<std::string> ports;  ///< "NODE.PORT"; empty: all that have a message in ROS 2
  Pictures pictures = Pictures::compressed;
  int jpeg_quality = 75;
  std::string name_space;  ///< "" or "/robot_1"
  std::string odometry;    ///< the output that gives odom -> base_link; empty: the first odometry
  std::string map_pose;    ///< the pose output that gives map -> odom; empty: none
};

/// What there is to publish of a run that was described. Error: a port of the options is not there.
struct Offer {
  struct Port {
    std::string name;
    std::vector<Publication> publications;
  };
  std::vector<Port> ports;
  std::vector<std::string> left_out;  ///< outputs without a message in ROS 2
  std::string odometry;
};
tl::expected<Offer, std::string> offer_of(const Json& graph, const graph::MessageTypes& types,
                                          const PublisherOptions& options);

/// What is there of each run: /tf, /tf_static, /diagnostics.
std::vector<Publication> whole_run_publications();

}  // namespace takt::ros2
