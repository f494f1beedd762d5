// SPDX-License-Identifier: Apache-2.0
// Two nodes in one process, without a graph file: one counts at 100 Hz, the other prints each message as it comes.
#include <cstdio>
#include <takt/assembly.hpp>
#include <takt/msg/odometry.hpp>

struct Counter : takt::Node {
  takt::Output<takt::Odometry> out{this, "out", "how far it has counted"};
  void setup(takt::Setup&) override {}
  void run(takt::Job& job) override {
    takt::Odometry* message = out.loan();
    if (message == nullptr) return;
    message->x_m = static_cast<double>(job.index());
    out.send(job.release_ns());
  }
};

struct Printer : takt::Node {
  takt::Input<takt::Odometry> in{this, "in", "what to print"};
  void setup(takt::Setup&) override {}
  void run(takt::Job&) override {
    std::printf("hello %g\n", in.newest()->x_m);
    std::fflush(stdout);
  }
};

int main() {
  takt::Assembly hello;
  auto& counter = hello.add<Counter>("counter", {.rate = takt::Rate{100, 1}});
  auto& printer = hello.add<Printer>("printer", {});
  hello.connect(counter.out, printer.in, {.triggers = true});
  hello.run({.duration_ns = 50'000'000});
}
