// SPDX-License-Identifier: Apache-2.0
#include "graph/language/message_field.hpp"

#include <doctest/doctest.h>

#include <cstring>

#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/text_status.hpp"

using namespace takt;
using namespace takt::graph;

namespace {

template <class T>
std::optional<FieldValue> value(const T& message, std::string_view name) {
  const auto field = find_field(MessageType::of<T>(), name);
  REQUIRE_MESSAGE(field, std::string(name));
  return value_of(*field, &message);
}

/// Apart, since GCC 12 warns of comparisons with a temporary variant.
template <class Is, class T>
Is as(const T& message, std::string_view name) {
  const auto is = value(message, name);
  REQUIRE(is);
  REQUIRE(std::holds_alternative<Is>(*is));
  return std::get<Is>(*is);
}

template <class T>
std::string refusal(std::string_view name) {
  const auto field = find_field(MessageType::of<T>(), name);
  REQUIRE_FALSE(field);
  return field.error();
}

/// A message with room for its arrays, which a test must not outlive.
template <class T>
struct Message {
  explicit Message(const Capacity& capacity) : memory(MessageType::of<T>().bytes(capacity) / 64 + 1) {
    MessageType::of<T>().place(memory.data(), capacity);
  }
  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::vector<Line> memory;
  T& operator*() { return *reinterpret_cast<T*>(memory.data()); }
};

}  // namespace

TEST_CASE("numbers, nested and of every width; lists by their index") {
  Odometry odometry;
  odometry.speed_m_s = 0.25;
  CHECK(as<double>(odometry, "speed_m_s") == 0.25);
  Pose pose;
  pose.transform.qx = 0.5;
  pose.covariance[35] = 7;
  CHECK(as<double>(pose, "transform.qx") == 0.5);
  CHECK(as<double>(pose, "covariance[35]") == 7.0);
  StopCommand stop;
  stop.reasons = 5;
  CHECK(as<double>(stop, "reasons") == 5.0);
}

TEST_CASE("arrays: how many elements, or one of their numbers") {
  Message<Detections> detections({0, 0, 1, 4});
  CHECK(as<double>(*detections, "boxes") == 0.0);
  CHECK_FALSE(value(*detections, "boxes[0]"));
  (*detections).boxes.resize(2);
  (*detections).boxes[1] = {3, 10, 20, 30, 40, 0.5f};
  CHECK(as<double>(*detections, "boxes") == 2.0);
  CHECK(as<double>(*detections, "boxes[6]") == 3.0);
  CHECK(as<double>(*detections, "boxes[11]") == 0.5);
  CHECK_FALSE(value(*detections, "boxes[12]"));
}

TEST_CASE("texts: of arrays and of fixed length, names of objects as words; the only field needs no name") {
  Message<TextStatus> status({0, 0, 1, 32});
  (*status).text.resize(10);
  std::memcpy((*status).text.data(), "IDLE: done", 10);
  CHECK(as<std::string>(*status, "text") == "IDLE: done");
  CHECK(as<std::string>(*status, "") == "IDLE: done");
  ActionOutcome outcome;
  std::strcpy(outcome.reason, "no such cup");
  CHECK(as<std::string>(outcome, "reason") == "no such cup");
  Message<ObjectReports> reports({0, 0, 1, 2});
  (*reports).names.resize(2);
  std::strcpy((*reports).names[0].name, "cup_1");
  std::strcpy((*reports).names[0].type, "cup");
  std::strcpy((*reports).names[1].name, "bottle_1");
  CHECK(as<std::string>(*reports, "names") == "cup_1 cup bottle_1");
}

TEST_CASE("what there is not, with what there is") {
  CHECK(refusal<Odometry>("sped_m_s").find("did you mean `speed_m_s`?") != std::string::npos);
  CHECK(refusal<Odometry>("").find("must be said as `field`") != std::string::npos);
  CHECK(refusal<Odometry>("speed_m_s[0]").find("no list") != std::string::npos);
  CHECK(refusal<Pose>("covariance").find("covariance[35]") != std::string::npos);
  CHECK(refusal<Pose>("covariance[36]").find("has no number") != std::string::npos);
  CHECK(refusal<TextStatus>("text[0]").find("no list of numbers") != std::string::npos);
}
