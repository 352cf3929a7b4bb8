#include "bridge/dispatch/dispatcher.h"

#include <algorithm>
#include <axlecast/driver_order_t.hpp>
#include <utility>

#include "bridge/dispatch/outcome_check.h"
#include "core/alarm/alarm_codes.h"
#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::string_view kDriverStatus = "DRIVER_STATUS/";
constexpr std::string_view kNotNoted = "; the journal has not noted it";
constexpr std::int64_t kEpochs = std::int64_t{1} << 32;  // reserved at each start: never used up

Error IdReused() { return {"this id was used with another body: take a new random id", S::REASON_ID_REUSED}; }

// Of a command that this bridge does not remember, while its journal does not answer.
S CannotTell(S status) {
  status.reason_code = S::REASON_JOURNAL;
  status.text = "the journal does not answer at present, so nothing is known of this id: ask again later";
  return status;
}

bool IsVolatile(const command_body_t& body, const OperationSpec& operation) {
  return body.mode == command_body_t::MODE_PREPARE || operation.reads_only;
}

}  // namespace

Dispatcher::Dispatcher(const MachineConfig& machine, const Origin& origin, BridgePorts ports, Timestamp now)
    : machine_(machine),
      ports_(std::move(ports)),
      now_(now),
      journal_(*ports_.journal),
      devices_(journal_, now_),
      port_(*ports_.commands, origin, ports_.key, now.utime),
      authority_(machine.bridge),
      watch_(origin.boot_id, now.mono),
      axes_(devices_, [this](const AxisEvent& event) { ports_.log(event.device + ": " + event.text); }),
      marks_(devices_),
      alarms_("bridge", origin) {
  for (const BusConfig& config : machine.buses) {
    Bus& bus = buses_[config.name];
    bus.config = &config;
    bus.driver.ListenFrom(now.mono);
    bus.driver.Expect(bus.config->devices);
    for (const DeviceConfig& device : config.devices) {
      bus.queues.try_emplace(device.name, bus.driver, static_cast<DeviceQueueListener&>(*this));
      bus.urgent.try_emplace(device.name, bus.driver, static_cast<DeviceQueueListener&>(*this));
    }
  }
  LoadJournal();
  Settle();
}

// Continues what the journal's thread has finished in the meantime. Every public function ends with this call.
void Dispatcher::Settle() {
  journal_.Settle();
  PublishOverdue();
}

// Reads what an earlier bridge left, and reserves epochs above those of every bridge before.
void Dispatcher::LoadJournal() {
  if (loading_ || (loaded_ && (reserved_ || !journal_.Check(now_.mono)))) return;
  loading_ = true;
  std::vector<std::string> names;
  for (const BusConfig& bus : machine_.buses) {
    for (const DeviceConfig& device : bus.devices) names.push_back(device.name);
  }
  const auto snapshot = std::make_shared<Snapshot>();
  journal_.Ask(
      [snapshot, names = std::move(names), utime = now_.utime](DurableStore& store) {
        snapshot->first_epoch = store.ReserveEpochs(utime, kEpochs);
        if (!store.readable()) return false;
        for (const std::string& name : names) snapshot->devices.Load(name, store);
        snapshot->open = store.Open();
        return true;
      },
      [this, snapshot](bool read) {
        loading_ = false;
        reserved_ = reserved_ || snapshot->first_epoch != 0;
        port_.RaiseEpoch(snapshot->first_epoch);
        if (read && !loaded_) RecoverAll(std::move(*snapshot));
      },
      now_.mono);
}

void Dispatcher::RecoverAll(Snapshot snapshot) {
  loaded_ = true;
  devices_.Load(std::move(snapshot.devices));
  for (const OpenCommand& command : snapshot.open) {
    if (commands_.Find(IdOf(command.record.status.id)) == nullptr) Recover(command, now_);
  }
}

void Dispatcher::Settle(Timestamp now) {
  now_ = now;
  Settle();
}

// What is due in the journal's thread: one at a time.
void Dispatcher::TickJournal() {
  if (ticking_) return;
  ticking_ = true;
  journal_.Ask(
      [now = now_, positions = devices_.TakePositions()](DurableStore& store) {
        for (const auto& [device, position] : positions) store.KeepPosition(device, position);
        store.Tick(now);
        return true;
      },
      [this](bool /*written*/) { ticking_ = false; }, now_.mono);
}

