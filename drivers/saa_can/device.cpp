#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_can/family.h"
#include "drivers/saa_can/interpreter.h"
#include "drivers/saa_can/node_configuration.h"
#include "drivers/saa_can/procedures.h"

namespace axlecast::saa_can {
namespace {

// After this time, an own frame that no node has acknowledged no longer delays the next one.
constexpr MonoNs kStale = kSecond;
constexpr MonoNs kAfterFullQueue = 100 * kMillisecond;
// The intervals at which a silent encoder is started again, and at which a lost one is polled.
constexpr MonoNs kStartAgain = kSecond;
constexpr MonoNs kAskGone = 250 * kMillisecond;
constexpr int kGone = 4;  // requests in a row without an answer

using Made = Result<std::unique_ptr<Procedure>>;

constexpr std::string_view kZeroName = "zero";
constexpr std::string_view kReadName = "read_position";
constexpr std::string_view kDirectionName = "set_direction";
constexpr std::string_view kPeriodName = "set_period";
constexpr std::string_view kStopName = "stop_cyclic";
constexpr std::string_view kNodeName = "set_node_id";
constexpr std::string_view kBitrateName = "set_bitrate";
// The value of `confirm` that permits the dialogue that every node on the bus obeys.
constexpr std::string_view kConfirmation = "only_one_connected";

const std::vector<OperationSpec>& SaaSpecs() {
  static const ArgumentSpec kConfirm = {"confirm",
                                        "only_one_connected: no other node is on the bus, not even a silent one"};
  static const std::vector<OperationSpec> kSpecs = {
      MovingDatum(
          {.name = kZeroName,
           .help = "Make the present shaft angle the encoder's 0: 20 NN; of model cia406, the preset 6003h",
           .verification = "the position reads 0 within 0.2 degrees or 2 counts, if it read otherwise before",
           .verified_by_operation = kReadName}),
      {.name = kReadName,
       .help = "Read the position once",
       .arguments = {kAfterArgument},
       .reads_only = true,
       .verification = "it is a reading"},
      MovingDatum({.name = kDirectionName,
                   .help = "Set the counting direction (22 NN). Only with the bytes in the file: the manual prints "
                           "both directions alike",
                   .arguments = {{"direction", "positive or negative"}},
                   .verification = "none: the reply shows that it was accepted; only a motion shows the effect",
                   .verified_by_operation = kReadName}),
      {.name = kPeriodName,
       .help = "Set how often the encoder sends by itself (31 NN TT); mode cyclic",
       .arguments = {{"period_ms", "1000 divided by 1 to 255: 4, 5, 8, 10, 20, 25, 40, 50, 100, ... 1000 ms"}},
       .destructive = true,
       .writes = &OneWrite,
       .verification = "five periods are measured",
       .verified_by_operation = kReadName},
      {.name = kStopName,
       .help = "Stop an encoder that sends by itself (31 NN TT); mode single, and only with the byte in the file",
       .destructive = true,
       .writes = &OneWrite,
       .verification = "nothing comes by itself for 1.5 s"},
      {.name = kNodeName,
       .help = "Change the encoder's node id (7E5). On a bench only: every node on the bus changes",
       .arguments = {{"node", "1 to 255 (0x01 to 0xff)"}, kConfirm},
       .destructive = true,
       .needs_permit = true,
       .writes = &OneWrite,
       .verification = "the encoder answers as the new node",
       .verified_by_operation = kReadName},
      {.name = kBitrateName,
       .help = "Change the encoder's bit rate (7E5). On a bench only: every node on the bus changes",
       .arguments = {{"bitrate", "1000000, 500000 or 250000 bit/s"}, kConfirm},
       .destructive = true,
       .needs_permit = true,
       .writes = &OneWrite,
       .verification = "none: the interface still has the old rate; the outcome describes the next steps",
       .verified_by_operation = kReadName},
  };
  return kSpecs;
}

std::optional<std::uint8_t> NodeOf(const Arguments& arguments) {
  const auto node = WholeArgument(arguments, "node", kMinNode, kMaxNode);
  return node ? std::optional(static_cast<std::uint8_t>(*node)) : std::nullopt;
}

std::optional<std::int64_t> BitrateArgument(const Arguments& arguments) {
  const auto rate = WholeArgument(arguments, "bitrate", 1, INT64_MAX);
  return rate && BitrateCode(*rate) ? rate : std::nullopt;
}

std::optional<std::uint8_t> PerSecondArgument(const Arguments& arguments) {
  const auto period = WholeArgument(arguments, "period_ms", 1, 1'000);
  return period ? PerSecond(*period) : std::nullopt;
}

bool IsDirection(const Arguments& arguments) {
  const std::string_view text = FindArgument(arguments, "direction").value_or("");
  return text == "positive" || text == "negative";
}

constexpr const char* kBadPeriod =
    "period_ms must be 1000 divided by a whole number of 1 to 255: 4, 5, 8, 10, 20, 25, 40, 50, 100, ... 1000";
constexpr const char* kBadNode = "node must be 1 to 255, or 0x01 to 0xff";
constexpr const char* kBadBitrate = "bitrate must be 1000000, 500000 or 250000";

Made MakeDirection(const DriverCommand& command, const OperationContext& context, MonoNs now) {
  if (!IsDirection(command.arguments)) return BadArgument("direction must be positive or negative");
  const std::string direction(*FindArgument(command.arguments, "direction"));
  const auto byte = direction == "positive" ? context.settings.positive_byte : context.settings.negative_byte;
  if (!byte) {
    return NotPermitted(Text(
        "the manual prints positive and inverse with the same bytes (22 NN 00): ask the maker for the third byte "
        "and set %s_byte in the file",
        direction.c_str()));
  }
  return std::make_unique<SetDirection>(*byte, context, now);
}

Made MakePeriod(const DriverCommand& command, const OperationContext& context) {
  const std::optional<std::uint8_t> per_second = PerSecondArgument(command.arguments);
  if (!per_second) return BadArgument(kBadPeriod);
  if (context.settings.mode != Mode::kCyclic) return NotPermitted("the encoder is configured with mode: single");
  if (per_second == context.settings.stop_byte)
    return NotPermitted("this rate has the byte that is stop_byte in the file");
  return std::make_unique<SetPeriod>(*per_second, context);
}

Made MakeStop(const OperationContext& context) {
  if (context.settings.mode != Mode::kSingle) {
    return NotPermitted("the encoder is configured with mode: cyclic, in which it sends: set mode: single first");
  }
  if (!context.settings.stop_byte) {
    return NotPermitted(
        "the manual prints stop with the bytes that set the period (31 NN TT): ask the maker for TT and set "
        "stop_byte in the file");
  }
  return std::make_unique<StopCyclic>(*context.settings.stop_byte, context);
}

Made MakeDialogue(const DriverCommand& command, const NodeConfigurationProcedure::Target& target,
                  const OperationContext& context, MonoNs now) {
  if (!context.bench) {
    return NotPermitted(
        "every node on the bus would make the change: connect this encoder alone, set bench: true at the bus in "
        "the file "
        "and restart the driver");
  }
  if (FindArgument(command.arguments, "confirm") != kConfirmation) {
    return BadArgument(
        "confirm=only_one_connected must be given: every node on the bus makes the change, also a silent one");
  }
  return std::make_unique<NodeConfigurationProcedure>(target, context, now);
}

Made MakeNode(const DriverCommand& command, const OperationContext& context, MonoNs now) {
  const std::optional<std::uint8_t> node = NodeOf(command.arguments);
  if (!node) return BadArgument(kBadNode);
  if (node == context.settings.node) return NotPermitted("the encoder has this node id in the file");
  return MakeDialogue(command, {.service = Service::kNode, .node = *node}, context, now);
}

Made MakeBitrate(const DriverCommand& command, const OperationContext& context, MonoNs now) {
  const std::optional<std::int64_t> bitrate = BitrateArgument(command.arguments);
  if (!bitrate) return BadArgument(kBadBitrate);
  if (bitrate == context.settings.wire_bitrate) return NotPermitted("the bus runs at that bit rate");
  return MakeDialogue(command, {.service = Service::kBitrate, .bitrate = *bitrate}, context, now);
}

// Makes the procedure that reads whether the operation `after` took effect.
Made MakeReadAfter(const CommandLine& after, const OperationContext& context, MonoNs now) {
  const auto read = [&](ReadPosition::After what) -> Made {
    return std::make_unique<ReadPosition>(what, context, now);
  };
  if (after.operation == kZeroName) return read(ReadPosition::After::kZero);
  if (after.operation == kDirectionName) {
    if (!IsDirection(after.arguments)) return BadArgument("after names a direction: positive or negative");
    return read(ReadPosition::After::kDirection);
  }
  if (after.operation == kBitrateName) {
    if (!BitrateArgument(after.arguments)) return BadArgument(kBadBitrate);
    return read(ReadPosition::After::kBitrate);
  }
  if (after.operation == kPeriodName) {
    const std::optional<std::uint8_t> per_second = PerSecondArgument(after.arguments);
    if (!per_second) return BadArgument(kBadPeriod);
    return std::make_unique<ReadPeriod>(kSecond / *per_second, context, now);
  }
  if (after.operation == kNodeName) {
    const std::optional<std::uint8_t> node = NodeOf(after.arguments);
    if (!node) return BadArgument(kBadNode);
    if (!context.bench) return NotPermitted("frames of the new node are received only with bench: true at the bus");
    return std::make_unique<ReadNode>(*node, context);
  }
  return BadArgument(
      "after must be zero, set_direction, set_period, set_node_id or set_bitrate with its arguments");
}

Step Sending(const CanFrame& frame, Priority priority) { return {.action = Send{frame}, .priority = priority}; }

// One encoder of the SAA series on CAN: selects what is sent to it, and when. The Interpreter evaluates its frames.
//
// - Mode cyclic: it is started (01 NN) when the link comes up, and once a second while it is silent. With set_period, the
//   rate is set (31 NN TT) before the first start.
// - Mode single: it is polled (80 NN) in each live slot, never before the last request was answered or has timed out.
// - While a frame waits for a node to acknowledge it, at most one further frame a second is sent. So the controller's
//   queue stays short, and no old frames are sent when the bus works again.
class SaaCanDevice final : public CommandDevice<Procedure> {
 public:
  SaaCanDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
      : CommandDevice(device.settings, Operations(), output),
        settings_(Own(device)),
        bench_(OwnBus(bus).bench),
        interpreter_(settings_, bus.late, output) {}

  [[nodiscard]] Step Next(const BusSlot& slot) const override {
    if (!link_up_ || silenced_) return {.action = Idle{kNever}, .priority = Priority::kLive};
    if (slot.now < FreeAt()) return Listening(slot);
    if (const auto step = ForProcedure(slot)) return *step;
    if (ProcedureAlone()) return Listening(slot);
    if (const auto frame = SetUp(slot.now)) return Sending(*frame, Priority::kLive);
    const bool ask = settings_.mode == Mode::kSingle && slot.poll_due && slot.now >= PollAt();
    return ask ? Sending(Poll(), Priority::kLive) : Listening(slot);
  }
  void OnStarted(const Step& step, MonoNs now) override {
    runner_.ExpireIfLate(now);
    const auto* send = std::get_if<Send>(&step.action);
    if (!runner_.busy() || send == nullptr) return;
    Procedure& procedure = runner_.procedure();
    const Procedure::Need need = procedure.NextNeed(now);
    const bool frame = std::holds_alternative<CanFrame>(need);
    if (frame && step.priority != Priority::kCommand) return;
    // A procedure that changes something has not begun with its request for a position: it can still expire.
    if (procedure.reads_only() && NeedsRequest(need)) runner_.OnStarted(true);
    if (frame) procedure.OnStarted(send->frame);
  }
  void On(const Event& event) override {
    if (event.kind == Event::Kind::kLinkUp || event.kind == Event::Kind::kLinkDown) return OnLink(event);
    if (!link_up_) return;
    const MonoNs now = event.End();
    NoteOwn(event, now);
    const Interpreter::Evaluation evaluation = interpreter_.Evaluate(event);
    if (runner_.busy() && !runner_.ExpireIfLate(now)) Report(runner_.procedure().On(event, evaluation, now));
  }
  void Begin(const DriverCommand& command, MonoNs now) override {
    if (!runner_.Begin(command, link_up_, now) || !runner_.procedure().reads_only()) return;
    if (!NeedsRequest(runner_.procedure().NextNeed(now))) runner_.OnStarted(true);  // it listens
  }

 private:
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override {
    const OperationContext context{settings_, bench_, interpreter_, output_};
    if (command.operation == kZeroName) return std::make_unique<Zero>(context, now);
    if (command.operation == kDirectionName) return MakeDirection(command, context, now);
    if (command.operation == kPeriodName) return MakePeriod(command, context);
    if (command.operation == kStopName) return MakeStop(context);
    if (command.operation == kNodeName) return MakeNode(command, context, now);
    if (command.operation == kBitrateName) return MakeBitrate(command, context, now);
    if (command.operation != kReadName) {
      return Failure("an SAA encoder has no operation " + command.operation + "; perhaps model cia406 has",
                     command_status_t::REASON_UNKNOWN_OPERATION);
    }
    if (const auto after = AfterArgument(command.arguments)) return MakeReadAfter(*after, context, now);
    return std::make_unique<ReadPosition>(ReadPosition::After::kNothing, context, now);
  }
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs) const override {
    if (silenced_) {
      return DeviceOffline("the encoder may run at another bit rate since set_bitrate: set the interface to it");
    }
    // A read that verifies an operation is allowed: the encoder may have another node id or bit rate than the configuration.
    if (interpreter_.answering() || FindArgument(command.arguments, "after")) return {};
    return DeviceOffline("nothing is received from the encoder: check its power, its cable, node id and bit rate");
  }
  [[nodiscard]] Result<> CheckPosition(const DriverCommand& command, const Motion& motion) const override {
    if (command.operation != kDirectionName) return {};
    const std::int64_t turn = settings_.counts_per_turn;
    return CheckDirectionAt((motion.counts % turn + turn) % turn, settings_);
  }
  // Returns whether a procedure is carried out during which nothing else may be sent.
  [[nodiscard]] bool ProcedureAlone() const { return runner_.busy() && runner_.procedure().alone(); }
  [[nodiscard]] MonoNs FreeAt() const {
    return std::max(not_before_, interpreter_.unconfirmed() ? sent_at_ + kStale : 0);
  }  // another frame may be sent then
  [[nodiscard]] std::optional<Step> ForProcedure(const BusSlot& slot) const {
    const Procedure* procedure = runner_.Runnable(slot.now);
    if (procedure == nullptr || (slot.reserved && !procedure->alone())) return std::nullopt;
    const Procedure::Need need = procedure->NextNeed(slot.now);
    if (const auto* frame = std::get_if<CanFrame>(&need)) return Sending(*frame, Priority::kCommand);
    if (!NeedsRequest(need) || interpreter_.awaiting()) return std::nullopt;
    return Sending(Poll(), slot.poll_due ? Priority::kLive : Priority::kCommand);
  }
  // Returns whether a frame must be sent to satisfy the need.
  [[nodiscard]] bool NeedsRequest(const Procedure::Need& need) const {
    const bool position = std::holds_alternative<Procedure::Position>(need);
    return std::holds_alternative<CanFrame>(need) || (position && settings_.mode == Mode::kSingle);
  }
  [[nodiscard]] std::optional<CanFrame> SetUp(MonoNs now) const {
    if (settings_.mode == Mode::kSingle) return std::nullopt;
    if (period_to_set_) return CommandFrame(Command::kPeriod, settings_.node, *settings_.set_per_second);
    const bool again = interpreter_.silent_in_a_row() > 0 && now >= sent_at_ + kStartAgain;
    if (settings_.start && (to_start_ || again)) return CommandFrame(Command::kStart, settings_.node);
    return std::nullopt;
  }
  [[nodiscard]] MonoNs PollAt() const {
    if (interpreter_.awaiting()) return kNever;
    return interpreter_.silent_in_a_row() < kGone ? interpreter_.next_request_at() : sent_at_ + kAskGone;
  }
  // An encoder that was switched off and on may have to be started again. The answer to 01 NN also contains a position.
  [[nodiscard]] CanFrame Poll() const {
    const int silent = interpreter_.silent_in_a_row();
    const bool start = settings_.start && (to_start_ || (silent > 0 && silent % 2 == 0));
    return CommandFrame(start ? Command::kStart : Command::kRead, settings_.node);
  }
  // Listens until a position is overdue, a frame may be sent, or the procedure has a deadline.
  [[nodiscard]] Step Listening(const BusSlot& slot) const {
    MonoNs until = interpreter_.due();
    if (slot.now < FreeAt()) {
      until = std::min(until, FreeAt());
    } else if (!ProcedureAlone()) {
      if (settings_.mode == Mode::kSingle && slot.poll_due) until = std::min(until, PollAt());
      const bool again = settings_.mode == Mode::kCyclic && settings_.start && interpreter_.silent_in_a_row() > 0;
      if (again) until = std::min(until, sent_at_ + kStartAgain);
    }
    if (runner_.busy()) until = std::min({until, runner_.procedure().Due(slot.now), runner_.ExpiresAt()});
    return {.action = Listen{std::max(until, slot.now)}, .priority = Priority::kLive};
  }
  void OnLink(const Event& event) {
    link_up_ = event.kind == Event::Kind::kLinkUp;
    if (link_up_) {
      silenced_ = false;
      period_to_set_ = settings_.set_per_second.has_value();
      to_start_ = settings_.start;
      not_before_ = 0;
      return interpreter_.OnLinkUp(event.End());
    }
    interpreter_.OnLinkDown(event.End());
    runner_.OnLinkLost();
  }
  void NoteOwn(const Event& event, MonoNs now) {
    if (event.id != RequestId(settings_.node)) return;
    if (event.kind == Event::Kind::kNotSent) not_before_ = now + kAfterFullQueue;
    if (event.kind != Event::Kind::kSent) return;
    sent_at_ = now;
    const std::optional<Request> request = ParseRequest(event.bytes);
    if (!request) return;
    if (request->command == Command::kStart) to_start_ = false;
    if (request->command == Command::kPeriod) period_to_set_ = false;
  }
  void Report(const std::optional<Outcome>& outcome) {
    const bool silences = runner_.busy() && runner_.procedure().silences();
    if (runner_.Report(outcome) && silences) silenced_ = true;
  }

  const SaaCanSettings& settings_;
  const bool bench_;
  Interpreter interpreter_;

  bool silenced_ = false;  // after a change of the bit rate
  bool period_to_set_ = false;
  bool to_start_ = false;
  MonoNs sent_at_ = 0;     // the newest own frame was queued
  MonoNs not_before_ = 0;  // after a full queue
};

}  // namespace

std::span<const OperationSpec> SaaOperations() { return SaaSpecs(); }

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kAll = [] {
    std::vector<OperationSpec> all = SaaSpecs();
    for (const OperationSpec& spec : cia406::Operations()) {
      if (FindOperation(SaaSpecs(), spec.name) == nullptr) all.push_back(spec);
    }
    return all;
  }();
  return kAll;
}

bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation) {
  if (cia406::IsOwn(device)) return FindOperation(cia406::Operations(), operation) != nullptr;
  const SaaCanSettings& settings = Own(device);
  if (operation == kDirectionName) return settings.positive_byte || settings.negative_byte;
  if (operation == kPeriodName) return settings.mode == Mode::kCyclic;
  if (operation == kStopName) return settings.mode == Mode::kSingle && settings.stop_byte;
  if (operation == kNodeName || operation == kBitrateName) return OwnBus(bus).bench;
  return FindOperation(SaaSpecs(), operation) != nullptr;
}

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                                   SecretSource&) {
  if (cia406::IsOwn(device)) return cia406::MakeDevice(bus, device, output);
  return std::make_unique<SaaCanDevice>(bus, device, output);
}

}  // namespace axlecast::saa_can
