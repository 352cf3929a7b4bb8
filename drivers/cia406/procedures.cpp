#include "drivers/cia406/procedures.h"

#include <array>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

using Reason = command_status_t;
using Kind = SdoResult::Kind;

constexpr std::array<ObjectId, 1> kPositionObjects = {kPosition};
constexpr std::array<ObjectId, 5> kIdentityObjects = {kDeviceType, kVendor, kProduct, kRevision, kSerial};
constexpr std::array<ObjectId, 4> kStateObjects = {kErrorRegister, kOperatingStatus, kAlarms, kWarnings};

std::string Hex(std::optional<std::uint32_t> value, int digits) {
  return value ? Text("0x%0*X", digits, *value) : "not offered";
}

constexpr MonoNs kPatience = 2 * kSecond;
// Beyond the time that the client gives a save.
constexpr MonoNs kSavePatience = 10 * kSecond;

constexpr int kMaxReadings = 5;

}  // namespace

std::optional<SdoRequest> Readout::Wants(MonoNs) const {
  if (values_.size() == objects_.size()) return std::nullopt;
  return SdoRequest{.object = objects_[values_.size()], .write = {}};
}

std::optional<Outcome> Readout::OnResult(const SdoResult& result) {
  if (result.request.object != objects_[values_.size()] || result.request.write) return std::nullopt;
  const MonoNs now = result.received.last;
  if (result.kind == SdoResult::Kind::kTimedOut) return OnTime(now);
  values_.push_back(result.kind == SdoResult::Kind::kValue ? std::optional(result.value) : std::nullopt);
  if (values_.size() < objects_.size()) return std::nullopt;
  return Show(values_, now);
}

std::optional<Outcome> Readout::OnTime(MonoNs now) {
  if (now < deadline_) return std::nullopt;
  return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, "the encoder did not answer in time");
}

Outcome Readout::OnLinkLost() const {
  return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, "the link was lost before all was read");
}

std::string PositionText(std::uint32_t position, const Cia406Settings& settings) {
  const std::uint32_t counts = position & ((std::uint32_t{1} << settings.bits) - 1);
  const double degrees = Degrees(counts, settings.bits);
  if (settings.turn_bits == 0) return Text("single-turn %u (%.4f deg)", counts, degrees);
  return Text("turns %u, single-turn %u (%.4f deg)", position >> settings.bits, counts, degrees);
}

bool IsNear(std::uint32_t position, std::uint32_t target, const Cia406Settings& settings) {
  return CircularDistance(position, target, std::int64_t{1} << settings.total_bits()) <=
         PresetToleranceCounts(settings.bits);
}

PositionReadout::PositionReadout(std::optional<std::uint32_t> target, const Cia406Settings& settings,
                                 const DeviceOutput& output, MonoNs deadline)
    : Readout(kPositionObjects, deadline), target_(target), settings_(settings), output_(output) {}

// A shaft that turns may have left the place where it was set.
Outcome PositionReadout::Show(const Values& values, MonoNs now) const {
  if (!values[0]) {
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 "the encoder does not let its position 6004h be read");
  }
  Outcome outcome = Verified(PositionText(*values[0], settings_));
  outcome.changes.push_back({"position", "", std::to_string(*values[0])});
  if (!target_) return outcome;
  const Motion motion = output_.MotionAt(now);
  const bool rests = motion.known && motion.standstill;
  const bool near = IsNear(*values[0], *target_, settings_);
  outcome.changes.push_back(FindingChange(near ? kReadsAsAfter : rests ? kNoEffectSeen : kCannotTell));
  return outcome;
}

IdentityReadout::IdentityReadout(MonoNs deadline) : Readout(kIdentityObjects, deadline) {}

Outcome IdentityReadout::Show(const Values& values, MonoNs) const {
  const std::uint32_t type = values[0].value_or(0);
  Outcome outcome = Verified(Text("device type 0x%08X: profile %u", type, type & 0xFFFF));
  for (std::size_t part = 0; part < kIdentityParts; ++part) {
    outcome.changes.push_back({kIdentityNames.at(part), "", Hex(values[part + 1], 8)});
  }
  return outcome;
}

StateReadout::StateReadout(const Interpreter& interpreter, MonoNs deadline)
    : Readout(kStateObjects, deadline), interpreter_(interpreter) {}