Result<> Dispatcher::CheckJournal(MonoNs now) const {
  if (Result<> usable = journal_.Check(now); !usable || loaded_) return usable;
  return Failure("it has not been read yet: send this again in a second");
}

// A command that an earlier bridge left: one that was never sent is refused; of one that was, its driver is asked.
void Dispatcher::Recover(const OpenCommand& command, Timestamp now) {
  PendingCommand pending = RecoveredCommand(machine_, command);
  commands_.Begin(pending.status, now.mono);
  commands_.MarkPublished(pending.status);
  if (pending.operation == nullptr || pending.status.driver_boot_id == 0) {
    GiveUp(pending.status, now);
    return EndCommand(std::move(pending), now);
  }
  static_cast<void>(axes_.Substitute(*machine_.BusOf(pending.device)->family, pending));
  pending.sent_epoch = port_.epoch() + 1;  // of the first order that its driver can have of this bridge
  pending.reserved_writes = pending.WritesAtMost();
  if (pending.status.state == S::STATE_INDETERMINATE) {
    BeginOutcomeCheck(pending, pending.status, now);
    if (pending.status.finding != S::FINDING_NONE) Conclude(pending.status, now);
    return;
  }
  DeviceQueue& queue = QueueOf(buses_.at(machine_.BusOf(pending.device)->name), pending.device, pending.operation);
  queue.PushRecovered(std::move(pending));
}

void Dispatcher::OnCommandStatus(Bytes message, Timestamp now) {
  now_ = now;
  const auto status = DecodeMessage<command_status_t>(message);
  if (!status || status->boot_id == port_.boot_id()) return;
  const auto& key = machine_.bridge.bridge.public_key;
  if (key && !VerifyMessage(*key, Domain::kStatus, *status)) {
    return OnUnauthorized("a status that no bridge of this machine has signed", now);
  }
  watch_.OnOther(status->boot_id, now.mono);
}

void Dispatcher::OnDriverStatus(const std::string& channel, Bytes message, Timestamp now) {
  now_ = now;
  if (!channel.starts_with(kDriverStatus)) return;
  const auto found = buses_.find(channel.substr(kDriverStatus.size()));
  if (found == buses_.end()) return;
  const auto status = DecodeMessage<driver_status_t>(message);
  const auto& key = machine_.bridge.drivers.public_key;
  if (!status || status->bus != found->first || (key && !VerifyMessage(*key, Domain::kDriver, *status))) {
    return OnUnauthorized("a message on " + channel + " that no driver of this machine has signed", now);
  }
  Bus& bus = found->second;
  if (!bus.driver.On(*status, now.mono)) return;
  port_.RaiseEpoch(status->bridge_epoch);
  if (status->kind == driver_status_t::KIND_HELLO && loaded_) OnHello(bus, *status, now);
  if (status->kind == driver_status_t::KIND_ACKNOWLEDGED && loaded_) marks_.OnAcknowledged(*status);
  for (auto* queues : {&bus.urgent, &bus.queues}) {
    for (auto& [device, queue] : *queues) {
      if (status->kind == driver_status_t::KIND_STATUS) queue.OnStatus(*status, now);
      queue.Tick(now);
    }
  }
  Settle();
}

void Dispatcher::OnHello(Bus& bus, const driver_status_t& status, Timestamp now) {
  for (const driver_device_t& reported : status.devices) {
    const auto queue = bus.queues.find(reported.device);
    if (queue == bus.queues.end()) continue;
    auto command =
        axes_.OnHello(*machine_.FindDevice(reported.device), reported, status.boot_id, queue->second.IsIdle(), now);
    if (!command) command = marks_.OnHello(reported.device, status.boot_id, now);
    if (!command || queue->second.Holds(PendingCommand::Purpose::kRestore)) continue;
    PendingCommand pending;
    pending.purpose = PendingCommand::Purpose::kRestore;
    pending.device = reported.device;
    pending.operation = FindOperation(*bus.config->family, command->operation);
    pending.arguments = std::move(command->arguments);
    queue->second.PushFirst(std::move(pending));
  }
}

