#pragma once

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/access/admission.h"
#include "bridge/dispatch/command_port.h"
#include "bridge/dispatch/device_queue.h"
#include "bridge/state/command_store.h"
#include "bridge/state/device_state.h"
#include "bridge/store/journal_queue.h"
#include "core/alarm/alarm_table.h"
#include "core/config/machine_config.h"
#include "core/messages/machine_filter.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"

namespace axlecast {

// Dependencies of the dispatcher. All must outlive it.
struct BridgePorts {
  JournalWorker* journal = nullptr;
  MessageSink* commands = nullptr;
  MessageSink* data = nullptr;
  const SigningKey* key = nullptr;                                 // null: messages are not signed
  std::function<std::vector<OtherMachine>()> other_machines = {};  // on the command port; null: none
  std::function<void(const std::string& line)> log;
  std::function<CommandId()> random;  // for tokens
};

// The bridge without its I/O: takes commands of those who may give them, notes them, routes each to the driver of
// its device, one at a time per device (urgent ones beside it), and gives every id exactly one final outcome.
// Publishes COMMAND_STATUS, DRIVER_COMMAND/<bus> and ALARM/bridge. One thread, which never waits for the journal: a
// command that must be noted waits in its queue for at most JournalQueue::kStalled, and others pass it.
class Dispatcher final : private DeviceQueueListener {
 public:
  static constexpr MonoNs kCheckWithin = 20 * kSecond;  // after an INDETERMINATE, then FINDING_CANNOT_TELL

  // Questions that the journal must answer, at one time; a client repeats its question.
  static constexpr std::size_t kMaxLookups = 100;

  // Takes up what an earlier bridge has left in the journal, as soon as that can be read.
  Dispatcher(const MachineConfig& machine, const Origin& origin, BridgePorts ports, Timestamp now);
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  void OnCommand(Bytes message, Timestamp now);
  void OnDriverStatus(const std::string& channel, Bytes message, Timestamp now);
  void OnCommandStatus(Bytes message, Timestamp now);
  // At least every 20 ms.
  void Tick(Timestamp now);
  // Processes what the journal's thread has finished. Every other public function does this too.
  void Settle(Timestamp now);

  [[nodiscard]] const DuplicateBridgeDetector& watch() const { return watch_; }
  // Fails while no command that changes a device is accepted, because of the journal.
  [[nodiscard]] Result<> CheckJournal(MonoNs now) const;
  // Messages that could not be read, or were not from whom they should be.
  [[nodiscard]] std::int64_t unauthorized() const { return unauthorized_.count(); }

 private:
  struct Bus {
    const BusConfig* config = nullptr;
    DriverLink driver;
    std::map<std::string, DeviceQueue> queues;  // by device
    std::map<std::string, DeviceQueue> urgent;  // by device: OperationSpec::urgent waits for nothing else
  };

  // A command on its way in.
  struct IncomingCommand {
    const command_body_t& body;
    Caller caller;
    ValidatedCommand validated;
    command_status_t status;
  };

  // What the journal holds, as its thread has read it.
  struct Snapshot {
    DeviceMemory devices;
    std::vector<OpenCommand> open;
    std::int64_t first_epoch = 0;  // 0: none could be reserved
  };
  // A question that the journal must answer.
  struct Lookup {
    // `known`: as the journal has it. `can_tell`: it could be asked.
    std::function<void(std::optional<command_status_t> known, bool can_tell)> answer;
    MonoNs since = 0;
    bool answered = false;
  };
  // An outcome that the journal is writing. It is published afterwards.
  struct UnpublishedOutcome {
    command_status_t status;
    MonoNs since = 0;
    bool published = false;
  };

