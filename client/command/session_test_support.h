#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <axlecast/command_body_t.hpp>
#include <cstdint>
#include <utility>

#include "client/command/command_session.h"
#include "core/command/commands.h"
#include "core/messages/message.h"

namespace axlecast {

using S = command_status_t;

constexpr MonoNs kStart = 100 * kSecond;
constexpr MonoNs kBridgeAhead = 5'000 * kSecond;  // of the bridge's clock before ours: another host
constexpr CommandId kId = {1, 2, 3};
constexpr std::int64_t kBoot = 9;

// One session, and a bridge that sends what a test sets.
class SessionFixture {
 public:
  explicit SessionFixture(CommandRequest request, const ClientKeys& keys = {})
      : session_(kId, std::move(request), keys, kStart) {}

  // The body sent at `now`; one of mode -1 when nothing is.
  command_body_t Sent(MonoNs now) {
    command_body_t nothing{};
    nothing.mode = -1;
    const auto signed_body = session_.Next(now);
    if (!signed_body) return nothing;
    sent_ = *signed_body;
    return DecodeMessage<command_body_t>(sent_.bytes).value_or(nothing);
  }

  // A status about this command, the next of its boot.
  S Status(MonoNs now, std::int8_t state, std::int64_t boot_id = kBoot) {
    S status{};
    std::copy(kId.begin(), kId.end(), std::begin(status.id));
    status.boot_id = boot_id;
    status.mono_ns = now + kBridgeAhead;
    status.seq = seq_++;
    status.state = state;
    status.is_final = state >= S::STATE_SUCCEEDED ? 1 : 0;
    status.body_digest = state == S::STATE_UNKNOWN ? 0 : digest_;
    return status;
  }
  bool Answer(MonoNs now, std::int8_t state, std::int64_t boot_id = kBoot) {
    return session_.OnStatus(Status(now, state, boot_id), now);
  }
  bool RefuseAsStale(MonoNs now, std::int64_t boot_id) {
    S status = Status(now, S::STATE_REJECTED, boot_id);
    status.reason_code = S::REASON_STALE_BRIDGE;
    return session_.OnStatus(status, now);
  }

  // Has learned the bridge's boot id and sent its command at kStart.
  void SendIt() {
    Sent(kStart);
    Answer(kStart, S::STATE_UNKNOWN);
    EXPECT_EQ(Sent(kStart).bridge_boot_id, kBoot);
    digest_ = BodyDigest(sent_.bytes);
  }

  CommandSession session_;
  SignedBody sent_;
  std::int64_t digest_ = 0;
  std::int64_t seq_ = 0;
};

}  // namespace axlecast
