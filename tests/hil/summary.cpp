// SPDX-License-Identifier: Apache-2.0
// One line for each suite on each device, whatever else the reporter prints.
#include <doctest/doctest.h>

#include <cstdio>

namespace {

class Summary final : public doctest::IReporter {
 public:
  explicit Summary(const doctest::ContextOptions&) {}
  void test_case_start(const doctest::TestCaseData& test) override { name_ = test.m_name; }
  void test_case_end(const doctest::CurrentTestCaseStats& test) override {
    std::printf("%-6s %5d assertions, %d failed, %5.1f s  %s\n", test.failure_flags == 0 ? "passed" : "FAILED",
                test.numAssertsCurrentTest, test.numAssertsFailedCurrentTest, test.seconds, name_);
    std::fflush(stdout);
  }
  void report_query(const doctest::QueryData&) override {}
  void test_run_start() override {}
  void test_run_end(const doctest::TestRunStats&) override {}
  void test_case_reenter(const doctest::TestCaseData&) override {}
  void test_case_exception(const doctest::TestCaseException&) override {}
  void subcase_start(const doctest::SubcaseSignature&) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData&) override {}
  void log_message(const doctest::MessageData&) override {}
  void test_case_skipped(const doctest::TestCaseData&) override {}

 private:
  const char* name_ = "";
};

REGISTER_LISTENER("summary", 1, Summary);

}  // namespace
