#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <vector>

#include "core/device/probe.h"
#include "drivers/runtime/bus/transactor.h"
#include "tests/support/scripted_link.h"

namespace axlecast {

using ByteList = std::vector<std::uint8_t>;

// A line in virtual time whose other end answers requests by a table, and what a probe makes of it.
class ProbeBench {
 public:
  ProbeBench() {
    EXPECT_EQ(ErrorText(link.Open()), "");
    guard_.AddDevice();
  }

  // Answers `reply`, this time after the request.
  void Answer(const ByteList& request, const ByteList& reply, MonoNs after = 5 * kMillisecond) {
    replies_[request] = {after, reply};
  }
  // Whatever else is asked is answered so.
  void AnswerAll(const ByteList& reply) { usual_ = {5 * kMillisecond, reply}; }

  // Runs the probe to its end. A trial that does not end within ten times its own time fails the test.
  std::vector<ProbeHit> Run(const ProbeTrial& trial) {
    link.SetPeer([this](Bytes bytes) -> std::vector<ScriptedLink::Burst> {
      const auto found = replies_.find(ByteList(bytes.begin(), bytes.end()));
      const ScriptedLink::Burst reply = found == replies_.end() ? usual_ : found->second;
      if (reply.bytes.empty()) return {};
      return {reply};
    });
    const MonoNs begin = clock.Now();
    const std::unique_ptr<Probe> probe = trial.make(begin);
    const MonoNs give_up = begin + 10 * trial.longest;
    EXPECT_TRUE(RunProbe(*probe, medium_, clock, guard_, [&] { return clock.Now() > give_up; }));
    EXPECT_FALSE(probe->Next(clock.Now())) << trial.what << " does not end";
    took = clock.Now() - begin;
    disturbed = probe->Disturbed();
    return probe->Findings();
  }

  FakeClock clock;
  ScriptedLink link{clock};
  MonoNs took = 0;
  bool disturbed = false;

 private:
  SerialTransactor medium_{link, clock, false, nullptr};
  StaleReplyGuard guard_{kLatestProbeReply};
  std::map<ByteList, ScriptedLink::Burst> replies_;
  ScriptedLink::Burst usual_;
};

// The value of a key; empty when the finding has none.
inline std::string ValueOf(const ProbeHit::Keys& keys, const std::string& name) {
  for (const auto& [key, value] : keys) {
    if (key == name) return value;
  }
  return "";
}

}  // namespace axlecast