void Dispatcher::Tick(Timestamp now) {
  now_ = now;
  TickJournal();
  Settle();
  LoadJournal();
  if (const auto question = watch_.Probe(now.mono)) port_.PublishQuery(*question, now);
  for (auto& [name, bus] : buses_) {
    for (auto& [device, queue] : bus.urgent) queue.Tick(now);
    for (auto& [device, queue] : bus.queues) queue.Tick(now);
  }
  Settle();
  PublishAlarms(now);
}

// Publishes ALARM/bridge on change, at most ten times a second, and once a second.
void Dispatcher::PublishAlarms(Timestamp now) {
  using namespace bridge_alarms;
  alarms_.Set(kUnauthorizedCommands, unauthorized_.Recent(now.mono), now.utime);
  alarms_.Set(kJournalFails, !CheckJournal(now.mono), now.utime);
  alarms_.Set(kUnsignedAllowed, machine_.bridge.allow_unsigned, now.utime);
  alarms_.Set(kEncoderExchanged, axes_.AnyExchanged(), now.utime);
  alarms_.Set(kPlaceDoubtful, axes_.AnyDoubtful(), now.utime);
  alarms_.Set(kKeyMissing, machine_.bridge.bridge.public_key && ports_.key == nullptr, now.utime);
  alarms_.Set(kOtherBridge, watch_.Other(now.mono).has_value(), now.utime);
  const auto others = ports_.other_machines ? ports_.other_machines() : std::vector<OtherMachine>();
  alarms_.Set(
      kOtherMachine, !others.empty(), now.utime, false,
      others.empty() ? "" : machine_.machine + " and " + NamesOf(others) + " use one LCM group: axlecast doctor");
  const bool changed = alarms_.revision() != published_alarms_;
  const MonoNs period = changed ? 100 * kMillisecond : kSecond;
  if (now.mono - alarms_published_at_ < period) return;
  alarms_published_at_ = now.mono;
  published_alarms_ = alarms_.revision();
  Publish(*ports_.data, "ALARM/bridge", alarms_.Make(now));
}

std::int64_t Dispatcher::Send(const PendingCommand& pending, std::int8_t kind, std::int32_t valid_ms,
                              Timestamp now) {
  driver_order_t order{};
  order.driver_boot_id = pending.status.driver_boot_id;
  const CommandId& id = pending.queries_driver ? pending.about : pending.id;
  std::copy(id.begin(), id.end(), std::begin(order.id));
  order.kind = kind;
  order.valid_ms = valid_ms;
  order.device = pending.device;
  order.expect_epoch = pending.expect_epoch;
  if (pending.operation != nullptr) order.operation = pending.operation->name;
  const bool carries = kind == driver_order_t::KIND_EXECUTE || kind == driver_order_t::KIND_PREPARE;
  if (carries) order.arguments = pending.arguments;
  return port_.SendToDriver(machine_.BusOf(pending.device)->name, std::move(order), now);
}

CommandId Dispatcher::NewId() {
  CommandId id;
  const std::int64_t number = ++own_ids_;
  for (std::size_t i = 0; i < 8; ++i) {
    id[i] = static_cast<std::uint8_t>(port_.boot_id() >> (8 * i));
    id[8 + i] = static_cast<std::uint8_t>(number >> (8 * i));
  }
  return id;
}

Result<> Dispatcher::BeforeRoute(PendingCommand& pending, Timestamp now) {
  pending.journal_state = PendingCommand::JournalState::kReady;
  if (pending.purpose != PendingCommand::Purpose::kCommand) return {};
  const bool is_volatile = commands_.IsVolatile(pending.id);
  if (!is_volatile) {
    if (auto room = CheckJournalRoom(*pending.operation, now.mono); !room) return room;
  }
  if (auto routable = axes_.BeforeRoute(*machine_.FindDevice(pending.device), pending, now); !routable)
    return routable;
  if (auto routable = marks_.BeforeRoute(pending, now); !routable) return routable;
  if (is_volatile || (pending.operation->urgent && journal_.IsFull())) return {};
  const bool waits = !pending.operation->urgent || !journal_.IsSlow(now.mono);
  if (waits) pending.journal_state = PendingCommand::JournalState::kRouted;
  DeviceQueue& queue = QueueOf(buses_.at(machine_.BusOf(pending.device)->name), pending.device, pending.operation);
  journal_.Give([status = pending.status, epoch = port_.epoch(),
                 now](DurableStore& store) { return store.Routed(status, epoch, now); },
                [this, id = pending.id, &queue](bool written) {
                  queue.OnJournalled(id, PendingCommand::JournalState::kRouted, written, NotJournalled(now_.mono),
                                     now_);
                  queue.Tick(now_);
                },
                now.mono);
  return {};
}

