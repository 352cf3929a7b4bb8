#include <utility>

#include "bridge/dispatch/command_port.h"
#include "bridge/dispatch/dispatcher.h"
#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"

// The dispatcher's way in: from a message of a client to a command in the queue of its device.
namespace axlecast {
namespace {

using S = command_status_t;

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

// Why a command cannot be noted at present; what is urgent does not wait for room in a journal.
Result<> Dispatcher::CheckRoom(const OperationSpec& operation, MonoNs now) {
  if (operation.urgent) return {};
  if (!loaded_ || journal_.IsStalled(now) || journal_.IsFull()) return Failure(NotJournalled(now));
  if (!commands_.IsFull(now)) return {};
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
  PendingCommand pending;
  Result<> accepted = CheckBusy(bus, queue, now.mono);
  if (accepted && !is_volatile) accepted = CheckRoom(operation, now.mono);
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