Outcome StateReadout::Show(const Values& values, MonoNs) const {
  const NodeWatch& watch = interpreter_.watch();
  std::string text = std::string("NMT state ") + (watch.state() ? NmtStateName(*watch.state()) : "not known");
  if (!watch.said()) text += " (no heartbeat says so)";
  text += "; errors: " + (values[0] ? ErrorRegisterText(static_cast<std::uint8_t>(*values[0])) : "not offered");
  if (const auto& emergency = interpreter_.alarms().last_emergency()) {
    text += Text("; last EMCY 0x%04X (%s), register 0x%02X, data %s", unsigned{emergency->code},
                 EmergencyClass(emergency->code), unsigned{emergency->error_register},
                 HexText(emergency->specific).c_str());
  }
  Outcome outcome = Verified(text);
  outcome.changes = {{"error_register", "", Hex(values[0], 2)},
                     {"operating_status", "", Hex(values[1], 4)},
                     {"alarms", "", Hex(values[2], 4)},
                     {"warnings", "", Hex(values[3], 4)}};
  return outcome;
}

SaveProcedure::SaveProcedure(const Cia406Settings& settings, MonoNs now)
    : deadline_(now + kPatience + 4 * settings.sdo_timeout) {}

std::optional<SdoRequest> SaveProcedure::Wants(MonoNs) const {
  if (stage_ == Stage::kAsk) return SdoRequest{.object = kStoreAll, .write = {}};
  if (stage_ == Stage::kSend) return SdoRequest{.object = kStoreAll, .write = kSaveSignature};
  return std::nullopt;
}

void SaveProcedure::OnStarted(const SdoRequest& request, MonoNs now) {
  if (!request.write) return;
  stage_ = Stage::kSent;
  deadline_ = now + kSavePatience;
}

void SaveProcedure::OnNotSent() {
  if (stage_ == Stage::kSent) stage_ = Stage::kSend;
}

std::optional<Outcome> SaveProcedure::OnResult(const SdoResult& result) {
  if (result.request.object != kStoreAll) return std::nullopt;
  if (stage_ == Stage::kSent) return OnSaved(result);
  return result.kind == Kind::kTimedOut ? OnTime(result.received.last) : OnAsked(result);
}

std::optional<Outcome> SaveProcedure::OnAsked(const SdoResult& result) {
  if (result.kind == Kind::kValue && (result.value & kSavesOnCommand) != 0) {
    stage_ = Stage::kSend;
    return std::nullopt;
  }
  return Rejected(Reason::REASON_DEVICE_REFUSED, "the encoder does not store parameters on command (1010h sub 1)");
}

Outcome SaveProcedure::OnSaved(const SdoResult& result) {
  if (result.kind == Kind::kWritten) {
    return Succeeded(false,
                     "the encoder confirms that it has stored its parameters; what is stored cannot be read");
  }
  if (result.kind == Kind::kAborted) {
    return Final(
        CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
        Text("the encoder did not store its parameters: %s (0x%08X)", AbortText(result.value), result.value));
  }
  return Final(
      CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
      "the encoder did not confirm in time that it has stored its parameters; nothing shows whether it has");
}

std::optional<Outcome> SaveProcedure::OnTime(MonoNs now) {
  if (now < deadline_) return std::nullopt;
  if (!touched()) return Rejected(Reason::REASON_NO_REPLY, "the encoder did not answer");
  return Final(
      CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
      "the encoder started anew or fell silent while it stored its parameters; nothing shows whether it has");
}

Outcome SaveProcedure::OnLinkLost() const {
  if (!touched()) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost before it");
  }
  return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
               "the link was lost while the encoder stored its parameters; nothing shows whether it has");
}

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
  if (!AtRest(result.received.last)) return NotAtRest(output_.MotionAt(result.received.last));
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
  Outcome outcome = near ? ReadBackOutcome({.same_before = SameBefore(), .confirmed = confirmed_}, was)
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
  if (stage_ == Stage::kWrite && !AtRest(now)) return NotAtRest(output_.MotionAt(now));
  if (now < deadline_) return std::nullopt;
  if (!touched()) {
    return Final(CommandState::kRejected, Reason::REASON_NO_REPLY, "nothing was done: the encoder did not answer");
  }
  return WithBefore(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                          "the preset went out, but no reading came that shows its effect: read_position when the "
                          "encoder answers again"),
                    "");
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

}  // namespace axlecast::cia406
