// SPDX-License-Identifier: Apache-2.0
// roscpp: one ROS node per node of the graph, topics over TCP without delay. The coordinator runs a rosmaster beside.
#include <fcntl.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <signal.h>
#include <std_msgs/UInt8MultiArray.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bench/peers/medium.hpp"
#include "bench/suite.hpp"

namespace takt::bench {
namespace {

/// ROS 1's headers ask their allocators for `rebind`, which std::allocator lost in C++20.
template <class T>
struct Allocator : std::allocator<T> {
  Allocator() = default;
  template <class U>
  explicit Allocator(const Allocator<U>&) {}
  template <class U>
  struct rebind {
    using other = Allocator<U>;
  };
};
using Bytes = std_msgs::UInt8MultiArray_<Allocator<void>>;

class RosEnds final : public Ends {
 public:
  RosEnds(const MediumPlan& plan, size_t node) : inputs_(1 + plan.shape.sides(node).size()) {
    handle_.setCallbackQueue(&queue_);
    message_.data.resize(plan.bytes);
    if (node != plan.shape.sink()) publisher_ = handle_.advertise<Bytes>(topic(plan.id, node), 2);
    size_t at = 0;
    if (const auto producer = plan.shape.trigger(node)) subscribe(at++, topic(plan.id, *producer));
    for (size_t producer : plan.shape.sides(node)) subscribe(at++, topic(plan.id, producer));
    const size_t readers = plan.shape.leaving(node).size();
    for (int tries = 0; tries < 1000 && publisher_ && publisher_.getNumSubscribers() < readers; ++tries)
      ros::WallDuration(0.01).sleep();
  }
  ~RosEnds() override { ros::shutdown(); }
  RosEnds(const RosEnds&) = delete;
  RosEnds& operator=(const RosEnds&) = delete;

  /// A side message ends the sleep as well, as it does for any ROS user.
  bool wait() override {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(static_cast<double>(kPatienceNs) * 1e-9);
    while (!inputs_[0].held && ros::WallTime::now() < end)
      queue_.callAvailable(ros::WallDuration(static_cast<double>(kPatienceNs) * 1e-9));
    return static_cast<bool>(inputs_[0].held);
  }
  size_t take_sides() override {
    if (inputs_.size() == 1) return 0;
    queue_.callAvailable();
    size_t fresh = 0;
    for (size_t i = 1; i < inputs_.size(); ++i) fresh += static_cast<bool>(inputs_[i].held);
    return fresh;
  }
  void publish() override { publisher_.publish(message_); }
  void finish() override {
    for (Input& input : inputs_) input.held.reset();
  }
  std::string note() const override { return "TCP"; }

 private:
  struct Input {
    ros::Subscriber subscriber;
    boost::shared_ptr<const Bytes> held;
  };
  static std::string topic(const std::string& id, size_t node) { return "/" + id + "_" + std::to_string(node); }
  void subscribe(size_t at, const std::string& name) {
    Input* input = &inputs_[at];
    input->subscriber = handle_.subscribe<Bytes>(
        name, 2, [input](const boost::shared_ptr<const Bytes>& message) { input->held = message; }, ros::VoidConstPtr(),
        ros::TransportHints().tcpNoDelay());
  }

  ros::CallbackQueue queue_;
  ros::NodeHandle handle_;
  ros::Publisher publisher_;
  std::vector<Input> inputs_;  ///< the trigger first
  Bytes message_;
};

class Ros final : public Medium {
 public:
  explicit Ros(const MediumPlan& plan) : plan_(plan), port_(std::to_string(20'000 + getpid() % 20'000)) {
    master_ = fork();
    if (master_ < 0) throw CannotRun("fork failed");
    if (master_ > 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nowhere = ::open("/dev/null", O_WRONLY);
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
    execlp("rosmaster", "rosmaster", "--core", "-p", port_.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  ~Ros() override {
    kill(master_, SIGKILL);
    waitpid(master_, nullptr, 0);
  }
  Ros(const Ros&) = delete;
  Ros& operator=(const Ros&) = delete;

  std::unique_ptr<Ends> open(size_t node) override {
    const ros::M_string remappings{{"__master", "http://127.0.0.1:" + port_}, {"__ip", "127.0.0.1"}};
    ros::init(remappings, plan_.id + "_node" + std::to_string(node),
              ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
    for (int tries = 0; !ros::master::check(); ++tries) {
      if (tries == 100) throw CannotRun("no answer from rosmaster");
      ros::WallDuration(0.05).sleep();
    }
    return std::make_unique<RosEnds>(plan_, node);
  }

 private:
  const MediumPlan plan_;
  const std::string port_;
  pid_t master_ = -1;
};

}  // namespace

std::unique_ptr<Medium> make_roscpp(const MediumPlan& plan) { return std::make_unique<Ros>(plan); }

}  // namespace takt::bench
