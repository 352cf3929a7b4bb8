#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/result.h"
#include "core/device/device.h"
#include "core/device/operation.h"

namespace axlecast {

struct DeviceSettings;

// ---- errors that every family reports in the same words, each with its REASON_* ----

[[nodiscard]] tl::unexpected<Error> BadArgument(std::string text);
[[nodiscard]] tl::unexpected<Error> NotPermitted(std::string text);  // the configuration forbids it
[[nodiscard]] tl::unexpected<Error> DeviceOffline(std::string text);
[[nodiscard]] tl::unexpected<Error> UnknownOperation(std::string_view family, std::string_view operation);

// Refuses a command while another one is carried out, after its time to begin, or without a link.
[[nodiscard]] Result<> CheckBegin(bool busy, const DriverCommand& command, MonoNs now, bool link_up);
// Refuses a command unless the last readings prove that the shaft stands still.
[[nodiscard]] Result<> CheckStandstill(const Motion& motion);

// Returns whether the last readings prove that the shaft stands still.
[[nodiscard]] bool AtRest(const DeviceOutput& output, MonoNs now);
// Returns what the last readings show of a shaft that is not proven to stand still, and what to do.
[[nodiscard]] std::string MotionText(const Motion& motion);
// Returns the final outcome of a procedure that found the shaft in motion before it changed anything.
[[nodiscard]] Outcome NotAtRest(const Motion& motion);
// Returns the final outcome of a command that expired before its first request was sent.
[[nodiscard]] Outcome NeverAsked();

// Returns the operation of that name; null if the family has none.
[[nodiscard]] const OperationSpec* FindOperation(std::span<const OperationSpec> operations, std::string_view name);

// ---- what reading back proves ----

// The evidence that an operation took effect, if the device reads as it should after it. An outcome claims an effect only
// if the device would have read differently without the operation (docs/commands.md, "What verified means").
struct ReadBack {
  bool same_before = false;  // the reading before was the same, or too near to distinguish the two
  bool confirmed = false;    // the device confirmed the operation, by a reply that has no other meaning
  // A reading after the operation failed, or the device restarted: its power may have failed before it stored the result.
  bool interrupted = false;
};

// The outcome of an operation after which the device reads as it should:
// - it read differently before: SUCCEEDED, verified;
// - it read the same before, and the device confirmed the operation: SUCCEEDED, not verified;
// - it read the same before, and nothing confirms the operation, or it was interrupted: INDETERMINATE.
[[nodiscard]] Outcome ReadBackOutcome(const ReadBack& read_back, std::string text);

// A value within `tolerance` of `wanted` counts as read back. Returns whether `before` is so near to `wanted` that a
// value within the tolerance may be the old one: up to twice the tolerance.
[[nodiscard]] bool CannotBeToldApart(std::int64_t before, std::int64_t wanted, std::int64_t tolerance,
                                     std::int64_t range);

// The change `finding` of an operation that verifies another (OperationSpec::verified_by_operation). The device can only
// show that it reads as it should. Whether that is an effect depends on the reading before.
inline constexpr const char* kReadsAsAfter = "reads_as_after";
inline constexpr const char* kNoEffectSeen = "no_effect_seen";
inline constexpr const char* kCannotTell = "cannot_tell";
[[nodiscard]] inline const char* FindingWord(bool reads_as_after) {
  return reads_as_after ? kReadsAsAfter : kNoEffectSeen;
}
// `lasts`: nothing can have undone the effect since. A shaft that turns may have left the place where it was zeroed, and an alarm
// that was cleared is latched again by its cause.
[[nodiscard]] inline const char* FindingWord(bool reads_as_after, bool lasts) {
  return reads_as_after ? kReadsAsAfter : lasts ? kNoEffectSeen : kCannotTell;
}
[[nodiscard]] Change FindingChange(const char* word);

// If the outcome leaves the effect open (kRunning or INDETERMINATE): adds the finding before the operation. The bridge
// compares it with a later finding.
[[nodiscard]] Outcome WithFindingBefore(Outcome outcome, bool reads_as_after);

// Returns the largest difference in counts between two readings of one place, for an accuracy of +- `arc_seconds`.
// Rounded up, at least 1.
[[nodiscard]] std::int64_t NoiseOfAccuracy(int arc_seconds, int single_turn_bits);

// ---- the executor ----

// One command being carried out on a device. Each family derives its own class with the steps that its protocol needs.
// After a final outcome it is not used any more.
class CommandProcedure {
 public:
  virtual ~CommandProcedure() = default;

