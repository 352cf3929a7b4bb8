#include "drivers/saa_can/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_can/node_configuration.h"
#include "drivers/saa_can/procedures.h"

namespace axlecast::saa_can {
namespace {

using Made = Result<std::unique_ptr<Procedure>>;

constexpr std::string_view kZeroName = "zero";
constexpr std::string_view kReadName = "read_position";
constexpr std::string_view kDirectionName = "set_direction";
constexpr std::string_view kPeriodName = "set_period";
constexpr std::string_view kStopName = "stop_cyclic";
constexpr std::string_view kNodeName = "set_node_id";
constexpr std::string_view kBitrateName = "set_bitrate";
// What has to be said, letter by letter, before the dialogue that every node on the bus takes.
constexpr std::string_view kConfirmation = "only_one_connected";

const std::vector<OperationSpec>& Specs() {
  static const ArgumentSpec kConfirm = {"confirm",
                                        "only_one_connected: no other node is on the bus, not even a silent one"};
  static const std::vector<OperationSpec> kSpecs = {
      {.name = kZeroName,
       .help = "Makes the present shaft angle the encoder's 0: 20 NN; of model cia406, the preset value 6003h",
       .arguments = {},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .writes = &OneWrite,
       .verification = "the position reads 0 within 0.2 degrees or 2 counts, if it read otherwise before",
       .verified_by_operation = kReadName},
      {.name = kReadName,
       .help = "Reads the position once",
       .arguments = {kAfterArgument},
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kDirectionName,
       .help = "Sets which way the encoder counts (22 NN). Only with the bytes in the file: the manual prints both "
               "alike",
       .arguments = {{"direction", "positive or negative"}},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .writes = &OneWrite,
       .verification = "none: the reply says that it was accepted; only a motion shows it",
       .verified_by_operation = kReadName},
      {.name = kPeriodName,
       .help = "Sets how often the encoder sends by itself (31 NN TT); mode cyclic",
       .arguments = {{"period_ms", "1000 divided by 1 to 255: 4, 5, 8, 10, 20, 25, 40, 50, 100, ... 1000 ms"}},
       .destructive = true,
       .writes = &OneWrite,
       .verification = "five periods are measured",
       .verified_by_operation = kReadName},
      {.name = kStopName,
       .help = "Stops an encoder that sends by itself (31 NN TT); mode single, and only with the byte in the file",
       .arguments = {},
       .destructive = true,
       .writes = &OneWrite,
       .verification = "nothing comes by itself for 1.5 s"},
      {.name = kNodeName,
       .help = "Changes the encoder's node id (7E5). On a bench only: every node on the bus takes it",
       .arguments = {{"node", "1 to 255 (0x01 to 0xff)"}, kConfirm},
       .destructive = true,
       .needs_permit = true,
       .writes = &OneWrite,
       .verification = "the encoder answers as the new node",
       .verified_by_operation = kReadName},
      {.name = kBitrateName,
       .help = "Changes the encoder's bit rate (7E5). On a bench only: every node on the bus takes it",
       .arguments = {{"bitrate", "1000000, 500000 or 250000 bit/s"}, kConfirm},
       .destructive = true,
       .needs_permit = true,
       .writes = &OneWrite,
       .verification = "none: the interface still has the old rate; the outcome says how to go on",
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

bool IsDirection(std::string_view text) { return text == "positive" || text == "negative"; }

constexpr const char* kBadPeriod =
    "period_ms must be 1000 divided by a whole number of 1 to 255: 4, 5, 8, 10, 20, 25, 40, 50, 100, ... 1000";
constexpr const char* kBadNode = "node must be 1 to 255, or 0x01 to 0xff";
constexpr const char* kBadBitrate = "bitrate must be 1000000, 500000 or 250000";

Made MakeDirection(const DriverCommand& command, const OperationContext& context, MonoNs now) {
  const std::string_view direction = FindArgument(command.arguments, "direction").value_or("");
  if (!IsDirection(direction)) return BadArgument("direction must be positive or negative");
  const auto byte = direction == "positive" ? context.settings.positive_byte : context.settings.negative_byte;
  if (!byte) {
    return NotPermitted(Text(
        "the manual prints positive and inverse with the same bytes (22 NN 00): ask the maker for the third byte "
        "and set %s_byte in the file",
        std::string(direction).c_str()));
  }
  return std::make_unique<SetDirection>(*byte, context, now);
}

Made MakePeriod(const DriverCommand& command, const OperationContext& context) {
  const std::optional<std::uint8_t> per_second = PerSecondArgument(command.arguments);
  if (!per_second) return BadArgument(kBadPeriod);
  if (context.settings.mode != Mode::kCyclic) return NotPermitted("the encoder is configured with mode: single");
  if (per_second == context.settings.stop_byte) return NotPermitted("so many a second is stop_byte in the file");
  return std::make_unique<SetPeriod>(*per_second, context);
}

Made MakeStop(const OperationContext& context) {
  if (context.settings.mode != Mode::kSingle) {
    return NotPermitted("the file says mode: cyclic, in which the encoder is to send: set mode: single first");
  }
  if (!context.settings.stop_byte) {
    return NotPermitted(
        "the manual prints stop with the bytes that set the period (31 NN TT): ask the maker for TT and set "
        "stop_byte in the file");
  }
  return std::make_unique<StopCyclic>(*context.settings.stop_byte, context);
}

// What every node on the bus takes.
Made MakeDialogue(const DriverCommand& command, NodeConfigurationProcedure::Target target,
                  const OperationContext& context, MonoNs now) {
  if (!context.bench) {
    return NotPermitted(
        "every node on the bus would take it: connect this encoder alone, set bench: true at the bus in the file "
        "and restart the driver");
  }
  if (FindArgument(command.arguments, "confirm") != kConfirmation) {
    return BadArgument(
        "confirm=only_one_connected must be given: every node on the bus takes it, also one that keeps silent");
  }
  target.before = context.settings.wire_bitrate;
  return std::make_unique<NodeConfigurationProcedure>(target, context, now);
}

Made MakeNode(const DriverCommand& command, const OperationContext& context, MonoNs now) {
  const std::optional<std::uint8_t> node = NodeOf(command.arguments);
  if (!node) return BadArgument(kBadNode);
  if (node == context.settings.node) return NotPermitted("that is its node id in the file");
  return MakeDialogue(command, {.service = Service::kNode, .node = *node}, context, now);
}

Made MakeBitrate(const DriverCommand& command, const OperationContext& context, MonoNs now) {
  const std::optional<std::int64_t> bitrate = BitrateArgument(command.arguments);
  if (!bitrate) return BadArgument(kBadBitrate);
  if (bitrate == context.settings.wire_bitrate) return NotPermitted("the bus runs at that bit rate");
  return MakeDialogue(command, {.service = Service::kBitrate, .bitrate = *bitrate}, context, now);
}

// Makes the procedure that reads whether the operation `after` took effect.
Made MakeLook(const CommandLine& after, const OperationContext& context, MonoNs now) {
  const auto read = [&](ReadPosition::After what) -> Made {
    return std::make_unique<ReadPosition>(what, context, now);
  };
  if (after.operation == kZeroName) return read(ReadPosition::After::kZero);
  if (after.operation == kDirectionName) {
    if (IsDirection(FindArgument(after.arguments, "direction").value_or("")))
      return read(ReadPosition::After::kDirection);
    return BadArgument("after names a direction: positive or negative");
  }
  if (after.operation == kBitrateName) {
    if (BitrateArgument(after.arguments)) return read(ReadPosition::After::kBitrate);
    return BadArgument(kBadBitrate);
  }
  if (after.operation == kPeriodName) {
    const std::optional<std::uint8_t> per_second = PerSecondArgument(after.arguments);
    if (!per_second) return BadArgument(kBadPeriod);
    return std::make_unique<LookForPeriod>(kSecond / *per_second, context, now);
  }
  if (after.operation == kNodeName) {
    const std::optional<std::uint8_t> node = NodeOf(after.arguments);
    if (!node) return BadArgument(kBadNode);
    if (!context.bench) return NotPermitted("the new node is heard with bench: true at the bus only");
    return std::make_unique<LookForNode>(*node, context);
  }
  return BadArgument(
      "after must be zero, set_direction, set_period, set_node_id or set_bitrate with its arguments");
}

}  // namespace

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kAll = [] {
    std::vector<OperationSpec> all = Specs();
    for (const OperationSpec& spec : cia406::Operations()) {
      if (FindOperation(spec.name) == nullptr) all.push_back(spec);
    }
    return all;
  }();
  return kAll;
}

const OperationSpec* FindOperation(std::string_view name) { return axlecast::FindOperation(Specs(), name); }

bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation) {
  if (cia406::IsOwn(device)) return axlecast::FindOperation(cia406::Operations(), operation) != nullptr;
  const SaaCanSettings& settings = Own(device);
  if (operation == kDirectionName) return settings.positive_byte || settings.negative_byte;
  if (operation == kPeriodName) return settings.mode == Mode::kCyclic;
  if (operation == kStopName) return settings.mode == Mode::kSingle && settings.stop_byte;
  if (operation == kNodeName || operation == kBitrateName) return OwnBus(bus).bench;
  return FindOperation(operation) != nullptr;
}

Result<> CheckPosition(std::string_view operation, std::int64_t counts, const SaaCanSettings& settings) {
  if (operation != kDirectionName) return {};
  const std::int64_t turn = settings.counts_per_turn;
  return CheckDirectionAt((counts % turn + turn) % turn, settings);
}

bool LooksElsewhere(const DriverCommand& command) { return FindArgument(command.arguments, "after").has_value(); }

Made MakeProcedure(const DriverCommand& command, const OperationContext& context, MonoNs now) {
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
  if (const auto after = AfterArgument(command.arguments)) return MakeLook(*after, context, now);
  return std::make_unique<ReadPosition>(ReadPosition::After::kNothing, context, now);
}

}  // namespace axlecast::saa_can