Result<> Dispatcher::CheckJournalWait(const PendingCommand& pending, Timestamp now) {
  if (now.mono - pending.journal_since <= JournalQueue::kStalled) return {};
  return Failure(NotJournalled(now.mono));
}

void Dispatcher::OnStep(PendingCommand& pending, Timestamp now) {
  if (pending.purpose != PendingCommand::Purpose::kCommand) return;
  const command_status_t& status = pending.status;
  commands_.Update(status);
  commands_.MarkPublished(status);
  // Routed has noted the first step already.
  if (!commands_.IsVolatile(pending.id) && status.state != S::STATE_ROUTED && !journal_.IsHalfFull()) {
    journal_.Ask([status, now](DurableStore& store) { return store.Step(status, now), true; }, nullptr, now.mono);
  }
  port_.PublishStatus(status, now);
}

void Dispatcher::OnEnd(PendingCommand pending, Timestamp now) {
  if (pending.purpose == PendingCommand::Purpose::kOutcomeCheck) return EndOutcomeCheck(pending, now);
  if (pending.purpose == PendingCommand::Purpose::kCommand) return EndCommand(std::move(pending), now);
  axes_.OnOutcome(*machine_.FindDevice(pending.device), pending, now);
  marks_.OnOutcome(pending);
}

void Dispatcher::EndCommand(PendingCommand pending, Timestamp now) {
  if (const DeviceConfig* device = machine_.FindDevice(pending.device)) axes_.OnOutcome(*device, pending, now);
  marks_.OnOutcome(pending);
  command_status_t& status = pending.status;
  status.is_final = 1;
  if (pending.prepare && status.state == S::STATE_SUCCEEDED) {
    const Token token = ports_.random();
    std::copy(token.begin(), token.end(), std::begin(status.token));
    const bool substituted = pending.operation->name != status.operation;
    prepared_.Issue(token,
                    {.who = pending.who,
                     .device = pending.device,
                     .operation = status.operation,
                     .arguments = substituted ? std::vector<argument_t>{} : pending.arguments,
                     .epoch = status.epoch_after},
                    now.mono);
  }
  if (status.state == S::STATE_INDETERMINATE && status.finding == S::FINDING_NONE)
    BeginOutcomeCheck(pending, status, now);
  Conclude(status, now);
}

// Publishes an outcome or its finding after the journal has written it, or after the journal failed or stalled.
void Dispatcher::Conclude(const command_status_t& status, Timestamp now) {
  commands_.Update(status);
  if (commands_.IsVolatile(IdOf(status.id))) return port_.PublishStatus(status, now);
  auto outcome = std::make_shared<UnpublishedOutcome>(UnpublishedOutcome{status, now.mono});
  if (journal_.IsOverfull()) return PublishOutcome(*outcome, false);
  if (journal_.IsFull() || journal_.IsStalled(now.mono)) PublishOutcome(*outcome, false);
  if (!outcome->published) unpublished_.push_back(outcome);
  journal_.Ask(
      [status, now](DurableStore& store) {
        store.Outcome(status, now);
        return store.state().has_value();
      },
      [this, outcome](bool noted) {
        PublishOutcome(*outcome, noted);
        unpublished_.remove(outcome);
      },
      now.mono);
}

// `noted`: it is on the journal's disk. If it is not, the next bridge may report another outcome after a power failure.
void Dispatcher::PublishOutcome(UnpublishedOutcome& outcome, bool noted) {
  if (std::exchange(outcome.published, true)) return;
  if (!noted)
    outcome.status.text = CappedText(outcome.status.text, kTextBytes - kNotNoted.size()) + std::string(kNotNoted);
  commands_.MarkPublished(outcome.status);
  port_.PublishStatus(outcome.status, now_);
}