  // Returns the final outcome if the link is lost now.
  [[nodiscard]] virtual Outcome OnLinkLost() const = 0;
  // Returns whether it may have changed something in the device. Such a command neither expires nor can be cancelled.
  [[nodiscard]] virtual bool touched() const { return false; }
  // Returns whether it changes nothing in the device. Such a command has begun with its first request; it does not expire
  // while it waits for the reply.
  [[nodiscard]] virtual bool reads_only() const { return false; }
};

// Carries out one command at a time on a device: validates, begins, cancels and expires it, and reports its outcomes.
// `Procedure` is the family's class, derived from CommandProcedure. The family drives the procedure with what happens on
// its bus, and hands each outcome to Report.
template <typename Procedure>
class CommandRunner {
 public:
  // What the family decides.
  class Policy {
   public:
    virtual ~Policy() = default;
    // Returns the procedure for a command, or an error with a REASON_* if an argument is wrong or the configuration
    // forbids it.
    [[nodiscard]] virtual Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                           MonoNs now) const = 0;
    // Returns an error with a REASON_* if the state of the device forbids the command now: offline, wrong identity, alarm.
    // The runner itself checks the link, the time to begin and the standstill.
    [[nodiscard]] virtual Result<> CheckState(const DriverCommand& command, MonoNs now) const = 0;
    // Returns an error with a REASON_* if the command is forbidden at this position. Called only for an operation that
    // needs a standstill, after the standstill was checked.
    [[nodiscard]] virtual Result<> CheckPosition(const DriverCommand&, const Motion&) const { return {}; }
  };

  // All arguments outlive the runner.
  CommandRunner(std::span<const OperationSpec> operations, const Policy& policy, DeviceOutput& output)
      : operations_(operations), policy_(policy), output_(output) {}

  // Implements Device::Validate.
  [[nodiscard]] Result<> Validate(const DriverCommand& command, bool link_up, MonoNs now) const {
    if (auto made = Admit(command, link_up, now); !made) return Failure(std::move(made.error()));
    return {};
  }
  // Implements Device::Begin. Returns whether the command has begun; otherwise its outcome was reported.
  bool Begin(const DriverCommand& command, bool link_up, MonoNs now) {
    auto made = Admit(command, link_up, now);
    if (!made) {
      output_.OnOutcome(command.id, RefusedOutcome(made.error()));
      return false;
    }
    procedure_ = *std::move(made);
    id_ = command.id;
    begin_by_ = command.begin_by;
    begun_ = in_flight_ = false;
    return true;
  }
  // Implements Device::Cancel.
  [[nodiscard]] bool Cancel(const CommandId& id) {
    if (!procedure_ || id != id_ || procedure_->touched()) return false;
    End();
    return true;
  }

  [[nodiscard]] bool busy() const { return procedure_ != nullptr; }
  // The procedure. Precondition: busy().
  [[nodiscard]] Procedure& procedure() const { return *procedure_; }
  // Returns whether the procedure has sent a request. Precondition: busy().
  [[nodiscard]] bool HasBegun() const { return begun_ || procedure_->touched(); }
  // Returns the procedure; null if there is no procedure, or if it has expired and must not transmit any more.
  [[nodiscard]] Procedure* Runnable(MonoNs now) const { return Expired(now) ? nullptr : procedure_.get(); }
  // Returns when the command expires unless its first request is sent before; kNever if it cannot expire.
  [[nodiscard]] MonoNs ExpiresAt() const {
    return procedure_ && !HasBegun() && begin_by_ < kNever ? begin_by_ + 1 : kNever;
  }

