#pragma once

#include <axlecast/command_status_t.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/cia406/interpreter.h"
#include "drivers/cia406/settings.h"
#include "drivers/kit/command_runner.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

inline constexpr MonoNs kReplyTimeout = 2 * kSecond;
// Longer than the SDO client waits for the confirmation of a save.
inline constexpr MonoNs kSaveTimeout = 10 * kSecond;
inline constexpr int kMaxReadings = 5;

inline std::string Hex(std::optional<std::uint32_t> value, int digits) {
  return value ? Text("0x%0*X", digits, *value) : "not offered";
}

// "turns 3, single-turn 4096 (180.0000 deg)"
inline std::string PositionText(std::uint32_t position, const Cia406Settings& settings) {
  const std::uint32_t counts = position & ((std::uint32_t{1} << settings.bits) - 1);
  const std::string single_turn = Text("single-turn %u (%.4f deg)", counts, Degrees(counts, settings.bits));
  return settings.turn_bits == 0 ? single_turn : Text("turns %u, ", position >> settings.bits) + single_turn;
}

// Returns whether an encoder at rest that was set to `target` may read `position`.
inline bool IsNear(std::uint32_t position, std::uint32_t target, const Cia406Settings& settings) {
  return CircularDistance(position, target, std::int64_t{1} << settings.total_bits()) <=
         PresetToleranceCounts(settings.bits);
}

inline std::string AbortReason(const SdoResult& result) {
  return Text("%s (0x%08X)", AbortText(result.value), result.value);
}

inline constexpr const char* kPositionRefused = "the encoder does not permit to read its position 6004h";

// One command being carried out, by SDO transfers one after the other.
class Procedure : public CommandProcedure {
 public:
  // Returns the transfer that it needs as soon as the bus allows.
  [[nodiscard]] virtual std::optional<SdoRequest> NextRequest(MonoNs now) const = 0;
  // Returns when OnTime must be called if nothing happens before.
  [[nodiscard]] virtual MonoNs Due(MonoNs now) const = 0;

  // The transfer is about to be sent.
  virtual void OnStarted([[maybe_unused]] const SdoRequest& request, [[maybe_unused]] MonoNs now) {}
  // It was not sent: the controller's queue is full.
  virtual void OnNotSent() {}
  // The encoder has restarted (boot-up message).
  virtual void OnRestarted() {}
  // Any transfer of the node has ended, also one for another purpose.
  virtual std::optional<Outcome> OnResult(const SdoResult& result) = 0;
  // Time has passed.
  virtual std::optional<Outcome> OnTime(MonoNs now) = 0;
};

// Reads objects one after the other, and shows them.
class Readout final : public Procedure {
 public:
  // The values of the objects; nothing for an object that the encoder does not offer.
  using Values = std::vector<std::optional<std::uint32_t>>;
  using Show = std::function<Outcome(const Values& values, MonoNs now)>;

  Readout(std::vector<ObjectId> objects, MonoNs deadline, Show show)
      : objects_(std::move(objects)), deadline_(deadline), show_(std::move(show)) {}

  [[nodiscard]] std::optional<SdoRequest> NextRequest(MonoNs) const override {
    if (values_.size() == objects_.size()) return std::nullopt;
    return SdoRequest{.object = objects_[values_.size()], .write = {}};
  }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> OnResult(const SdoResult& result) override {
    if (result.request.object != objects_[values_.size()] || result.request.write) return std::nullopt;
    const MonoNs now = result.received.last;
    if (result.kind == SdoResult::Kind::kTimedOut) return OnTime(now);
    values_.push_back(result.kind == SdoResult::Kind::kValue ? std::optional(result.value) : std::nullopt);
    if (values_.size() < objects_.size()) return std::nullopt;
    return show_(values_, now);
  }
  std::optional<Outcome> OnTime(MonoNs now) override {
    if (now < deadline_) return std::nullopt;
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, "the encoder did not answer in time");
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, "the link was lost before all was read");
  }
  [[nodiscard]] bool reads_only() const override { return true; }

 private:
  const std::vector<ObjectId> objects_;
  const MonoNs deadline_;
  const Show show_;
  Values values_;
};