// Publishes the outcomes whose journal entries have waited longer than JournalQueue::kStalled.
void Dispatcher::PublishOverdue() {
  for (const auto& outcome : unpublished_) {
    if (now_.mono - outcome->since > JournalQueue::kStalled) PublishOutcome(*outcome, false);
  }
  std::erase_if(unpublished_, [](const auto& outcome) { return outcome->published; });
  for (const auto& lookup : lookups_) {
    if (lookup->answered || now_.mono - lookup->since <= JournalQueue::kSlow) continue;
    lookup->answered = true;
    lookup->answer(std::nullopt, false);
  }
}

void Dispatcher::BeginOutcomeCheck(const PendingCommand& pending, command_status_t& status, Timestamp now) {
  Bus& bus = buses_.at(machine_.BusOf(pending.device)->name);
  const bool gone = status.reason_code != S::REASON_DRIVER_SILENT;
  if (gone && IsOfRuntime(*bus.config->family, *pending.operation)) {
    // It would have changed that driver alone, which is no more.
    status.finding = S::FINDING_NO_EFFECT_SEEN;
    return;
  }
  if (auto finding = OutcomeCheckFor(pending, *bus.config->family, now.mono + kCheckWithin)) {
    bus.queues.at(pending.device).PushFirst(std::move(*finding));
  } else {
    status.finding = S::FINDING_CANNOT_TELL;
  }
}

void Dispatcher::EndOutcomeCheck(const PendingCommand& pending, Timestamp now) {
  if (auto again = NextOutcomeCheck(pending, now.mono)) {
    return buses_.at(machine_.BusOf(pending.device)->name).queues.at(pending.device).PushFirst(std::move(*again));
  }
  const KnownCommand* const known = commands_.Find(pending.about);
  if (known == nullptr) return;
  command_status_t outcome = known->latest;
  AddCheckedOutcome(pending, outcome);
  const bool certain = outcome.finding != S::FINDING_CANNOT_TELL || pending.status.state == S::STATE_SUCCEEDED;
  if (pending.queries_driver && certain) TakeLateOutcome(pending, outcome, now);
  Conclude(outcome, now);
}

// A driver that had been silent has reported its own outcome. What it changed must outlive it, as after an outcome in time.
void Dispatcher::TakeLateOutcome(const PendingCommand& check, command_status_t& outcome, Timestamp now) {
  PendingCommand command;
  command.id = check.about;
  command.device = check.device;
  command.operation = check.about_operation;
  command.arguments = check.about_arguments;
  command.who = check.who;
  command.reason = check.reason;
  command.status = check.status;
  command.status.operation = outcome.operation;
  command.status.text.clear();
  if (const DeviceConfig* device = machine_.FindDevice(check.device)) axes_.OnOutcome(*device, command, now);
  marks_.OnOutcome(command);
  outcome.text = CappedText(outcome.text + command.status.text, kTextBytes);  // that the journal could not keep it
}

DeviceQueue& Dispatcher::QueueOf(Bus& bus, const std::string& device, const OperationSpec* operation) {
  return operation->urgent ? bus.urgent.at(device) : bus.queues.at(device);
}

// ---- the way in: from a message of a client to a command in the queue of its device ----

void Dispatcher::OnCommand(Bytes message, Timestamp now) {
  now_ = now;
  const auto envelope = DecodeMessage<command_t>(message);
  const auto body = envelope ? DecodeMessage<command_body_t>(envelope->body) : std::nullopt;
  if (!body) return OnUnauthorized("a command that cannot be read", now);
  if (watch_.IsListening(now.mono)) return;  // clients repeat
  if (body->mode == command_body_t::MODE_QUERY) {
    Query(*body, now);
    return Settle();
  }
  command_status_t status = StatusOf(*body, BodyDigest(envelope->body));
  auto caller = authority_.Identify(*envelope, *body);
  if (!caller) {
    OnUnauthorized("a command for " + status.device + ": " + caller.error().text, now);
    if (unauthorized_.MayAnswer(now.mono)) Refuse(std::move(status), caller.error(), now);
    return;
  }
  Execute({*body, *std::move(caller), {}, std::move(status)}, now);
  Settle();
}

