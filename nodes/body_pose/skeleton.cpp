// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/skeleton.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>

#include "rt/file/input_file.hpp"

namespace takt::body_pose {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// One of the alternatives for a part of the body: where some of the links point.
struct State {
  std::string name;
  std::map<size_t, Eigen::Vector3d> directions;
};

class Reader {
 public:
  explicit Reader(std::filesystem::path file) : file_(std::move(file)) {
    words_ = {{"skeleton", {1, [this] { skeleton_.name = word(1); }}},
              {"slack", {1, [this] { skeleton_.slack_rad = number(1, 0, 180) * kDegree; }}},
              {"start", {1, [this] { start(); }}},
              {"link", {6, [this] { link(); }}},
              {"dof", {3, [this] { dof(); }}},
              {"mirrors", {1, [this] { last().mirrors = known(word(1)); }}},
              {"follows", {0, [this] { last().follows_parent = true; }}},
              {"length", {2, [this] { skeleton_.links[known(word(1))].length_m = number(2, 0.01, 100); }}},
              {"points", {2, [this] { pointer(); }}},
              {"part", {1, [this] { parts_.emplace_back(); }}},
              {"state", {1, [this] { state(); }}},
              {"pose", {1, [this] { pose(); }}},
              {"direction", {4, [this] { direction(); }}},
              {"like", {1, [this] { like(); }}}};
  }

  Skeleton read() {
    parse(file_);
    if (skeleton_.links.size() < 2) fail("describes no link; write `start NAME` and `link NAME PARENT LENGTH X Y Z`");
    for (size_t i = skeleton_.links.size(); i-- > 1;)
      skeleton_.links[skeleton_.links[i].parent].descendants += 1 + skeleton_.links[i].descendants;
    combine();
    return std::move(skeleton_);
  }

 private:
  struct Word {
    size_t arguments;
    std::function<void()> take;
  };

  [[noreturn]] void fail(const std::string& what) const {
    throw SkeletonError(file_.string() + ":" + std::to_string(line_number_) + ": " + what);
  }

  void parse(const std::filesystem::path& file) {
    require_readable<SkeletonError>(file);
    std::ifstream in(file);
    if (!in) fail("cannot be read; a skeleton is a text file, such as graph/skeletons/human.txt");
    for (std::string text; std::getline(in, text);) {
      ++line_number_;
      std::istringstream line(text.substr(0, text.find('#')));
      line_.clear();
      for (std::string word; line >> word;) line_.push_back(word);
      if (!line_.empty()) take();
    }
  }

  void take() {
    const auto found = words_.find(line_[0]);
    if (found == words_.end()) {
      std::string valid;
      for (const auto& [name, word] : words_) valid += (valid.empty() ? "" : ", ") + name;
      fail("unknown word `" + line_[0] + "`; valid are " + valid);
    }
    if (line_.size() - 1 != found->second.arguments)
      fail("`" + line_[0] + "` takes " + std::to_string(found->second.arguments) + " words, here are " +
           std::to_string(line_.size() - 1));
    found->second.take();
  }

  const std::string& word(size_t i) const { return line_[i]; }

  double number(size_t i, double low, double high) const {
    size_t used = 0;
    double value = low - 1;
    try {
      value = std::stod(word(i), &used);
    } catch (const std::exception&) {
    }
    if (used != word(i).size() || !(value >= low && value <= high)) {
      std::ostringstream range;
      range << low << ".." << high;
      fail("`" + word(i) + "` must be a number in " + range.str());
    }
    return value;
  }

  Eigen::Vector3d unit(size_t i) const {
    const Eigen::Vector3d v(number(i, -1e3, 1e3), number(i + 1, -1e3, 1e3), number(i + 2, -1e3, 1e3));
    if (v.norm() < 1e-6) fail("a direction must not be 0 0 0");
    return v.normalized();
  }

  /// A link by its name; 0 is the start.
  size_t known(const std::string& name) const {
    std::string valid;
    for (size_t i = 0; i < skeleton_.links.size(); ++i) {
      if (skeleton_.links[i].name == name) return i;
      valid += (i == 0 ? "" : ", ") + skeleton_.links[i].name;
    }
    fail("there is no link `" + name + "` above this line; there are " + (valid.empty() ? "none" : valid));
  }