  // Records that a request is about to be sent, and whether it is the procedure's (`own`). After its own first request
  // the command does not expire any more.
  void OnStarted(bool own) {
    in_flight_ = own && busy();
    begun_ = begun_ || in_flight_;
  }
  // Returns once whether the request that has ended was the procedure's. A procedure never receives the reply to the
  // request of an earlier one.
  [[nodiscard]] bool TakeInFlight() { return std::exchange(in_flight_, false); }
  // Reports EXPIRED if the command has expired. Returns whether it has.
  bool ExpireIfLate(MonoNs now) { return Expired(now) && Report(NeverAsked()); }
  void OnLinkLost() {
    in_flight_ = false;
    if (procedure_) Report(procedure_->OnLinkLost());
  }
  // Reports an outcome of the procedure, if there is one. A final outcome ends the procedure. Returns whether it was final.
  bool Report(const std::optional<Outcome>& outcome) {
    if (!outcome) return false;
    output_.OnOutcome(id_, *outcome);
    if (outcome->IsFinal()) End();
    return outcome->IsFinal();
  }

 private:
  void End() {
    procedure_.reset();
    in_flight_ = false;
  }
  [[nodiscard]] bool Expired(MonoNs now) const { return procedure_ && !HasBegun() && now > begin_by_; }

  // A wrong argument comes first: such a command never passes.
  [[nodiscard]] Result<std::unique_ptr<Procedure>> Admit(const DriverCommand& command, bool link_up,
                                                         MonoNs now) const {
    auto made = policy_.MakeProcedure(command, now);
    if (!made) return made;
    if (Result<> ready = CheckBegin(busy(), command, now, link_up); !ready) return Failure(ready.error());
    if (Result<> state = policy_.CheckState(command, now); !state) return Failure(state.error());
    const OperationSpec* operation = FindOperation(operations_, command.operation);
    if (operation == nullptr || !operation->needs_standstill) return made;
    const Motion motion = output_.MotionAt(now);
    if (Result<> still = CheckStandstill(motion); !still) return Failure(still.error());
    if (Result<> position = policy_.CheckPosition(command, motion); !position) return Failure(position.error());
    return made;
  }

  const std::span<const OperationSpec> operations_;
  const Policy& policy_;
  DeviceOutput& output_;
  std::unique_ptr<Procedure> procedure_;
  CommandId id_{};
  MonoNs begin_by_ = kNever;
  bool begun_ = false;      // its first request was sent
  bool in_flight_ = false;  // the request under way is the procedure's
};

// The part of a device that is the same in every family with a CommandRunner. The device implements the policy.
template <typename Procedure>
class CommandDevice : public Device, protected CommandRunner<Procedure>::Policy {
 public:
  [[nodiscard]] Result<> Validate(const DriverCommand& command, MonoNs now) const override {
    return runner_.Validate(command, link_up_, now);
  }
  void Begin(const DriverCommand& command, MonoNs now) override { runner_.Begin(command, link_up_, now); }
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs) override { return runner_.Cancel(id); }

 protected:
  // `operations` and `output` outlive the device.
  CommandDevice(std::shared_ptr<const DeviceSettings> settings, std::span<const OperationSpec> operations,
                DeviceOutput& output)
      : owned_(std::move(settings)), output_(output), runner_(operations, *this, output) {}

  const std::shared_ptr<const DeviceSettings> owned_;  // the settings of the device, kept alive
  DeviceOutput& output_;
  CommandRunner<Procedure> runner_;
  bool link_up_ = false;
};

}  // namespace axlecast