// Returns the readout of 6004h. With a `target`, it also shows whether a preset to it may have taken effect. A shaft that
// turns may have left the place where it was set.
inline std::unique_ptr<Procedure> ReadPosition(std::optional<std::uint32_t> target, const Cia406Settings& settings,
                                               const DeviceOutput& output, MonoNs deadline) {
  const auto show = [target, &settings, &output](const Readout::Values& values, MonoNs now) {
    if (!values[0]) return Final(CommandState::kFailed, command_status_t::REASON_DEVICE_REFUSED, kPositionRefused);
    Outcome outcome = Verified(PositionText(*values[0], settings));
    outcome.changes.push_back({"position", "", std::to_string(*values[0])});
    if (!target) return outcome;
    const bool near = IsNear(*values[0], *target, settings);
    outcome.changes.push_back(FindingChange(FindingWord(near, AtRest(output, now))));
    return outcome;
  };
  return std::make_unique<Readout>(std::vector{kPosition}, deadline, show);
}

// Returns the readout of the device type and the identity: 1000h, 1018h.
inline std::unique_ptr<Procedure> ReadIdentity(MonoNs deadline) {
  const auto show = [](const Readout::Values& values, MonoNs) {
    const std::uint32_t type = values[0].value_or(0);
    Outcome outcome = Verified(Text("device type 0x%08X: profile %u", type, type & 0xFFFF));
    for (std::size_t part = 0; part < kIdentityParts; ++part) {
      outcome.changes.push_back({kIdentityNames.at(part), "", Hex(values[part + 1], 8)});
    }
    return outcome;
  };
  return std::make_unique<Readout>(std::vector{kDeviceType, kVendor, kProduct, kRevision, kSerial}, deadline, show);
}

// Returns the readout of NMT state, error register, operating status, alarms, warnings and the last emergency message.
inline std::unique_ptr<Procedure> ReadState(const Interpreter& interpreter, MonoNs deadline) {
  const auto show = [&interpreter](const Readout::Values& values, MonoNs) {
    const NodeWatch& watch = interpreter.watch();
    std::string text = std::string("NMT state ") + (watch.state() ? NmtStateName(*watch.state()) : "not known");
    if (!watch.reported()) text += " (not from a heartbeat)";
    text += "; errors: " + (values[0] ? ErrorRegisterText(static_cast<std::uint8_t>(*values[0])) : "not offered");
    if (const auto& emergency = interpreter.alarms().last_emergency()) {
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
  };
  return std::make_unique<Readout>(std::vector{kErrorRegister, kOperatingStatus, kAlarms, kWarnings}, deadline,
                                   show);
}

// Reads an object, then writes one once. The write is never repeated.
class WriteProcedure : public Procedure {
 public:
  void OnStarted(const SdoRequest& request, MonoNs now) override {
    if (!request.write || stage_ != Stage::kWrite) return;
    stage_ = Stage::kSent;
    deadline_ = now + write_timeout_;
  }
  void OnNotSent() override {
    if (stage_ == Stage::kSent) stage_ = Stage::kWrite;
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    if (touched()) return Unknown(LinkLostText());
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
                 "nothing was done: the link was lost before it");
  }
  [[nodiscard]] bool touched() const override { return stage_ >= Stage::kSent; }

 protected:
  enum class Stage : std::uint8_t { kRead, kWrite, kSent, kVerify };

  // `write_timeout`: maximum time from the write to its confirmation.
  WriteProcedure(const Cia406Settings& settings, MonoNs now, MonoNs write_timeout)
      : settings_(settings),
        write_timeout_(write_timeout),
        deadline_(now + kReplyTimeout + 4 * settings.sdo_timeout) {}

  // Returns the outcome if it is unknown whether the write took effect.
  [[nodiscard]] virtual Outcome Unknown(std::string text) const {
    return Final(CommandState::kIndeterminate, command_status_t::REASON_NO_REPLY, std::move(text));
  }
  // Returns the text of that outcome after the link was lost.
  [[nodiscard]] virtual const char* LinkLostText() const = 0;

  const Cia406Settings& settings_;
  const MonoNs write_timeout_;
  Stage stage_ = Stage::kRead;
  MonoNs deadline_;
};

