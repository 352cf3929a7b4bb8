#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "core/base/result.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/kit/refusal.h"

namespace axlecast {

// What every family refuses in the same words, as an error with a REASON_*.

// Refuses a command while another one is carried out, after its time to begin, or without a link.
[[nodiscard]] Result<> CheckBegin(bool busy, const DriverCommand& command, MonoNs now, bool link_up);
// Refuses a command that needs the shaft to stand still unless the last readings prove that it does.
[[nodiscard]] Result<> CheckStandstill(const Motion& motion);
[[nodiscard]] bool NeedsStandstill(std::span<const OperationSpec> operations, std::string_view operation);

// One command being carried out on a device. Each family derives its own class with the steps that its protocol needs.
// After a final outcome it is not used any more.
class CommandProcedure {
 public:
  virtual ~CommandProcedure() = default;

  // Returns the final outcome if the link is lost now.
  [[nodiscard]] virtual Outcome OnLinkLost() const = 0;
  // Returns whether it may have changed something in the device.
  [[nodiscard]] virtual bool touched() const { return false; }
};

// Carries out one command at a time on a device: validates, begins, cancels and expires it, and reports its outcomes.
// `Procedure` is the family's class, derived from CommandProcedure. The family drives the procedure with what happens on
// its bus, and hands each outcome to Report.
template <typename Procedure>
class CommandRunner {
 public:
  // What the family decides. Outlives the runner.
  class Policy {
   public:
    virtual ~Policy() = default;
    // Returns the procedure for a command, or an error with a REASON_* if an argument is wrong or the configuration
    // forbids it.
    [[nodiscard]] virtual Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                           MonoNs now) const = 0;
    // Returns why the state of the device forbids the command now: offline, wrong identity, alarm. The runner itself
    // checks the link, the time to begin and the standstill.
    [[nodiscard]] virtual Result<> CheckState(const DriverCommand& command, MonoNs now) const = 0;
    // Returns why the command is forbidden at this position; asked only for an operation that needs a standstill.
    [[nodiscard]] virtual Result<> CheckPosition(const DriverCommand&, const Motion&) const { return {}; }
  };

  // `operations` outlives the runner.
  CommandRunner(std::span<const OperationSpec> operations, const Policy& policy, DeviceOutput& output)
      : operations_(operations), policy_(policy), output_(output) {}

  // Device::Validate, Begin and Cancel. Begin returns whether the command has begun; else its outcome was reported.
  [[nodiscard]] Result<> Validate(const DriverCommand& command, bool link_up, MonoNs now) const {
    if (auto made = Admit(command, link_up, now); !made) return Failure(std::move(made.error()));
    return {};
  }
  bool Begin(const DriverCommand& command, bool link_up, MonoNs now) {
    auto made = Admit(command, link_up, now);
    if (!made) {
      output_.OnOutcome(command.id, RefusedOutcome(made.error()));
      return false;
    }
    procedure_ = *std::move(made);
    id_ = command.id;
    begin_by_ = command.begin_by;
    begun_ = false;
    return true;
  }
  [[nodiscard]] bool Cancel(const CommandId& id) {
    if (!procedure_ || id != id_ || procedure_->touched()) return false;
    procedure_.reset();
    return true;
  }

  [[nodiscard]] bool busy() const { return procedure_ != nullptr; }
  // The procedure; busy() only.
  [[nodiscard]] Procedure& procedure() const { return *procedure_; }
  // The procedure if there is one and it may still transmit.
  [[nodiscard]] Procedure* Runnable(MonoNs now) const { return Expired(now) ? nullptr : procedure_.get(); }
  // Returns when the command expires unless its first request is sent before; kNever if it has begun or there is none.
  [[nodiscard]] MonoNs ExpiresAt() const { return procedure_ && !HasBegun() ? begin_by_ : kNever; }

  // The first request of the procedure is about to be sent: the command expires no more.
  void MarkBegun() { begun_ = true; }
  // Reports EXPIRED if the time to begin is over. Returns whether it was.
  bool ExpireIfLate(MonoNs now) {
    if (!Expired(now)) return false;
    Report(NeverAsked());
    return true;
  }
  void OnLinkLost() {
    if (procedure_) Report(procedure_->OnLinkLost());
  }
  // Reports an outcome of the procedure. A final outcome ends it. Returns whether it was final.
  bool Report(const std::optional<Outcome>& outcome) {
    if (!outcome) return false;
    output_.OnOutcome(id_, *outcome);
    if (outcome->IsFinal()) procedure_.reset();
    return outcome->IsFinal();
  }

 private:
  [[nodiscard]] bool HasBegun() const { return begun_ || procedure_->touched(); }
  [[nodiscard]] bool Expired(MonoNs now) const { return procedure_ && !HasBegun() && now > begin_by_; }

  // A wrong argument comes first: such a command never passes.
  [[nodiscard]] Result<std::unique_ptr<Procedure>> Admit(const DriverCommand& command, bool link_up,
                                                         MonoNs now) const {
    auto made = policy_.MakeProcedure(command, now);
    if (!made) return made;
    if (Result<> ready = CheckBegin(busy(), command, now, link_up); !ready) return Failure(ready.error());
    if (Result<> state = policy_.CheckState(command, now); !state) return Failure(state.error());
    if (!NeedsStandstill(operations_, command.operation)) return made;
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
  bool begun_ = false;
};

}  // namespace axlecast
