#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "drivers/tsubaki_sc/access.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/operations.h"
#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/requests.h"

namespace axlecast::tsubaki_sc {

// What is read beside the live data, item after item: once each when the unit appears, then one a second as far as
// the bus has turns for it.
class SlowPlan {
 public:
  // The unit has appeared: every item once, the MFG number first, because it identifies the unit.
  void Restart();
  // Some item was not yet asked for since Restart.
  [[nodiscard]] bool introducing() const { return introduced_ < kItems.size(); }
  // The MFG number was not yet asked for since Restart.
  [[nodiscard]] bool identity_first() const { return introduced_ == 0; }
  [[nodiscard]] const Block& Next() const { return kItems[next_]; }
  [[nodiscard]] MonoNs due() const { return due_; }
  // Its own request is over. An item that the unit does not know is left out from now on.
  void OnAnswer(const Answer& answer);

 private:
  void Advance(MonoNs now);

  // The log interval is in the last of the parameters' blocks.
  static constexpr std::array<Block, 10> kItems = {
      kMfgNumber,   kStopCoil, kLoginStatus, kParameterBlocks[2], kMains,
      kProductCode, kVersion,  kSetValues,   kParameterBlocks[0], kParameterBlocks[1]};
  static constexpr MonoNs kPeriod = 1 * kSecond;

  std::size_t next_ = 0;
  std::size_t introduced_ = 0;
  std::uint32_t unknown_ = 0;  // bit i: the unit refuses item i
  int failures_ = 0;
  MonoNs due_ = 0;
};

// One SC unit: selects the next request. The Interpreter decodes the replies.
//
// - The fence: a Modbus reply does not contain its addresses, so a late reply could be taken for the reply to a later
//   request of the same length. If that is possible (timeout, damaged or unexpected reply, link up), the device first
//   reads the mains frequency (function 02), whose reply has a unique shape. A late reply to another request does not
//   match and is an error, and the fence is repeated. A stop does not wait for the fence: the echo of coil 100 is unique
//   too.
// - It transmits nothing while a reply may still arrive. A stop waits for that at most 25 ms.
// - A live slot reads 100-106 and 200-204 alternately. The log of a new trip (see trip_fetch), the login, and every other
//   request to a unit that has appeared use live slots too.
// - If the unit refuses a command with error 04 (logged out), the device logs in once and repeats the request. Unless the
//   configuration has log_out: false, the unit is logged out before the outcome is reported; after a stop, later.
class ScDevice final : public Device, private CommandRunner<Procedure>::Policy {
 public:
  ScDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output, SecretSource& secrets);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  [[nodiscard]] Result<> Validate(const DriverCommand& command, MonoNs now) const override;
  void Begin(const DriverCommand& command, MonoNs now) override;
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs now) override;

 private:
  // Whose exchange it is.
  enum class Work : std::uint8_t { kNone, kFence, kLogin, kUrgent, kCommand, kLive, kTrip, kSlow };

  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override;
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override;
  [[nodiscard]] Step BackgroundStep(MonoNs now) const;
  [[nodiscard]] Step UrgentStep(MonoNs now) const;
  [[nodiscard]] Step StepOf(Work work, Priority priority, MonoNs now) const;
  [[nodiscard]] Exchange ExchangeOf(Work work, MonoNs now) const;
  [[nodiscard]] Work WorkAt(Priority priority) const;
  [[nodiscard]] Work CommandWork(const CommandSlot& slot, Work own) const;
  [[nodiscard]] Work LiveWork() const;
  [[nodiscard]] CommandSlot* SlotAt(Priority priority);

  void OnExchange(const Event& event);
  void Track(const Answer& answer);
  void Settle(Work work, const Answer& answer);
  void OnFence(const Answer& answer);
  void OnCommandAnswer(CommandSlot& slot, const Answer& answer);
  void OnLoginAnswer(const Answer& answer);
  void PursueLogin(MonoNs now);
  void StartLogin(LoginGoal goal, MonoNs now);
  void EndLogin(bool done, MonoNs now);
  [[nodiscard]] bool LoginOfCommand() const;
  void OnLoginStatus(Work work, const Answer& answer);
  void LogInIfWanted(const Answer& answer);
  void Disappear();
  void OnLinkUp(MonoNs now);
  void OnLinkDown();

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  const ScSettings& settings_;
  const MonoNs character_;  // 0 on a simulated line
  const bool saturated_;    // live data as fast as the bus allows
  DeviceOutput& output_;
  Requests requests_;
  PasswordTable passwords_;
  Login login_;
  Interpreter interpreter_;
  SlowPlan slow_;
  const OperationContext context_;
  CommandSlot urgent_;
  CommandSlot command_;

  bool link_up_ = false;
  bool answering_ = false;
  int silent_ = 0;  // exchanges in a row without a single byte
  bool fence_ = false;
  MonoNs quiet_until_ = 0;  // nothing is transmitted before
  MonoNs busy_since_ = 0;   // with quiet_until_: since when the line has not been idle
  Work in_flight_ = Work::kNone;
  Priority priority_ = Priority::kLive;  // of what is in flight
  bool status_next_ = false;             // the second half of the live data
  bool lent_ = false;                    // the last live turn was not used for live data
  bool log_out_failed_ = false;          // it is retried when the login state is read again
  bool history_next_ = true;             // among the slow turns, between old logs and slow items
};

}  // namespace axlecast::tsubaki_sc
