#include "drivers/saa_can/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/kit/arguments.h"
#include "drivers/saa_can/node_configuration.h"
#include "drivers/saa_can/procedures.h"

namespace axlecast::saa_can {
namespace {

using Made = axlecast::Made<Procedure>;
using Reason = command_status_t;

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
       .arguments = {{"after", "an operation with its arguments, to see whether it took effect", false}},
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

Made BadArgument(std::string_view text) { return Rejected(Reason::REASON_BAD_ARGUMENT, text); }
Made NotPermitted(std::string_view text) { return Rejected(Reason::REASON_NOT_PERMITTED, text); }

std::optional<std::uint8_t> NodeOf(const Arguments& arguments) {
  const auto node = ParseWhole(FindArgument(arguments, "node").value_or(""), kMinNode, kMaxNode);
  return node ? std::optional(static_cast<std::uint8_t>(*node)) : std::nullopt;
}

std::optional<std::int64_t> BitrateArgument(const Arguments& arguments) {
  const auto rate = ParseWhole(FindArgument(arguments, "bitrate").value_or(""), 1, INT64_MAX);
  return rate && BitrateCode(*rate) ? rate : std::nullopt;
}

std::optional<std::uint8_t> PerSecondArgument(const Arguments& arguments) {
  const auto period = ParseWhole(FindArgument(arguments, "period_ms").value_or(""), 1, 1'000);
  return period ? PerSecond(*period) : std::nullopt;
}

bool IsDirection(std::string_view text) { return text == "positive" || text == "negative"; }

constexpr const char* kBadPeriod =
    "period_ms must be 1000 divided by a whole number of 1 to 255: 4, 5, 8, 10, 20, 25, 40, 50, 100, ... 1000";
constexpr const char* kBadNode = "node must be 1 to 255, or 0x01 to 0xff";
constexpr const char* kBadBitrate = "bitrate must be 1000000, 500000 or 250000";

Made MakeDirection(const DriverCommand& order, const OperationContext& around, MonoNs now) {
  const std::string_view direction = FindArgument(order.arguments, "direction").value_or("");
  if (!IsDirection(direction)) return BadArgument("direction must be positive or negative");
  const auto byte = direction == "positive" ? around.settings.positive_byte : around.settings.negative_byte;
  if (!byte) {
    return NotPermitted(Text(
        "the manual prints positive and inverse with the same bytes (22 NN 00): ask the maker for the third byte "
        "and set %s_byte in the file",
        std::string(direction).c_str()));
  }
  return std::make_unique<SetDirection>(*byte, around, now);
}

Made MakePeriod(const DriverCommand& order, const OperationContext& around) {
  const std::optional<std::uint8_t> per_second = PerSecondArgument(order.arguments);
  if (!per_second) return BadArgument(kBadPeriod);
  if (around.settings.mode != Mode::kCyclic) return NotPermitted("the encoder is configured with mode: single");
  if (per_second == around.settings.stop_byte) return NotPermitted("so many a second is stop_byte in the file");
  return std::make_unique<SetPeriod>(*per_second, around);
}

Made MakeStop(const OperationContext& around) {
  if (around.settings.mode != Mode::kSingle) {
    return NotPermitted("the file says mode: cyclic, in which the encoder is to send: set mode: single first");
  }
  if (!around.settings.stop_byte) {
    return NotPermitted(
        "the manual prints stop with the bytes that set the period (31 NN TT): ask the maker for TT and set "
        "stop_byte "
        "in the file");
  }
  return std::make_unique<StopCyclic>(*around.settings.stop_byte, around);
}

// What every node on the bus takes.
Made MakeDialogue(const DriverCommand& order, NodeConfigurationProcedure::Target target,
                  const OperationContext& around, MonoNs now) {
  if (!around.bench) {
    return NotPermitted(
        "every node on the bus would take it: connect this encoder alone, set bench: true at the bus in the file "
        "and "
        "restart the driver");
  }
  if (FindArgument(order.arguments, "confirm") != kConfirmation) {
    return BadArgument(
        "confirm=only_one_connected must be given: every node on the bus takes it, also one that keeps "
        "silent");
  }
  target.before = around.settings.wire_bitrate;
  return std::make_unique<NodeConfigurationProcedure>(target, around, now);
}

Made MakeNode(const DriverCommand& order, const OperationContext& around, MonoNs now) {
  const std::optional<std::uint8_t> node = NodeOf(order.arguments);
  if (!node) return BadArgument(kBadNode);
  if (node == around.settings.node) return NotPermitted("that is its node id in the file");
  return MakeDialogue(order, {.service = Service::kNode, .node = *node}, around, now);
}

Made MakeBitrate(const DriverCommand& order, const OperationContext& around, MonoNs now) {
  const std::optional<std::int64_t> bitrate = BitrateArgument(order.arguments);
  if (!bitrate) return BadArgument(kBadBitrate);
  if (bitrate == around.settings.wire_bitrate) return NotPermitted("the bus runs at that bit rate");
  return MakeDialogue(order, {.service = Service::kBitrate, .bitrate = *bitrate}, around, now);
}

// Whether the operation that `after` tells of took effect.
Made MakeLook(const std::string& text, const OperationContext& around, MonoNs now) {
  const CommandLine after = ParseCommandLine(text);
  const auto read = [&](ReadPosition::After what) -> Made {
    return std::make_unique<ReadPosition>(what, around, now);
  };
  if (after.operation == kZeroName) return read(ReadPosition::After::kZero);
  if (after.operation == kDirectionName) {
    const bool good = IsDirection(FindArgument(after.arguments, "direction").value_or(""));
    return good ? read(ReadPosition::After::kDirection)
                : BadArgument("after names a direction: positive or negative");
  }
  if (after.operation == kBitrateName) {
    return BitrateArgument(after.arguments) ? read(ReadPosition::After::kBitrate) : BadArgument(kBadBitrate);
  }
  if (after.operation == kPeriodName) {
    const std::optional<std::uint8_t> per_second = PerSecondArgument(after.arguments);
    if (!per_second) return BadArgument(kBadPeriod);
    return std::make_unique<LookForPeriod>(kSecond / *per_second, around, now);
  }
  if (after.operation == kNodeName) {
    const std::optional<std::uint8_t> node = NodeOf(after.arguments);
    if (!node) return BadArgument(kBadNode);
    if (!around.bench) return NotPermitted("the new node is heard with bench: true at the bus only");
    return std::make_unique<LookForNode>(*node, around);
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

const OperationSpec* FindOperation(std::string_view name) {
  const auto& specs = Specs();
  const auto found = std::find_if(specs.begin(), specs.end(), [&](const auto& spec) { return spec.name == name; });
  return found == specs.end() ? nullptr : &*found;
}

bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation) {
  const auto has = [&](std::span<const OperationSpec> specs) {
    return std::any_of(specs.begin(), specs.end(), [&](const auto& spec) { return spec.name == operation; });
  };
  if (cia406::IsOwn(device)) return has(cia406::Operations());
  const SaaCanSettings& settings = Own(device);
  if (operation == kDirectionName) return settings.positive_byte || settings.negative_byte;
  if (operation == kPeriodName) return settings.mode == Mode::kCyclic;
  if (operation == kStopName) return settings.mode == Mode::kSingle && settings.stop_byte;
  if (operation == kNodeName || operation == kBitrateName) return OwnBus(bus).bench;
  return has(Specs());
}

std::optional<Outcome> RefusalAtPosition(std::string_view operation, std::int64_t counts,
                                         const SaaCanSettings& settings) {
  if (operation != kDirectionName) return std::nullopt;
  const std::int64_t turn = settings.counts_per_turn;
  return RefusalOfDirectionAt((counts % turn + turn) % turn, settings);
}

bool LooksElsewhere(const DriverCommand& order) { return FindArgument(order.arguments, "after").has_value(); }

Made MakeProcedure(const DriverCommand& order, const OperationContext& around, MonoNs now) {
  if (order.operation == kZeroName) return std::make_unique<Zero>(around, now);
  if (order.operation == kDirectionName) return MakeDirection(order, around, now);
  if (order.operation == kPeriodName) return MakePeriod(order, around);
  if (order.operation == kStopName) return MakeStop(around);
  if (order.operation == kNodeName) return MakeNode(order, around, now);
  if (order.operation == kBitrateName) return MakeBitrate(order, around, now);
  if (order.operation != kReadName) {
    return Rejected(Reason::REASON_UNKNOWN_OPERATION,
                    "an SAA encoder has no operation " + order.operation + "; perhaps model cia406 has");
  }
  if (const auto after = FindArgument(order.arguments, "after")) return MakeLook(std::string(*after), around, now);
  return std::make_unique<ReadPosition>(ReadPosition::After::kNothing, around, now);
}

}  // namespace axlecast::saa_can