void Dispatcher::Query(const command_body_t& body, Timestamp now) {
  if (const KnownCommand* known = commands_.Find(IdOf(body.id))) {
    if (known->published.state != S::STATE_UNKNOWN) return port_.PublishStatus(known->published, now);
    return port_.PublishStatus(CannotTell(StatusOf(body, 0)), now);
  }
  LookUp(IdOf(body.id), [this, status = StatusOf(body, 0)](auto known, bool can_tell) {
    port_.PublishStatus(known ? *known : can_tell ? status : CannotTell(status), now_);
  });
}

// Asks the journal for a command that this bridge does not remember. It is answered within JournalQueue::kSlow, if
// necessary with "not known", so that a client finds this bridge while the disk does not respond.
void Dispatcher::LookUp(const CommandId& id, decltype(Lookup::answer) answer) {
  if (journal_.IsSlow(now_.mono)) return answer(std::nullopt, false);
  if (lookups_.size() >= kMaxLookups) return;
  auto lookup = std::make_shared<Lookup>(Lookup{std::move(answer), now_.mono});
  lookups_.push_back(lookup);
  auto found = std::make_shared<std::optional<command_status_t>>();
  journal_.Ask(
      [found, id](DurableStore& store) {
        *found = store.Find(id);
        return store.readable();
      },
      [this, lookup, found](bool readable) {
        if (!lookup->answered) lookup->answer(std::move(*found), readable);
        lookups_.remove(lookup);
      },
      now_.mono);
}

void Dispatcher::Execute(IncomingCommand incoming, Timestamp now) {
  const command_body_t& body = incoming.body;
  const bool cancels = body.mode == command_body_t::MODE_CANCEL;
  if (const KnownCommand* known = commands_.Find(IdOf(body.id)); known != nullptr && !cancels) {
    if (known->latest.body_digest != incoming.status.body_digest) return Refuse(incoming.status, IdReused(), now);
    if (known->published.state != S::STATE_UNKNOWN) port_.PublishStatus(known->published, now);
    return;
  }
  const auto validated = ValidateCommand(machine_, port_.boot_id(), authority_, incoming.caller, body, now.mono);
  if (!validated) {
    const Error& error = validated.error();
    if (error.reason == S::REASON_DENIED) ports_.log(incoming.caller.who + ": " + error.text);
    return cancels ? PublishKnown(body, error.text, now) : RefuseUnlessKnown(incoming.status, error, now);
  }
  incoming.validated = *validated;
  return cancels ? Cancel(incoming, now) : Accept(std::move(incoming), now);
}

// A command that may not be taken up: it may be one that an earlier bridge has taken up.
void Dispatcher::RefuseUnlessKnown(const command_status_t& status, const Error& refusal, Timestamp /*now*/) {
  LookUp(IdOf(status.id), [this, status, refusal](const auto& known, bool /*can_tell*/) {
    if (!known) return Refuse(status, refusal, now_);
    if (known->body_digest != status.body_digest) return Refuse(status, IdReused(), now_);
    port_.PublishStatus(*known, now_);
  });
}

void Dispatcher::Cancel(const IncomingCommand& incoming, Timestamp now) {
  const CommandId id = IdOf(incoming.body.id);
  Bus& bus = buses_.at(incoming.validated.bus->name);
  DeviceQueue& queue = QueueOf(bus, incoming.body.device, incoming.validated.operation);
  const auto sender = queue.SenderOf(id);
  if (!sender) return PublishKnown(incoming.body, "", now);
  if (!authority_.MayCancel(incoming.caller, *sender)) {
    return PublishKnown(incoming.body, "only who gave it, or a maintainer, may cancel it", now);
  }
  queue.Cancel(id, now);
  PublishKnown(incoming.body, "the driver was asked to give it up if it has not begun", now);
}

// Publishes the status of a command that was to be cancelled. Unless it has ended, `text` states the result.
void Dispatcher::PublishKnown(const command_body_t& body, const std::string& text, Timestamp now) {
  const auto tell = [this, text](command_status_t status) {
    if (!IsFinalState(status.state) && status.state != S::STATE_UNKNOWN) status.text = text;
    port_.PublishStatus(std::move(status), now_);
  };
  if (const KnownCommand* known = commands_.Find(IdOf(body.id))) {
    if (known->published.state != S::STATE_UNKNOWN) return tell(known->published);
    return port_.PublishStatus(CannotTell(StatusOf(body, 0)), now);
  }
  LookUp(IdOf(body.id), [tell, status = StatusOf(body, 0)](const auto& known, bool can_tell) {
    tell(known ? *known : can_tell ? status : CannotTell(status));
  });
}