  void Settle();
  void LoadJournal();
  void RecoverAll(Snapshot snapshot);
  void TickJournal();
  void PublishAlarms(Timestamp now);
  void Execute(IncomingCommand incoming, Timestamp now);
  void Query(const command_body_t& body, Timestamp now);
  void RefuseUnlessKnown(const command_status_t& status, const Error& refusal, Timestamp now);
  void LookUp(const CommandId& id, decltype(Lookup::answer) answer);
  void Cancel(const IncomingCommand& incoming, Timestamp now);
  void PublishKnown(const command_body_t& body, const std::string& text, Timestamp now);
  void Accept(IncomingCommand incoming, Timestamp now);
  void EnqueueVolatile(const IncomingCommand& incoming, PendingCommand pending, const Result<>& accepted,
                       Timestamp now);
  void JournalAcceptance(const IncomingCommand& incoming, DeviceQueue& queue, Timestamp now);
  void OnAccepted(DeviceQueue& queue, const command_status_t& status, bool passes,
                  const std::optional<command_status_t>& known);
  [[nodiscard]] Result<> MakePending(const IncomingCommand& incoming, PendingCommand& pending, Timestamp now);
  [[nodiscard]] Result<> CheckBusy(const Bus& bus, const DeviceQueue& queue, MonoNs now) const;
  [[nodiscard]] Result<> CheckJournalRoom(const OperationSpec& operation, MonoNs now) const;
  [[nodiscard]] Result<> CheckRoom(const OperationSpec& operation, bool has_room, MonoNs now) const;
  [[nodiscard]] CommandRecord RecordOf(const IncomingCommand& incoming, Timestamp now) const;
  [[nodiscard]] Error NotJournalled(MonoNs now) const;
  void Refuse(command_status_t status, const Error& refusal, Timestamp now);
  void OnUnauthorized(const std::string& what, Timestamp now);
  void OnHello(Bus& bus, const driver_status_t& status, Timestamp now);
  void EndCommand(PendingCommand pending, Timestamp now);
  void BeginOutcomeCheck(const PendingCommand& pending, command_status_t& status, Timestamp now);
  void EndOutcomeCheck(const PendingCommand& pending, Timestamp now);
  void TakeLateOutcome(const PendingCommand& check, command_status_t& outcome, Timestamp now);
  void Conclude(const command_status_t& status, Timestamp now);
  void PublishOutcome(UnpublishedOutcome& outcome, bool noted);
  void PublishOverdue();
  void Recover(const OpenCommand& command, Timestamp now);
  [[nodiscard]] DeviceQueue& QueueOf(Bus& bus, const std::string& device, const OperationSpec* operation);

  std::int64_t Send(const PendingCommand& pending, std::int8_t kind, std::int32_t valid_ms, Timestamp now) override;
  CommandId NewId() override;
  Result<> BeforeRoute(PendingCommand& pending, Timestamp now) override;
  Result<> CheckJournalWait(const PendingCommand& pending, Timestamp now) override;
  void OnStep(PendingCommand& pending, Timestamp now) override;
  void OnEnd(PendingCommand pending, Timestamp now) override;

  const MachineConfig& machine_;
  const BridgePorts ports_;
  Timestamp now_;  // of the present call
  JournalQueue journal_;
  DeviceStore devices_;
  CommandPort port_;
  CommandStore commands_;
  Authority authority_;
  DuplicateBridgeDetector watch_;
  AxisStateStore axes_;
  AlarmStateStore marks_;
  PreparedCommands prepared_;
  UnauthorizedMessageCounter unauthorized_;
  ProgramAlarms alarms_;
  std::int64_t published_alarms_ = -1;  // revision
  MonoNs alarms_published_at_ = -kSecond;
  std::map<std::string, Bus> buses_;
  std::int64_t own_ids_ = 0;
  std::list<std::shared_ptr<Lookup>> lookups_;
  std::list<std::shared_ptr<UnpublishedOutcome>> unpublished_;
  bool loading_ = false;   // the journal is being read
  bool loaded_ = false;    // what the journal holds has been taken up
  bool reserved_ = false;  // epochs are above those of every bridge before
  bool ticking_ = false;   // the journal's thread has its Tick
};

}  // namespace axlecast
