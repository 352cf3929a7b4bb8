#include "bridge/state/bridge_alarms.h"

namespace axlecast {
namespace {

constexpr MonoNs kOnChange = 100 * kMillisecond;

}  // namespace

void BridgeAlarms::Tick(const BridgeTroubles& troubles, Timestamp now) {
  using namespace bridge_alarms;
  const auto set = [&](const AlarmSpec& alarm, bool present) {
    book_.Set(alarm, present ? AlarmState::kLive : AlarmState::kAbsent, now.utime);
  };
  set(kForeignCommands, troubles.foreign_commands);
  set(kJournalFails, troubles.journal_fails);
  set(kUnsignedAllowed, troubles.unsigned_allowed);
  set(kEncoderExchanged, troubles.encoder_exchanged);
  set(kPlaceDoubtful, troubles.place_doubtful);
  set(kKeyMissing, troubles.key_missing);
  set(kOtherBridge, troubles.other_bridge);
  const bool changed = book_.revision() != told_revision_;
  if (now.mono - told_ < (changed ? kOnChange : kSecond) && told_ != 0) return;
  told_ = now.mono;
  told_revision_ = book_.revision();
  message_.utime = now.utime;
  message_.mono_ns = now.mono;
  message_.device = "bridge";
  book_.Write(message_, now.utime);
  Publish(data_, "ALARM/bridge", message_);
  ++message_.seq;
}

}  // namespace axlecast