Result<> Dispatcher::CheckBusy(const Bus& bus, const DeviceQueue& queue, MonoNs now) const {
  if (watch_.Other(now)) {
    return Failure("another bridge serves this command port: stop one of the two", S::REASON_FENCED);
  }
  if (bus.driver.IsAbsent(now)) {
    return Failure("the driver of " + bus.config->name + " is not running: start it (axlecast driver " +
                       bus.config->name + ", or systemctl)",
                   S::REASON_DRIVER_ABSENT);
  }
  if (queue.IsFull()) {
    return Failure(
        std::to_string(DeviceQueue::kMaxWaiting) + " commands wait for this device already: send it again later",
        S::REASON_QUEUE_FULL);
  }
  return {};
}

// Fills `pending` for a command. Returns the refusal if the command cannot be carried out.
Result<> Dispatcher::MakePending(const IncomingCommand& incoming, PendingCommand& pending, Timestamp now) {
  const command_body_t& body = incoming.body;
  pending.id = IdOf(body.id);
  pending.device = body.device;
  pending.operation = incoming.validated.operation;
  pending.arguments = body.arguments;
  pending.expect_epoch = body.expect_epoch;
  pending.begin_by = incoming.validated.begin_by;
  pending.who = incoming.caller.who;
  pending.reason = CappedText(body.reason, kReasonBytes);
  pending.prepare = body.mode == command_body_t::MODE_PREPARE;
  pending.status = incoming.status;
  if (body.mode == command_body_t::MODE_COMMIT) {
    const auto epoch = prepared_.Redeem(body, pending.who, now.mono);
    if (!epoch) return Failure(epoch.error());
    if (pending.expect_epoch < 0) pending.expect_epoch = *epoch;
  }
  return axes_.Substitute(*incoming.validated.bus->family, pending);
}

// Returns an error if the journal cannot note a command at present. An urgent command does not wait for the journal.
Result<> Dispatcher::CheckJournalRoom(const OperationSpec& operation, MonoNs now) const {
  if (operation.urgent) return {};
  if (!loaded_ || journal_.IsStalled(now) || journal_.IsFull()) return Failure(NotJournalled(now));
  return {};
}

// Returns an error if a new command cannot be noted at present. `has_room`: not too many commands are stored.
Result<> Dispatcher::CheckRoom(const OperationSpec& operation, bool has_room, MonoNs now) const {
  if (auto room = CheckJournalRoom(operation, now); !room || operation.urgent || has_room) return room;
  return Failure(std::to_string(CommandStore::kMaxKept) +
                     " commands are within their validity: give commands a shorter one, or send this again later",
                 S::REASON_QUEUE_FULL);
}

void Dispatcher::Accept(IncomingCommand incoming, Timestamp now) {
  Bus& bus = buses_.at(incoming.validated.bus->name);
  const OperationSpec& operation = *incoming.validated.operation;
  DeviceQueue& queue = QueueOf(bus, incoming.body.device, &operation);
  incoming.status.is_unsigned = incoming.caller.grant == nullptr ? 1 : 0;
  incoming.status.state = S::STATE_ACCEPTED;
  const bool is_volatile = IsVolatile(incoming.body, operation);
  const bool has_room = commands_.MakeRoom(now.mono);  // also if this command is refused
  PendingCommand pending;
  Result<> accepted = CheckBusy(bus, queue, now.mono);
  if (accepted && !is_volatile) accepted = CheckRoom(operation, has_room, now.mono);
  if (accepted) accepted = MakePending(incoming, pending, now);
  if (!accepted) incoming.status = Refused(incoming.status, accepted.error(), now);
  if (is_volatile) return EnqueueVolatile(incoming, std::move(pending), accepted, now);
  commands_.Begin(incoming.status, incoming.validated.begin_by);
  if (accepted) {
    pending.status = incoming.status;
    const bool waits = !operation.urgent || !journal_.IsSlow(now.mono);
    pending.journal_state = waits ? PendingCommand::JournalState::kAccepted : PendingCommand::JournalState::kNone;
    pending.journal_since = now.mono;
    queue.Push(std::move(pending));
  }
  JournalAcceptance(incoming, queue, now);
  queue.Tick(now);
}

