// SPDX-License-Identifier: Apache-2.0
// Cascades that others trained.
#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>
#include <string>

#include "nodes/traffic_signs/cascade.hpp"
#include "tests/property/traffic_signs/as_opencv.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt;
using namespace takt::traffic_signs;
using namespace takt::test;

TEST_CASE("traffic_signs: files of others are read, or refused for what they hold") {
  const auto read = [](const char* file) { return read_cascade(recording(std::string("cascades_opencv/") + file)); };
  const Cascade face = read("haarcascade_frontalface_alt.xml");
  CHECK(face.width == 20);
  CHECK(face.stages.size() == 22);
  CHECK(face.features.size() == 2135);
  CHECK_THROWS_AS(read("lbpcascade_frontalface.xml"), CascadeError);
  CHECK_THROWS_AS(read("haarcascade_fullbody.xml"), CascadeError);
}

TEST_CASE("traffic_signs: the same on photographs with cascades that others trained") {
  size_t found = 0;
  for (const char* cascade :
       {"traffic_signs/cascades/cascade_stop_3_10.xml", "traffic_signs/cascades/cascade_stop_3_15.xml",
        "cascades_opencv/haarcascade_frontalface_alt.xml"}) {
    const auto file = recording(cascade);
    for (const char* name : {"st1", "st3", "st6", "st7", "p1"}) {
      const auto scene = recording(std::string("traffic_signs/scenes/") + name + ".jpg");
      found += check_equal(file, cv::imread(scene.string(), cv::IMREAD_GRAYSCALE), 1.2);
    }
  }
  CHECK(found > 20);
}
