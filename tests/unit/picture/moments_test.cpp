// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "nodes/picture/moment.hpp"
#include "nodes/semantic/reports.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/sched/port_access.hpp"
#include "rt/testing.hpp"
#include "tests/temporary_folder.hpp"

namespace takt {
void register_moments(NodeTypes& types);
}

using namespace takt;

namespace {

struct Known : test::Box<ObjectReports> {
  Known(const char* level) : Box({0, 0, 1, 4}) {
    (*this)->in_map = 1;
    for (const char* name : {"cup_1", "table_1"}) {
      ObjectName said;
      semantic::set_text(name, said.name);
      semantic::set_text(std::string_view(name).substr(0, std::string_view(name).size() - 2), said.type);
      (*this)->names.push_back(said);
      const bool cup = (*this)->names.size == 1;
      (*this)->places.push_back({cup ? 1.0F : 2.0F, 0.5F, 0, 0, 1, cup ? 1.0F : 0.0F});
    }
    ObjectAttribute attribute;
    semantic::set_text("level", attribute.name);
    semantic::set_text(level, attribute.value);
    (*this)->attributes.push_back(attribute);
  }
};

struct Words : test::Box<TextStatus> {
  explicit Words(std::string_view words) : Box({0, 0, 1, 100}) {
    for (const char c : words) (*this)->text.push_back(c);
  }
};

/// Connected to what is known and said, writing to a folder of the test's own.
struct MomentsBench {
  test::TemporaryFolder folder;
  std::unique_ptr<Node> node;
  uint64_t sequence = 0;

  explicit MomentsBench(int most = 24) {
    NodeTypes types;
    register_moments(types);
    node = types.find("moments")->make();
    test::set(*node, "most", int64_t{most});
    PortAccess::connect(test::input(*node, "reports"), {0, 0, 1, 4});
    PortAccess::connect(test::input(*node, "speech"), {0, 0, 1, 100});
    PortAccess::connect(test::input(*node, "grid"), {8, 8, 1, 0});
    test::set_up(*node, folder.path);
  }
  void know(Known& known) { test::latch(test::input(*node, "reports"), known, 0, ++sequence); }
  void hear(Words& words) { test::latch(test::input(*node, "speech"), words, 0, ++sequence); }
  void job() {
    const uint64_t before = thread_memory_use().allocations;
    test::run(*node);
    if (counting_allocations()) CHECK(thread_memory_use().allocations == before);
    for (const char* port : {"reports", "speech"}) PortAccess::set_held(test::input(*node, port), 0, false, sequence);
  }
  std::string page() const {
    std::ifstream in(folder.path / "moments/index.html");
    return {std::istreambuf_iterator<char>(in), {}};
  }
  size_t pictures() const {
    size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path / "moments"))
      count += entry.path().extension() == ".png";
    return count;
  }
};

}  // namespace

TEST_CASE("moments: a picture when states change or something is said, none while all stays") {
  MomentsBench bench;
  Known empty("empty"), full("full");
  Words words("cup_1 <full>: done, which is more than a short string holds");
  bench.know(empty);
  bench.job();
  bench.know(empty);
  bench.job();
  bench.know(full);
  bench.job();
  bench.know(full);
  bench.hear(words);
  bench.job();
  bench.job();
  bench.node->finish();
  CHECK(bench.pictures() == 3);
  CHECK(bench.page().find("cup_1 &lt;full>: done") != std::string::npos);
  const cv::Mat first = cv::imread((bench.folder.path / "moments/01.png").string());
  CHECK(first.rows == 480);
  CHECK(first.cols == 480 + 600);  // no camera is connected
}

TEST_CASE("moments: those beyond the memory taken are counted, and a run in which nothing was known leaves nothing") {
  MomentsBench bench(2), silent;
  for (const char* level : {"empty", "full", "half", "empty"}) {
    Known known(level);
    bench.know(known);
    bench.job();
  }
  bench.node->finish();
  CHECK(bench.pictures() == 2);
  CHECK(bench.page().find("2 more are not shown") != std::string::npos);
  silent.job();
  silent.node->finish();
  CHECK_FALSE(std::filesystem::exists(silent.folder.path / "moments"));
}

TEST_CASE("moments: objects stand on the map where they are, with the robot and the cells around them") {
  picture::Moment moment;
  moment.reserve(0, 0, 100, 4, 100);
  moment.cell_m = 1, moment.origin_x_m = 10, moment.origin_y_m = 20;
  const std::vector<int16_t> cells(100, 0);
  REQUIRE(moment.cells.keep(cells, 10, 10));
  picture::KnownObject& cup = moment.objects.emplace_back();
  semantic::set_text("cup_1", cup.name.name);
  cup.x_m = 12, cup.y_m = 28;
  const cv::Mat map = picture::draw_map(moment, 500);  // 9 m of cells and 0.5 m at each end
  CHECK(map.at<cv::Vec3b>(75, 125) != cv::Vec3b(255, 255, 255));
  CHECK(map.at<cv::Vec3b>(400, 400) == cv::Vec3b(255, 255, 255));
  CHECK(map.at<cv::Vec3b>(499, 0) == cv::Vec3b(150, 150, 150));  // beyond the cells
}