void Dispatcher::EnqueueVolatile(const IncomingCommand& incoming, PendingCommand pending, const Result<>& accepted,
                                 Timestamp now) {
  commands_.PutVolatile(incoming.status, incoming.validated.begin_by);
  port_.PublishStatus(incoming.status, now);
  if (!accepted) return;
  DeviceQueue& queue =
      QueueOf(buses_.at(incoming.validated.bus->name), incoming.body.device, incoming.validated.operation);
  pending.status = incoming.status;
  queue.Push(std::move(pending));
  queue.Tick(now);
}

// Writes the acceptance or refusal to the journal. If the journal is slow, a refusal is published without waiting.
void Dispatcher::JournalAcceptance(const IncomingCommand& incoming, DeviceQueue& queue, Timestamp now) {
  const command_status_t& status = incoming.status;
  const bool urgent = incoming.validated.operation->urgent;
  if (journal_.IsFull() || (status.is_final != 0 && journal_.IsSlow(now.mono))) {
    return OnAccepted(queue, status, urgent, std::nullopt);
  }
  auto known = std::make_shared<std::optional<command_status_t>>();
  journal_.Give(
      [known, record = RecordOf(incoming, now), now](DurableStore& store) {
        *known = store.Find(IdOf(record.status.id));
        return !*known && store.Accepted(record, now);
      },
      [this, known, status, urgent, &queue](bool written) { OnAccepted(queue, status, written || urgent, *known); },
      now.mono);
}

// `passes`: the journal has noted it, or it does not need to. `known`: an earlier bridge has had this id.
void Dispatcher::OnAccepted(DeviceQueue& queue, const command_status_t& status, bool passes,
                            const std::optional<command_status_t>& known) {
  const CommandId id = IdOf(status.id);
  const bool accepted = status.is_final == 0;
  if (accepted && !queue.IsAwaitingAcceptance(id)) return;  // it has ended, or gone on without the journal
  if (known) {
    static_cast<void>(queue.Withdraw(id));
    commands_.Forget(id);
    if (known->body_digest == status.body_digest) return port_.PublishStatus(*known, now_);
    return Refuse(status, IdReused(), now_);
  }
  command_status_t stands = status;
  if (accepted && !passes) {
    static_cast<void>(queue.Withdraw(id));
    stands = Refused(status, NotJournalled(now_.mono), now_);
    commands_.Update(stands);
  }
  commands_.MarkPublished(stands);
  port_.PublishStatus(stands, now_);
  queue.OnJournalled(id, PendingCommand::JournalState::kAccepted, true, {}, now_);
  queue.Tick(now_);
}

CommandRecord Dispatcher::RecordOf(const IncomingCommand& incoming, Timestamp now) const {
  const command_body_t& body = incoming.body;
  const std::int64_t left_us = (incoming.validated.begin_by - now.mono) / kMicrosecond;
  return {.status = incoming.status,
          .arguments = body.arguments,
          .reason = CappedText(body.reason, kReasonBytes),
          .who = incoming.caller.who,
          .key_id = incoming.caller.key_id,
          .bridge_boot_id = port_.boot_id(),
          .utime = now.utime,
          .begin_by_utime = now.utime + left_us};
}

Error Dispatcher::NotJournalled(MonoNs now) const {
  return {"the journal cannot note it, so nothing is done: " + ErrorText(CheckJournal(now)), S::REASON_JOURNAL};
}

void Dispatcher::Refuse(command_status_t status, const Error& refusal, Timestamp now) {
  port_.PublishStatus(Refused(std::move(status), refusal, now), now);
}

void Dispatcher::OnUnauthorized(const std::string& what, Timestamp now) {
  if (!unauthorized_.Count(now.mono)) return;
  const std::string text = what + "; " + std::to_string(unauthorized_.count()) + " such messages so far";
  devices_.Note({now.utime, "", "foreign", text});
  ports_.log("refused " + text);
}

}  // namespace axlecast