// Makes the encoder store its parameters (1010h sub 1, CiA 301 7.5.2.13). It first reads whether the encoder does so on
// command. The encoder confirms when it has stored them.
class SaveProcedure final : public WriteProcedure {
 public:
  SaveProcedure(const Cia406Settings& settings, MonoNs now) : WriteProcedure(settings, now, kSaveTimeout) {}

  [[nodiscard]] std::optional<SdoRequest> NextRequest(MonoNs) const override {
    if (stage_ == Stage::kRead) return SdoRequest{.object = kStoreAll, .write = {}};
    if (stage_ == Stage::kWrite) return SdoRequest{.object = kStoreAll, .write = kSaveSignature};
    return std::nullopt;
  }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> OnResult(const SdoResult& result) override {
    if (result.request.object != kStoreAll) return std::nullopt;
    if (stage_ == Stage::kSent) return OnSaved(result);
    if (result.kind == SdoResult::Kind::kTimedOut) return OnTime(result.received.last);
    if (result.kind == SdoResult::Kind::kValue && (result.value & kSavesOnCommand) != 0) {
      stage_ = Stage::kWrite;
      return std::nullopt;
    }
    return Rejected(command_status_t::REASON_DEVICE_REFUSED,
                    "the encoder does not store parameters on command (1010h sub 1)");
  }
  std::optional<Outcome> OnTime(MonoNs now) override {
    if (now < deadline_) return std::nullopt;
    if (!touched()) return Rejected(command_status_t::REASON_NO_REPLY, "the encoder did not answer");
    return Unknown(
        "the encoder restarted or became silent while it stored its parameters; nothing shows whether it has");
  }

 private:
  [[nodiscard]] const char* LinkLostText() const override {
    return "the link was lost while the encoder stored its parameters; nothing shows whether it has";
  }
  [[nodiscard]] std::optional<Outcome> OnSaved(const SdoResult& result) const {
    if (result.kind == SdoResult::Kind::kWritten) {
      return Succeeded(false,
                       "the encoder confirms that it has stored its parameters; what is stored cannot be read");
    }
    if (result.kind == SdoResult::Kind::kAborted) {
      return Final(CommandState::kFailed, command_status_t::REASON_DEVICE_REFUSED,
                   "the encoder did not store its parameters: " + AbortReason(result));
    }
    return Unknown(
        "the encoder did not confirm in time that it has stored its parameters; nothing shows whether it has");
  }
};

// Makes the present shaft angle read `target` (preset value 6003h): a reading that shows where the shaft was, a second
// check of the standstill, one write, and readings that show its effect.
class PresetProcedure final : public WriteProcedure {
 public:
  PresetProcedure(std::uint32_t target, const Cia406Settings& settings, const DeviceOutput& output, MonoNs now)
      : WriteProcedure(settings, now, kReplyTimeout + 4 * settings.sdo_timeout), target_(target), output_(output) {}

  [[nodiscard]] std::optional<SdoRequest> NextRequest(MonoNs now) const override {
    if (stage_ == Stage::kWrite && AtRest(output_, now)) return SdoRequest{.object = kPreset, .write = target_};
    const bool reads = stage_ == Stage::kRead || (stage_ == Stage::kVerify && now >= effect_from_);
    return reads ? std::optional(SdoRequest{.object = kPosition, .write = {}}) : std::nullopt;
  }
  [[nodiscard]] MonoNs Due(MonoNs now) const override {
    return stage_ == Stage::kVerify && now < effect_from_ ? effect_from_ : deadline_;
  }
  std::optional<Outcome> OnResult(const SdoResult& result) override {
    if (stage_ == Stage::kSent && result.request.object == kPreset) return OnWritten(result);
    if (result.request.object != kPosition || result.request.write) return std::nullopt;
    if (result.kind != SdoResult::Kind::kTimedOut) return OnRead(result);
    interrupted_ = interrupted_ || stage_ == Stage::kVerify;
    return OnTime(result.received.last);
  }
  void OnRestarted() override { interrupted_ = interrupted_ || touched(); }
  std::optional<Outcome> OnTime(MonoNs now) override {
    if (stage_ == Stage::kWrite && !AtRest(output_, now)) return NotAtRest(output_.MotionAt(now));
    if (now < deadline_) return std::nullopt;
    if (!touched()) return Rejected(command_status_t::REASON_NO_REPLY, "the encoder did not answer");
    return Unknown(
        "the preset was sent, but no reading came that shows its effect: read_position when the encoder answers "
        "again");
  }

