// SPDX-License-Identifier: Apache-2.0
// Quality on real pairs with ground truth, beside OpenCV's block matcher on the same pixels.
#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>

#include "nodes/stereo/evaluate_peers.hpp"
#include "nodes/stereo/matcher.hpp"
#include "tests/recorded/recording.hpp"

using namespace takt;
using namespace takt::stereo;

namespace {

struct Recording {
  const char *folder, *left_name, *right_name, *truth_name;
  int disparities;
  double scale;
  double most_bad_pct, most_bad_of_quality_pct;  ///< measured 5.6, 11.2 and 9.8; 3.9, 5.5 and 6.3
  cv::Mat left = {}, right = {};
  DisparityImage truth = {};
  StereoScore peer(Peer which) const {
    return score(
        run_peer(which, {left.data, left.cols, left.rows, 3}, {right.data, left.cols, left.rows, 3}, disparities),
        truth);
  }
};

std::vector<Recording> recordings() {
  std::vector<Recording> all{{"stereo/tsukuba", "im3.png", "im4.png", "disp3.pgm", 16, 16, 6.0, 4.3},
                             {"stereo/teddy", "im2.png", "im6.png", "disp2.png", 64, 4, 11.6, 5.9},
                             {"stereo/aloe", "aloeL.jpg", "aloeR.jpg", "aloeGT.png", 216, 1, 10.2, 6.7}};
  for (Recording& r : all) {
    const auto folder = takt::test::recording(r.folder);
    r.left = cv::imread((folder / r.left_name).string());
    r.right = cv::imread((folder / r.right_name).string());
    const cv::Mat truth = cv::imread((folder / r.truth_name).string(), cv::IMREAD_GRAYSCALE);
    REQUIRE(r.left.total() > 0);
    REQUIRE(r.left.size() == truth.size());
    r.truth = ground_truth(ImageView<const uint8_t>(truth.data, truth.cols, truth.rows), r.scale);
  }
  return all;
}

StereoScore run(const cv::Mat& left, const cv::Mat& right, const DisparityImage& truth, const MatcherParameters& p) {
  const auto matcher = make_matcher(left.cols, left.rows, 3, p);
  std::vector<int16_t> d(left.total());
  std::vector<uint8_t> c(left.total());
  REQUIRE(matcher->match({left.data, left.cols, left.rows, 3}, {right.data, left.cols, left.rows, 3},
                         {{d.data(), left.cols, left.rows}, {c.data(), left.cols, left.rows}}));
  return score(to_disparity_image({d.data(), left.cols, left.rows}), truth);
}

}  // namespace

TEST_CASE("the default matcher beats StereoBM (block 15, no filters) on each real pair") {
  for (const Recording& r : recordings()) {
    MatcherParameters p;
    p.disparities = r.disparities;
    const StereoScore ours = run(r.left, r.right, r.truth, p), peer = r.peer(Peer::block_matching_unfiltered);
    INFO(r.folder, ": ", ours.bad_1px_pct, " % bad, StereoBM ", peer.bad_1px_pct, " %");
    CHECK(ours.density_pct == 100);
    CHECK(ours.bad_1px_pct <= r.most_bad_pct);
    CHECK(ours.bad_1px_pct < peer.bad_1px_pct);
    p.left_right_check = true;
    CHECK(run(r.left, r.right, r.truth, p).density_pct < 100);
  }
}

TEST_CASE("the quality matcher is no worse than SGBM 3-way in the mean over the real pairs") {
  const std::vector<Recording> all = recordings();
  double ours_pct = 0, theirs_pct = 0;
  for (const Recording& r : all) {
    MatcherParameters p = MatcherParameters::quality();
    p.disparities = r.disparities;
    const StereoScore ours = run(r.left, r.right, r.truth, p);
    const double peer_pct =
        std::min(r.peer(Peer::semi_global).bad_1px_pct, r.peer(Peer::semi_global_equal_light).bad_1px_pct);
    INFO(r.folder, ": ", ours.bad_1px_pct, " % bad, SGBM ", peer_pct, " %");
    CHECK(ours.density_pct == 100);
    CHECK(ours.bad_1px_pct <= r.most_bad_of_quality_pct);
    ours_pct += ours.bad_1px_pct;
    theirs_pct += peer_pct;
  }
  CHECK(ours_pct <= theirs_pct);
}
