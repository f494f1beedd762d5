// SPDX-License-Identifier: Apache-2.0
#include "nodes/body_pose/skeleton.hpp"

#include <doctest/doctest.h>

#include <fstream>

#include "tests/temporary_folder.hpp"
#include "tests/unit/body_pose/skeletons.hpp"

using namespace takt;
using namespace takt::body_pose;
using test::shipped;

TEST_CASE("oracle 7: the human skeleton has 15 links and 28 degrees of freedom") {
  for (const std::string name : {"human", "human_thesis"}) {
    const Skeleton skeleton = shipped(name);
    CHECK(skeleton.links.size() == 16);  // and the start
    CHECK(skeleton.degrees_of_freedom() == 28);
    CHECK(skeleton.poses.size() == 27);
    CHECK(skeleton.pointers.size() == 2);
  }
}

TEST_CASE("human_thesis has the lengths of Tab. 3.1: 2.25 m below the head") {
  const Skeleton skeleton = shipped("human_thesis");
  CHECK(skeleton.name == "human_thesis");
  double sum = 0;
  for (size_t i = skeleton.link("lower_leg_left"); i != 0; i = skeleton.links[i].parent)
    if (!skeleton.links[i].name.starts_with("hip")) sum += skeleton.links[i].length_m;
  CHECK(sum == doctest::Approx(2.25));
}

TEST_CASE("links know what hangs on them; other bodies are other files") {
  const Skeleton human = shipped("human");
  CHECK(human.links[human.link("neck")].descendants == 14);
  CHECK(human.links[human.link("shoulder_left")].descendants == 2);
  CHECK(human.links[human.link("lower_arm_left")].descendants == 0);
  const Skeleton crane = shipped("crane");
  CHECK(crane.links.size() == 6);
  CHECK(crane.poses.size() == 2);
  CHECK_THROWS_AS(crane.link("neck"), std::out_of_range);
}

TEST_CASE("what is wrong with a skeleton file is said with file, line and the valid choices") {
  const test::TemporaryFolder folder;
  const auto problem = [&](const std::string& text) -> std::string {
    const auto file = folder.path / "a.txt";
    std::ofstream(file) << text;
    try {
      read_skeleton(file);
    } catch (const SkeletonError& error) {
      return error.what();
    }
    return "";
  };
  const std::string head = "skeleton a\nstart top\nlink mast top 1 0 0 -1\n";
  CHECK(problem(head) == "");
  CHECK(problem("skeleton a\n").find("describes no link") != std::string::npos);
  CHECK(problem(head + "bone x\n").find("a.txt:4: unknown word `bone`; valid are direction, dof") != std::string::npos);
  CHECK(problem(head + "link jib mat 1 0 1 0\n").find("no link `mat` above this line; there are top, mast") !=
        std::string::npos);
  CHECK(problem(head + "dof w 0 1\n").find("`w` is no axis; valid are x, y, z") != std::string::npos);
  CHECK(problem(head + "dof x 5 1\n").find("smallest angle") != std::string::npos);
  CHECK(problem(head + "link jib top 1 0 0 0\n").find("must not be 0 0 0") != std::string::npos);
  CHECK(problem(head + "link mast top 1 0 0 1\n").find("a link `mast` already") != std::string::npos);
  CHECK(problem(head + "dof x 0\n").find("takes 3 words, here are 2") != std::string::npos);
  CHECK(problem("like b.txt\n").find("b.txt: cannot be read") != std::string::npos);
  CHECK(problem("like a.txt\n").find("refer to one another") != std::string::npos);
}