 private:
  [[nodiscard]] Outcome Unknown(std::string text) const override {
    return WithBefore(WriteProcedure::Unknown(std::move(text)), "");
  }
  [[nodiscard]] const char* LinkLostText() const override {
    return "the link was lost after the preset and before its effect could be read: read_position when the link is "
           "back";
  }
  [[nodiscard]] std::optional<Outcome> OnRead(const SdoResult& result) {
    if (stage_ != Stage::kRead && stage_ != Stage::kVerify) return std::nullopt;
    if (result.kind != SdoResult::Kind::kValue) {
      if (!touched()) return Rejected(command_status_t::REASON_DEVICE_REFUSED, kPositionRefused);
      return WithBefore(Final(CommandState::kIndeterminate, command_status_t::REASON_DEVICE_REFUSED,
                              std::string("the preset was sent, but ") + kPositionRefused),
                        "");
    }
    if (stage_ == Stage::kVerify) {
      return result.sent.first < effect_from_ ? std::nullopt : Verify(result.value);
    }
    if (!AtRest(output_, result.received.last)) return NotAtRest(output_.MotionAt(result.received.last));
    before_ = result.value;
    stage_ = Stage::kWrite;
    return std::nullopt;
  }
  // The changes of this progress are needed if this process dies: a later reading shows an effect only if the position
  // before is known.
  [[nodiscard]] std::optional<Outcome> OnWritten(const SdoResult& result) {
    if (result.kind == SdoResult::Kind::kAborted) {
      return Final(CommandState::kFailed, command_status_t::REASON_DEVICE_REFUSED,
                   "nothing was changed: the encoder refuses the preset: " + AbortReason(result));
    }
    confirmed_ = result.kind == SdoResult::Kind::kWritten;
    stage_ = Stage::kVerify;
    effect_from_ = result.received.last + settings_.preset_settle;
    deadline_ = effect_from_ + write_timeout_;
    Outcome running;
    running.text = "the preset was sent; waiting for a reading that shows its effect";
    running.progress = 0.5F;
    return WithBefore(std::move(running), "");
  }
  [[nodiscard]] std::optional<Outcome> Verify(std::uint32_t position) {
    const bool near = IsNear(position, target_, settings_);
    if (!near && ++readings_ < kMaxReadings) return std::nullopt;
    const std::string was = Text("the position was %u and reads %u, set to %u", before_, position, target_);
    const ReadBack read_back = {.same_before = SameBefore(), .confirmed = confirmed_, .interrupted = interrupted_};
    Outcome outcome = near ? ReadBackOutcome(read_back, was)
                           : Final(CommandState::kFailed, command_status_t::REASON_READ_BACK_DIFFERS,
                                   was + ": hold the axis; does the encoder accept a preset?");
    return WithBefore(std::move(outcome), std::to_string(position));
  }
  [[nodiscard]] bool SameBefore() const {
    return CannotBeToldApart(before_, target_, PresetToleranceCounts(settings_.bits),
                             std::int64_t{1} << settings_.total_bits());
  }
  [[nodiscard]] Outcome WithBefore(Outcome outcome, const std::string& after) const {
    outcome.changes.push_back({"position", std::to_string(before_), after});
    return WithFindingBefore(std::move(outcome), SameBefore());
  }

  const std::uint32_t target_;
  const DeviceOutput& output_;
  MonoNs effect_from_ = 0;
  std::uint32_t before_ = 0;
  bool confirmed_ = false;    // the encoder confirmed the write
  bool interrupted_ = false;  // a reading after the write failed, or the encoder restarted
  int readings_ = 0;          // after the write
};

}  // namespace axlecast::cia406
