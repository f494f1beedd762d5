# SPDX-License-Identifier: Apache-2.0
"""A rig: each test has a robot that runs, changes something, and waits for what must follow."""
import pytest
import takt

SCAN_LOST = 4  # of the reasons to stop


def drives(odometry):
    return odometry["speed_m_s"] > 0.08


def stands(odometry):
    return abs(odometry["speed_m_s"]) < 0.01


@pytest.fixture
def robot():
    with takt.Run("robot.yaml", longest_s=120) as run:
        run.wait_for("base.odometry", drives, within_s=30)
        yield run


def test_a_value_is_obeyed(robot):
    robot.set("cruise.speed", "0.3m/s")
    robot.wait_for("base.odometry", lambda m: m["speed_m_s"] > 0.25, within_s=30)


def test_safe_stop_stops(robot):
    robot.mode("safe_stop")
    robot.wait_for("base.odometry", stands, within_s=30)


@pytest.mark.parametrize("fault", ["silent", "unplugged", "garbage"])
def test_a_robot_that_sees_nothing_stands(robot, fault):
    robot.fault("front_laser", fault)
    robot.wait_for("obstacle_stop.stop", lambda m: m["reasons"] & SCAN_LOST, within_s=30)
    robot.wait_for("base.odometry", stands, within_s=30)
    robot.fault("front_laser", fault, on=False)
    robot.wait_for_device("front_laser", "ok", within_s=30)
    robot.wait_for("base.odometry", drives, within_s=30)


def test_what_the_graph_expects():
    with takt.Run("blind.yaml", record=True) as run:
        run.wait_for("base.odometry", drives, within_s=30)
        run.fault("front_laser", "silent")
        run.wait_for_end(within_s=60)  # the graph decides
    assert run.exit_code == 0, run.stderr
    assert run.report["expectations"]["met"]
    laser = next(device for device in run.report["devices"] if device["name"] == "front_laser")
    assert laser["losses"] == 1
    assert run.record().events >= 1  # the fault, for the replay
