#include "drivers/saa_can/cia406/preset_procedure.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/kit/refusal.h"
#include "drivers/saa_can/cia406/objects.h"
#include "drivers/saa_can/cia406/readouts.h"

namespace axlecast::saa_can::cia406 {
namespace {

using Reason = command_status_t;
using Kind = SdoResult::Kind;

constexpr MonoNs kPatience = 2 * kSecond;
constexpr int kMaxReadings = 5;

}  // namespace

PresetProcedure::PresetProcedure(std::uint32_t target, const Cia406Settings& settings, const DeviceOutput& output,
                                 MonoNs now)
    : target_(target),
      settings_(settings),
      output_(output),
      deadline_(now + kPatience + 4 * settings.sdo_timeout) {}

bool PresetProcedure::AtRest(MonoNs now) const {
  const Motion motion = output_.MotionAt(now);
  return motion.known && motion.standstill;
}

std::optional<SdoRequest> PresetProcedure::Wants(MonoNs now) const {
  switch (stage_) {
    case Stage::kReadBefore:
      return SdoRequest{.object = kPosition, .write = {}};
    case Stage::kWrite:
      if (AtRest(now)) return SdoRequest{.object = kPreset, .write = target_};
      break;
    case Stage::kSent:
      break;
    case Stage::kVerify:
      if (now >= effect_from_) return SdoRequest{.object = kPosition, .write = {}};
      break;
  }
  return std::nullopt;
}

MonoNs PresetProcedure::Due(MonoNs now) const {
  return stage_ == Stage::kVerify && now < effect_from_ ? effect_from_ : deadline_;
}

void PresetProcedure::OnStarted(const SdoRequest& request, MonoNs now) {
  if (!request.write || stage_ != Stage::kWrite) return;
  stage_ = Stage::kSent;
  deadline_ = now + kPatience + 4 * settings_.sdo_timeout;
}

void PresetProcedure::OnNotSent() {
  if (stage_ == Stage::kSent) stage_ = Stage::kWrite;
}

std::optional<Outcome> PresetProcedure::OnResult(const SdoResult& result) {
  const MonoNs now = result.received.last;
  if (stage_ == Stage::kSent && result.request.object == kPreset) return OnWritten(result);
  if (result.request.object != kPosition || result.request.write) return std::nullopt;
  return result.kind == Kind::kTimedOut ? OnTime(now) : OnRead(result);
}

std::optional<Outcome> PresetProcedure::OnRead(const SdoResult& result) {
  if (stage_ != Stage::kReadBefore && stage_ != Stage::kVerify) return std::nullopt;
  if (result.kind != Kind::kValue) {
    if (!touched()) {
      return Rejected(Reason::REASON_DEVICE_REFUSED, "the encoder does not let its position 6004h be read");
    }
    return WithBefore(Final(CommandState::kIndeterminate, Reason::REASON_DEVICE_REFUSED,
                            "the preset went out, but the encoder does not let its position 6004h be read"),
                      "");
  }
  if (stage_ == Stage::kVerify) {
    if (result.sent.first < effect_from_) return std::nullopt;
    return Verify(result.value);
  }
  if (!AtRest(result.received.last)) return NotAtRest(result.received.last);
  before_ = result.value;
  stage_ = Stage::kWrite;
  return std::nullopt;
}

std::optional<Outcome> PresetProcedure::OnWritten(const SdoResult& result) {
  if (result.kind == Kind::kAborted) {
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 Text("nothing was changed: the encoder refuses the preset: %s (0x%08X)", AbortText(result.value),
                      result.value));
  }
  confirmed_ = result.kind == Kind::kWritten;
  stage_ = Stage::kVerify;
  effect_from_ = result.received.last + settings_.preset_settle;
  deadline_ = effect_from_ + kPatience + 4 * settings_.sdo_timeout;
  Outcome running;
  running.text = "the preset went out; waiting for a reading that shows its effect";
  running.progress = 0.5F;
  // Should this process die: what is found afterwards says something only beside what was before.
  return WithBefore(std::move(running), "");
}

std::optional<Outcome> PresetProcedure::Verify(std::uint32_t position) {
  const bool near = IsNear(position, target_, settings_);
  if (!near && ++readings_ < kMaxReadings) return std::nullopt;
  const std::string was = Text("the position was %u and reads %u, set to %u", before_, position, target_);
  Outcome outcome = near ? JudgeReadBack({.same_before = SameBefore(), .confirmed = confirmed_}, was)
                         : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                 was + ": hold the axis; does the encoder take a preset?");
  return WithBefore(std::move(outcome), std::to_string(position));
}

Outcome PresetProcedure::WithBefore(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"position", std::to_string(before_), after});
  return WithFindingBefore(std::move(outcome), SameBefore());
}

bool PresetProcedure::SameBefore() const {
  return CannotBeToldApart(before_, target_, PresetToleranceCounts(settings_.bits),
                           std::int64_t{1} << settings_.total_bits());
}

std::optional<Outcome> PresetProcedure::OnTime(MonoNs now) {
  if (stage_ == Stage::kWrite && !AtRest(now)) return NotAtRest(now);
  if (now < deadline_) return std::nullopt;
  if (!touched()) {
    return Final(CommandState::kRejected, Reason::REASON_NO_REPLY, "nothing was done: the encoder did not answer");
  }
  return WithBefore(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                          "the preset went out, but no reading came that shows its effect: read_position when the "
                          "encoder answers again"),
                    "");
}

Outcome PresetProcedure::NotAtRest(MonoNs now) const {
  return Rejected(Reason::REASON_NOT_STANDING_STILL, MotionText(output_.MotionAt(now)));
}

Outcome PresetProcedure::OnLinkLost() const {
  if (!touched()) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost before it");
  }
  return WithBefore(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                          "the link was lost after the preset and before its effect could be read: read_position "
                          "when the link is back"),
                    "");
}

}  // namespace axlecast::saa_can::cia406
