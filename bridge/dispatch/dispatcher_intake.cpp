#include <utility>

#include "bridge/dispatch/command_port.h"
#include "bridge/dispatch/dispatcher.h"
#include "core/base/text.h"
#include "core/command/command_id.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"

// The dispatcher's way in: from a message of a client to a task in the lane of its device.
namespace axlecast {
namespace {

using S = command_status_t;

Refusal IdReused() { return {S::REASON_ID_REUSED, "this id was used with another body: take a new random id"}; }

// Of a command that this bridge does not remember, while its journal does not answer.
S CannotTell(S status) {
  status.reason_code = S::REASON_JOURNAL;
  status.text = "the journal does not answer at present, so nothing is known of this id: ask again later";
  return status;
}

bool IsBrief(const command_body_t& body, const OperationSpec& operation) {
  return body.mode == command_body_t::MODE_PREPARE || operation.reads_only;
}

}  // namespace

void Dispatcher::OnCommand(Bytes message, Timestamp now) {
  now_ = now;
  devices_.AdvanceTime(now.mono);
  const auto envelope = DecodeMessage<command_t>(message);
  const auto body = envelope ? DecodeMessage<command_body_t>(envelope->body) : std::nullopt;
  if (!body) return OnForeign("a command that cannot be read", now);
  if (watch_.IsListening(now.mono)) return;  // clients repeat
  if (body->mode == command_body_t::MODE_QUERY) {
    Query(*body, now);
    return Settle();
  }
  command_status_t status = StatusOf(*body, BodyDigest(envelope->body));
  auto caller = authority_.Identify(*envelope, *body);
  if (const auto* refusal = std::get_if<Refusal>(&caller)) {
    OnForeign("a command for " + status.device + ": " + refusal->text, now);
    if (foreign_.MayAnswer(now.mono)) Refuse(std::move(status), *refusal, now);
    return;
  }
  Execute({*body, std::get<Caller>(std::move(caller)), {}, std::move(status)}, now);
  Settle();
}

void Dispatcher::Query(const command_body_t& body, Timestamp now) {
  if (const KnownCommand* known = memory_.Find(IdOf(body.id))) {
    if (known->told.state != S::STATE_UNKNOWN) return port_.Tell(known->told, now);
    return port_.Tell(CannotTell(StatusOf(body, 0)), now);
  }
  LookUp(IdOf(body.id), [this, status = StatusOf(body, 0)](auto known, bool can_tell) {
    port_.Tell(known ? *known : can_tell ? status : CannotTell(status), now_);
  });
}

// Asks the journal for a command that this bridge does not remember. It is answered within JournalQueue::kSlow, if
// need be by "cannot tell", so that a client learns of this bridge while the disk has stalled.
void Dispatcher::LookUp(const CommandId& id, decltype(Lookup::answer) answer) {
  if (queue_.IsSlow(now_.mono)) return answer(std::nullopt, false);
  if (lookups_.size() >= kMaxLookups) return;
  auto lookup = std::make_shared<Lookup>(Lookup{std::move(answer), now_.mono});
  lookups_.push_back(lookup);
  auto found = std::make_shared<std::optional<command_status_t>>();
  queue_.Ask(
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
  if (const KnownCommand* known = memory_.Find(IdOf(body.id)); known != nullptr && !cancels) {
    if (known->latest.body_digest != incoming.status.body_digest) return Refuse(incoming.status, IdReused(), now);
    if (known->told.state != S::STATE_UNKNOWN) port_.Tell(known->told, now);
    return;
  }
  const auto admission = Admit(machine_, port_.boot_id(), authority_, incoming.caller, body, now.mono);
  if (const auto* refusal = std::get_if<Refusal>(&admission)) {
    if (refusal->reason == S::REASON_DENIED) ports_.log(incoming.caller.who + ": " + refusal->text);
    return cancels ? TellKnown(body, refusal->text, now) : RefuseUnlessKnown(incoming.status, *refusal, now);
  }
  incoming.admitted = std::get<Admitted>(admission);
  return cancels ? Cancel(incoming, now) : Accept(std::move(incoming), now);
}

// A command that may not be taken up: it may be one that an earlier bridge has taken up.
void Dispatcher::RefuseUnlessKnown(const command_status_t& status, const Refusal& refusal, Timestamp /*now*/) {
  LookUp(IdOf(status.id), [this, status, refusal](const auto& known, bool /*can_tell*/) {
    if (!known) return Refuse(status, refusal, now_);
    if (known->body_digest != status.body_digest) return Refuse(status, IdReused(), now_);
    port_.Tell(*known, now_);
  });
}

void Dispatcher::Cancel(const IncomingCommand& incoming, Timestamp now) {
  const CommandId id = IdOf(incoming.body.id);
  Bus& bus = buses_.at(incoming.admitted.bus->name);
  DeviceQueue& lane = LaneOf(bus, incoming.body.device, incoming.admitted.operation);
  const auto sender = lane.SenderOf(id);
  if (!sender) return TellKnown(incoming.body, "", now);
  if (!authority_.MayCancel(incoming.caller, *sender)) {
    return TellKnown(incoming.body, "only who gave it, or a maintainer, may cancel it", now);
  }
  lane.Cancel(id, now);
  TellKnown(incoming.body, "the driver was asked to give it up if it has not begun", now);
}

// How the command of a cancellation stands. `text` says what came of the latter, unless the command has ended.
void Dispatcher::TellKnown(const command_body_t& body, const std::string& text, Timestamp now) {
  const auto tell = [this, text](command_status_t status) {
    if (!IsFinalState(status.state) && status.state != S::STATE_UNKNOWN) status.text = text;
    port_.Tell(std::move(status), now_);
  };
  if (const KnownCommand* known = memory_.Find(IdOf(body.id))) {
    if (known->told.state != S::STATE_UNKNOWN) return tell(known->told);
    return port_.Tell(CannotTell(StatusOf(body, 0)), now);
  }
  LookUp(IdOf(body.id), [tell, status = StatusOf(body, 0)](const auto& known, bool can_tell) {
    tell(known ? *known : can_tell ? status : CannotTell(status));
  });
}

std::optional<Refusal> Dispatcher::Busy(const Bus& bus, const DeviceQueue& lane, MonoNs now) const {
  if (watch_.Other(now)) {
    return Refusal{S::REASON_FENCED, "another bridge serves this command port: stop one of the two"};
  }
  if (bus.driver.IsAbsent(now)) {
    return Refusal{S::REASON_DRIVER_ABSENT, "the driver of " + bus.config->name +
                                                " is not running: start it (axlecast driver " + bus.config->name +
                                                ", or systemctl)"};
  }
  if (lane.IsFull()) {
    return Refusal{S::REASON_QUEUE_FULL, std::to_string(DeviceQueue::kMaxWaiting) +
                                             " commands wait for this device already: send it again later"};
  }
  return std::nullopt;
}

// Fills `task` for a command. Returns the refusal if the command cannot be carried out.
std::optional<Refusal> Dispatcher::MakeTask(const IncomingCommand& incoming, PendingCommand& task, Timestamp now) {
  const command_body_t& body = incoming.body;
  task.id = IdOf(body.id);
  task.device = body.device;
  task.operation = incoming.admitted.operation;
  task.arguments = body.arguments;
  task.expect_epoch = body.expect_epoch;
  task.begin_by = incoming.admitted.begin_by;
  task.who = incoming.caller.who;
  task.reason = CappedText(body.reason, kReasonBytes);
  task.prepare = body.mode == command_body_t::MODE_PREPARE;
  task.status = incoming.status;
  if (body.mode == command_body_t::MODE_COMMIT) {
    const auto epoch = tokens_.Redeem(body, task.who, now.mono);
    if (const auto* refusal = std::get_if<Refusal>(&epoch)) return *refusal;
    if (task.expect_epoch < 0) task.expect_epoch = std::get<std::int32_t>(epoch);
  }
  return axes_.Substitute(*incoming.admitted.bus->family, task);
}

// Why a command cannot be noted at present; what is urgent does not wait for room in a journal.
std::optional<Refusal> Dispatcher::NoRoom(const OperationSpec& operation, MonoNs now) {
  if (operation.urgent) return std::nullopt;
  if (!loaded_ || queue_.IsStalled(now) || queue_.IsFull()) return NotNoted(now);
  if (!memory_.IsFull(now)) return std::nullopt;
  return Refusal{S::REASON_QUEUE_FULL,
                 std::to_string(CommandStore::kMaxKept) +
                     " commands are within their validity: give commands a shorter one, or send this again later"};
}

void Dispatcher::Accept(IncomingCommand incoming, Timestamp now) {
  Bus& bus = buses_.at(incoming.admitted.bus->name);
  const OperationSpec& operation = *incoming.admitted.operation;
  DeviceQueue& lane = LaneOf(bus, incoming.body.device, &operation);
  incoming.status.is_unsigned = incoming.caller.grant == nullptr ? 1 : 0;
  incoming.status.state = S::STATE_ACCEPTED;
  const bool brief = IsBrief(incoming.body, operation);
  PendingCommand task;
  auto refusal = Busy(bus, lane, now.mono);
  if (!refusal && !brief) refusal = NoRoom(operation, now.mono);
  if (!refusal) refusal = MakeTask(incoming, task, now);
  if (refusal) incoming.status = Refused(incoming.status, *refusal, now);
  if (brief) return AcceptBriefly(incoming, std::move(task), refusal, now);
  memory_.Begin(incoming.status, incoming.admitted.begin_by);
  if (!refusal) {
    task.status = incoming.status;
    const bool waits = !operation.urgent || !queue_.IsSlow(now.mono);
    task.noting = waits ? PendingCommand::Noting::kAccepted : PendingCommand::Noting::kNone;
    task.noting_since = now.mono;
    lane.Push(std::move(task));
  }
  NoteAccepted(incoming, lane, now);
  lane.Tick(now);
}

void Dispatcher::AcceptBriefly(const IncomingCommand& incoming, PendingCommand task,
                               const std::optional<Refusal>& refusal, Timestamp now) {
  memory_.PutBrief(incoming.status, incoming.admitted.begin_by);
  port_.Tell(incoming.status, now);
  if (refusal) return;
  DeviceQueue& lane =
      LaneOf(buses_.at(incoming.admitted.bus->name), incoming.body.device, incoming.admitted.operation);
  task.status = incoming.status;
  lane.Push(std::move(task));
  lane.Tick(now);
}

// Writes the acceptance or refusal to the journal. If the journal is slow, a refusal is published without waiting.
void Dispatcher::NoteAccepted(const IncomingCommand& incoming, DeviceQueue& lane, Timestamp now) {
  const command_status_t& status = incoming.status;
  const bool urgent = incoming.admitted.operation->urgent;
  if (queue_.IsFull() || (status.is_final != 0 && queue_.IsSlow(now.mono))) {
    return OnAccepted(lane, status, urgent, std::nullopt);
  }
  auto known = std::make_shared<std::optional<command_status_t>>();
  queue_.Give(
      [known, record = RecordOf(incoming, now), now](DurableStore& store) {
        *known = store.Find(IdOf(record.status.id));
        return !*known && store.Accepted(record, now);
      },
      [this, known, status, urgent, &lane](bool written) { OnAccepted(lane, status, written || urgent, *known); },
      now.mono);
}

// `passes`: the journal has noted it, or it does not need to. `known`: an earlier bridge has had this id.
void Dispatcher::OnAccepted(DeviceQueue& lane, const command_status_t& status, bool passes,
                            const std::optional<command_status_t>& known) {
  const CommandId id = IdOf(status.id);
  const bool accepted = status.is_final == 0;
  if (accepted && !lane.IsNoting(id)) return;  // it has ended, or gone on without the journal
  if (known) {
    static_cast<void>(lane.Withdraw(id));
    memory_.Forget(id);
    if (known->body_digest == status.body_digest) return port_.Tell(*known, now_);
    return Refuse(status, IdReused(), now_);
  }
  command_status_t stands = status;
  if (accepted && !passes) {
    static_cast<void>(lane.Withdraw(id));
    stands = Refused(status, NotNoted(now_.mono), now_);
    memory_.Update(stands);
  }
  memory_.Tell(stands);
  port_.Tell(stands, now_);
  lane.OnNoted(id, PendingCommand::Noting::kAccepted, true, {}, now_);
  lane.Tick(now_);
}

CommandRecord Dispatcher::RecordOf(const IncomingCommand& incoming, Timestamp now) const {
  const command_body_t& body = incoming.body;
  const std::int64_t left_us = (incoming.admitted.begin_by - now.mono) / kMicrosecond;
  return {.status = incoming.status,
          .arguments = body.arguments,
          .reason = CappedText(body.reason, kReasonBytes),
          .who = incoming.caller.who,
          .key_id = incoming.caller.key_id,
          .bridge_boot_id = port_.boot_id(),
          .utime = now.utime,
          .begin_by_utime = now.utime + left_us};
}

Refusal Dispatcher::NotNoted(MonoNs now) const {
  return {S::REASON_JOURNAL, "the journal cannot note it, so nothing is done: " + JournalProblem(now)};
}

void Dispatcher::Refuse(command_status_t status, const Refusal& refusal, Timestamp now) {
  port_.Tell(Refused(std::move(status), refusal, now), now);
}

void Dispatcher::OnForeign(const std::string& what, Timestamp now) {
  if (!foreign_.Count(now.mono)) return;
  const std::string text = what + "; " + std::to_string(foreign_.count()) + " such messages so far";
  devices_.Note({now.utime, "", "foreign", text});
  ports_.log("refused " + text);
}

}  // namespace axlecast