  Link& last() {
    if (skeleton_.links.size() < 2) fail("`" + word(0) + "` stands before the first link");
    return skeleton_.links.back();
  }

  void start() {
    if (!skeleton_.links.empty()) fail("there is a start already: " + skeleton_.links[0].name);
    skeleton_.links.push_back({.name = word(1)});
  }

  void link() {
    if (skeleton_.links.empty()) fail("`link` stands before `start NAME`");
    if (skeleton_.links.size() == kMostJoints)
      fail("a skeleton has at most " + std::to_string(kMostJoints - 1) + " links");
    if (std::any_of(skeleton_.links.begin(), skeleton_.links.end(), [&](const Link& l) { return l.name == word(1); }))
      fail("there is a link `" + word(1) + "` already");
    skeleton_.links.push_back(
        {.name = word(1), .parent = known(word(2)), .length_m = number(3, 0.01, 100), .rest = unit(4)});
  }

  void dof() {
    constexpr std::string_view kAxes = "xyz";
    const size_t axis = word(1).size() == 1 ? kAxes.find(word(1)) : std::string_view::npos;
    if (axis == std::string_view::npos) fail("`" + word(1) + "` is no axis; valid are x, y, z");
    const Dof dof{static_cast<int>(axis), number(2, -180, 180) * kDegree, number(3, -180, 180) * kDegree};
    if (dof.min_rad >= dof.max_rad) fail("the smallest angle must lie below the largest");
    last().dofs.push_back(dof);
  }

  void pointer() {
    if (skeleton_.pointers.size() == Body::kMostPointers)
      fail("at most " + std::to_string(Body::kMostPointers) + " pairs of joints can point");
    skeleton_.pointers.push_back({known(word(1)), known(word(2))});
  }

  void state() {
    if (parts_.empty()) fail("`state` stands before the first `part NAME`");
    now_ = &parts_.back().emplace_back(State{word(1), {}});
  }

  void pose() { now_ = &single_.emplace_back(State{word(1), {}}); }

  void direction() {
    if (now_ == nullptr) fail("`direction` stands before the first `state` or `pose`");
    now_->directions[known(word(1))] = unit(2);
  }

  void like() {
    if (!skeleton_.links.empty()) fail("`like` must come first");
    const std::filesystem::path mine = file_;
    const int line = line_number_;
    file_ = mine.parent_path() / word(1);
    line_number_ = 0;
    if (++depth_ > 4) fail("skeletons refer to one another");
    parse(file_);
    file_ = mine;
    line_number_ = line;
  }

  TypicalPose resting(const std::string& name) const {
    TypicalPose pose{name, {}};
    for (const Link& link : skeleton_.links) pose.directions.push_back(link.rest);
    return pose;
  }

  static void apply(const State& state, TypicalPose& pose) {
    pose.name += (pose.name.empty() ? "" : " ") + state.name;
    for (const auto& [link, direction] : state.directions) pose.directions[link] = direction;
  }

  /// Every state of a part with every state of the others, then the single poses.
  void combine() {
    std::vector<TypicalPose> poses{resting("")};
    for (const auto& states : parts_) {
      std::vector<TypicalPose> more;
      for (const TypicalPose& pose : poses)
        for (const State& state : states) apply(state, more.emplace_back(pose));
      poses = std::move(more);
    }
    if (poses.empty()) fail("a part has no state");
    for (const State& state : single_) apply(state, poses.emplace_back(resting("")));
    skeleton_.poses = std::move(poses);
  }

  std::filesystem::path file_;
  std::map<std::string, Word, std::less<>> words_;
  int line_number_ = 0, depth_ = 0;
  std::vector<std::string> line_;
  Skeleton skeleton_;
  std::vector<std::vector<State>> parts_;
  std::vector<State> single_;
  State* now_ = nullptr;
};

}  // namespace

int Skeleton::degrees_of_freedom() const {
  int sum = 0;
  for (const Link& link : links) sum += static_cast<int>(link.dofs.size());
  return sum;
}

size_t Skeleton::link(const std::string& name_of_link) const {
  for (size_t i = 0; i < links.size(); ++i)
    if (links[i].name == name_of_link) return i;
  throw std::out_of_range("skeleton " + name + " has no link " + name_of_link);
}

Skeleton read_skeleton(const std::filesystem::path& file) { return Reader(file).read(); }

}  // namespace takt::body_pose
