#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <vector>

#include "drivers/runtime/bus/line_medium.h"
#include "drivers/runtime/bus/run_probe.h"
#include "drivers/runtime/core/probe.h"
#include "tests/support/scripted_link.h"

namespace axlecast {

using ByteList = std::vector<std::uint8_t>;

// A line in virtual time whose other end answers requests by a table, and what a probe makes of it.
class ProbeBench {
 public:
  ProbeBench() { EXPECT_EQ(link.Open(), ""); }

  // Answers `reply`, 5 ms after the request.
  void Answer(const ByteList& request, const ByteList& reply) { replies_[request] = reply; }
  // Whatever else is asked is answered so.
  void AnswerAll(const ByteList& reply) { usual_ = reply; }

  // Runs the probe to its end. A trial that does not end within ten times its own time fails the test.
  std::vector<ProbeFinding> Run(const ProbeTrial& trial) {
    link.SetPeer([this](Bytes bytes) -> std::vector<ScriptedLink::Burst> {
      const auto found = replies_.find(ByteList(bytes.begin(), bytes.end()));
      const ByteList reply = found == replies_.end() ? usual_ : found->second;
      if (reply.empty()) return {};
      return {{5 * kMillisecond, reply}};
    });
    const MonoNs begin = clock.Now();
    const std::unique_ptr<Probe> probe = trial.make(begin);
    const MonoNs give_up = begin + 10 * trial.longest;
    EXPECT_TRUE(RunProbe(*probe, medium_, clock, [&] { return clock.Now() > give_up; }));
    EXPECT_FALSE(probe->Next(clock.Now())) << trial.what << " goes on and on";
    took = clock.Now() - begin;
    disturbed = probe->Disturbed();
    return probe->Findings();
  }

  FakeClock clock;
  ScriptedLink link{clock};
  MonoNs took = 0;
  bool disturbed = false;

 private:
  LineMedium medium_{link, clock, false, nullptr};
  std::map<ByteList, ByteList> replies_;
  ByteList usual_;
};

// The value of a key; empty when the finding has none.
inline std::string ValueOf(const ProbeFinding::Keys& keys, const std::string& name) {
  for (const auto& [key, value] : keys) {
    if (key == name) return value;
  }
  return "";
}

}  // namespace axlecast
